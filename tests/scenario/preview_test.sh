#!/bin/sh
# The light field so far, of a capture that grows: pictures get better with every arc, are as near the truth as said, and
# the writer is never held up. What is damaged is left out, what is no capture is said in one line.
# usage: preview_test.sh LUMI PREVIEW_ROWS
set -u
lumi=$1 rows=$2
here=$(cd "$(dirname "$0")" && pwd)
# shellcheck source=tests/scenario/expect.sh
. "$here/expect.sh"

cd "$scratch" || exit 1
"$lumi" sim shoot room --rig arc:7x16:0.2 --size 96x77 -o room.capture || fail "sim shoot"
# One view every 60 degrees, from inside the sphere.
"$lumi" sim truth room --from room.capture --random 6 --seed 5 --fov 60 --size 96x72 --no-depth -o truth || fail "sim truth"
"$rows" room.capture truth/transforms.json growing.capture 1,4,16 >rows.txt ||
    fail "not better with every row, or not all rows were seen: $(cat rows.txt)"
cat rows.txt
# Means over all directions; a single arc sees a third of them.
awk '$1 == 1 && $4 < 13 || $1 == 4 && $4 < 21 || $1 == 16 && ($3 < 26 || $4 < 29) { exit 1 }' rows.txt ||
    fail "too far from the truth: $(cat rows.txt)"
"$lumi" verify growing.capture >verify.txt || fail "$(cat verify.txt)"

# The program: one picture, with a frame that is damaged and one that is gone.
chmod -R u+w growing.capture
cp -r growing.capture bad.capture
first=$(find bad.capture/data/frames -type f | sort | head -1)
second=$(find bad.capture/data/frames -type f | sort | sed -n 2p)
head -c 100 "$first" >cut && cp cut "$first"
rm "$second"
expect 0 "110 of 112 frames" "$lumi" preview bad.capture -o view.jpg --yaw 30 --size 160x120 --plain
"$lumi" preview bad.capture -o view.jpg --size 160x120 --plain 2>&1 >/dev/null | wc -l | grep -qx 2 ||
    fail "a frame that cannot be used is not one line"
"$lumi" preview bad.capture -o again.jpg --yaw 30 --size 160x120 --plain -j 1 2>/dev/null
"$lumi" preview bad.capture -o view.jpg --yaw 30 --size 160x120 --plain -j 2 2>/dev/null
cmp view.jpg again.jpg || fail "threads make a difference"

# What cannot be.
expect 3 "no.capture" "$lumi" preview no.capture -o view.jpg
mkdir -p empty/data
head -c 5000 /dev/urandom >empty/data/capture.db
expect 3 "empty" "$lumi" preview empty -o view.jpg
expect 2 "one of -o OUT and --serve" "$lumi" preview growing.capture
expect 2 "field of view" "$lumi" preview growing.capture -o view.jpg --fov 200
expect 2 "a place" "$lumi" preview growing.capture -o view.jpg --x nan

# Lines in, pictures out; what is no line is told and left out, the newest question wins.
printf 'view 1 0 0 0 0 0 1 64 48\nhello\nview 2 0 0 0 0.5 0 1 64 48\nview 3 0 0 0 0 0 99 64 48\n' |
    "$lumi" preview growing.capture --serve >said 2>problems
grep -aq '^news 112 16 ' said || fail "nothing was said of how much there is"
grep -aq '^none 1 ' said || fail "the first question was not told that a newer one was asked"
grep -aq 'jpeg 2 [0-9]* [0-9]*$' said || fail "no picture"
grep -aq 'none 3 a field of view' said || fail "a field of view that cannot be was not refused"
grep -q "view ID" problems || fail "a line that is none was not told"
