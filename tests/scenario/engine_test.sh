#!/bin/sh
# engine_test.sh LUMI: shares, status, retry and clear of a run on this computer; what cannot be done is one clear line.
lumi=$1
# shellcheck source=tests/scenario/expect.sh
. "$(dirname "$0")/expect.sh"
cd "$scratch" || exit 1
mounted=
trap '[ -z "$mounted" ] || umount "$mounted"; chmod -R u+w "$scratch"; rm -rf "$scratch"' EXIT
same() { cmp -s "$1" "$2" || fail "$1 and $2 differ: $3"; }

"$lumi" sim shoot room --rig planar:2x2:0.03 --size 70x50 --fov 60 -o a -j 2 >/dev/null || fail "no capture"
options="--neighbours 3 --gp 3"

# Shares; a file that a stage makes for all is copied where it is wanted.
expect_line 3 "nothing was run there" "$lumi" status a
expect_line 3 "nothing was run there" "$lumi" retry a
for share in 3/3 1/3 2/3; do
    for stage in equiangular match depth geometry geometry-coarse; do
        [ $stage = equiangular ] || [ $share = 2/3 ] || continue
        part=$share
        [ $stage = equiangular ] || part=1/1
        expect 0 "$stage: " "$lumi" stage $stage a -w shares --share $part $options
    done
done
expect 0 "compress: 1 made" "$lumi" stage compress a -w shares -o shares.lumi $options
"$lumi" process a -o one.lumi $options >/dev/null || fail "process"
same one.lumi shares.lumi "shares"
expect_line 2 "K/N" "$lumi" stage match a --share 4/3
expect_line 2 "not both" "$lumi" stage match a --share 1/3 --range 0:1
expect_line 2 "a file an image" "$lumi" stage match a -o x
expect_line 2 "--engine" "$lumi" process a -o x.lumi --engine cloud

# Status, clear and retry go by what is on the disk.
expect 0 "done" "$lumi" status a
expect_line 2 "no stage 'mach'" "$lumi" clear a mach --yes
expect_line 2 "nobody to ask" "$lumi" clear a depth </dev/null
expect 0 "thrown away" "$lumi" clear a depth --yes
[ -d a.work/match ] && [ ! -e a.work/depth ] && [ ! -e a.work/compress ] || fail "clear depth: $(ls a.work)"
expect 0 "match                    4       4       4" "$lumi" status a
expect 0 "'lumi retry' goes on with it" "$lumi" status a
rm one.lumi
expect 0 "match                  0 made     4 there" "$lumi" retry a
same one.lumi shares.lumi "gone on with, with its options"
expect 0 "\"done\" : true" "$lumi" status a --json
mkdir outside && touch outside/precious && ln -s ../../outside a.work/depth/link && touch a.work/mine
expect 0 "thrown away" "$lumi" clear a --yes
[ -e outside/precious ] && [ "$(ls a.work)" = mine ] || fail "clear: $(ls -R a.work outside)"
[ -d a/data ] && [ -e one.lumi ] || fail "clear took more than the work folder"
rm -r a.work
printf 'lumi run 1\nfolder x\n' >broken && mkdir a.work && mv broken a.work/run.txt
expect_line 3 "is not whole" "$lumi" status a
rm -r a.work

# Two at once.
mkdir a.work
(
    flock 9
    expect_line 1 "another run is at work there" "$lumi" process a -o two.lumi $options
    expect_line 1 "another run is at work there" "$lumi" clear a --yes
) 9>a.work/.lock || exit 1
[ ! -e two.lumi ] || fail "two runs at once"

# No room, and nothing may be written: only where this test may mount.
mkdir small
if [ "$(id -u)" -eq 0 ] && mount -t tmpfs -o size=64k none small 2>/dev/null; then
    mounted=$scratch/small
    expect_line 1 "small/w" "$lumi" process a -o full.lumi -w small/w $options
    [ -z "$(find small full.lumi* -name '*.tmp-*' 2>/dev/null)" ] || fail "left on a full disk: $(find small)"
    mount -o remount,ro "$mounted" || fail "remount"
    expect_line 1 "Read-only" "$lumi" process a -o full.lumi -w small/w $options
    expect_line 1 "Read-only" "$lumi" clear a -w small/w --yes
    umount "$mounted" && mounted=
else
    echo "engine_test: no full and no read-only disk: this test may not mount"
fi
[ ! -e full.lumi ] || fail "a field out of nothing"
echo "engine_test: passed"
