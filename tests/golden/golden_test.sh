#!/bin/sh
# golden_test.sh LUMI GOLDEN_DUMP GOLDEN_CAPTURE: files written once by the first version of a format are still read, and to
# the same numbers; README.md says how they were made.
lumi=$1
dump=$2
make=$3
golden=$(cd "$(dirname "$0")" && pwd)
# shellcheck source=tests/scenario/expect.sh
. "$golden/../scenario/expect.sh"
cd "$scratch" || exit 1
same() { # WANTED FOUND
    diff "$1" "$2" >difference || fail "$1: read otherwise than when it was written: $(head -20 difference)"
}

for field in "$golden"/fields/*.lumi; do
    name=$(basename "$field" .lumi)
    "$dump" field "$field" >field.txt || fail "$field cannot be read"
    same "${field%.lumi}.txt" field.txt
    for level in fine coarse; do
        "$lumi" render "$field" -o $level.png -p 0.01,0.02,0.01,80,5 -s 48x36 --fov 50 --level $level >/dev/null ||
            fail "$field cannot be rendered"
    done
    # Floating point: the last bit of a sample may differ between compilers and processors.
    "$dump" compare "${field%.lumi}.png" fine.png || fail "$name is drawn otherwise"
    "$dump" compare fine.png coarse.png 2>/dev/null && fail "$name: the comparison takes the coarse level for the fine one"
done

# Captures of every version, and one that is written today: the same rows.
for version in 1 2; do
    rm -rf old && cp -r "$golden/capture-$version" old && mkdir -p old/data/frames
    "$dump" capture old >old.txt || fail "the capture of version $version cannot be read"
    same "$golden/capture-1.txt" old.txt
done
"$dump" log old >log.txt || fail "the log of version 2 cannot be read"
same "$golden/capture-2.txt" log.txt
"$make" new || fail "no capture"
"$dump" capture new >new.txt || fail "the new capture cannot be read"
same "$golden/capture-1.txt" new.txt
"$dump" log new >log.txt || fail "the new log cannot be read"
same "$golden/capture-2.txt" log.txt
expect 0 "7, 2 planned, 1 triggered, 1 received, 1 accepted, 1 rejected, 1 retaken" "$lumi" info old
echo "golden_test: passed"
