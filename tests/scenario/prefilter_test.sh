#!/bin/sh
# prefilter_test.sh LUMI: the prefilter from a simulated place: the same bytes whatever the threads and ranges, made
# again only where its parameter changes, and measured along a path.
lumi=$1
# shellcheck source=tests/scenario/expect.sh
. "$(dirname "$0")/expect.sh"
cd "$scratch" || exit 1
same() { cmp -s "$1" "$2" || fail "$1 and $2 differ: $3"; }

"$lumi" sim shoot room --rig planar:3x3:0.03 --size 96x72 --fov 60 -o a -j 2 >/dev/null || fail "no capture"
"$lumi" sim truth room --from a --random 2 --size 96x72 --fov 40 --no-depth -o truth -j 2 >/dev/null || fail "no truth"

# Without it there is no such stage; with it, the same bytes for any number of threads and in pieces.
"$lumi" process a -o plain.lumi >/dev/null || fail "process"
[ ! -e a.work/prefilter ] || fail "a prefilter that nobody asked for"
expect 0 "prefilter              9 made     0 there" "$lumi" process a -o one.lumi --prefilter 2 -j 1
! cmp -s plain.lumi one.lumi || fail "the prefilter changes nothing"
for stage in equiangular match depth geometry geometry-coarse; do
    "$lumi" stage $stage a -w pieces >/dev/null || fail "stage $stage"
done
expect 0 "prefilter: 4 made, 0 there" "$lumi" stage prefilter a -w pieces --range 5:9 --prefilter 2 -j 3
expect 0 "prefilter: 5 made, 0 there" "$lumi" stage prefilter a -w pieces --range 0:5 --prefilter 2 -j 2
for file in a.work/prefilter/*.exr; do
    same "$file" "pieces/prefilter/$(basename "$file")" "threads and ranges"
done

# Its number of samples is part of its key, and what rests on nothing of it is not made again.
expect 0 "prefilter              0 made     9 there" "$lumi" process a -o again.lumi --prefilter 2
same one.lumi again.lumi "skipping"
expect 0 "prefilter              9 made     0 there" "$lumi" process a -o more.lumi --prefilter 4
expect 0 "geometry               0 made     9 there" "$lumi" process a -o more.lumi --prefilter 0
same plain.lumi more.lumi "going back to none"

expect 0 "2 frames; mean difference" "$lumi" eval one.lumi --truth truth/transforms.json --flicker
expect 0 '"frames":2,' "$lumi" eval one.lumi --truth truth/transforms.json --flicker --json
expect_line 2 "goes with --truth FILE" "$lumi" eval one.lumi --truth truth/transforms.json --flicker --sheet x.png
expect_line 2 "two frames" "$lumi" eval one.lumi --truth truth/transforms.json --flicker --frames v0000
