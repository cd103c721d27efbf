#!/bin/sh
# Cameras that record by themselves, through lumid: files that come while the sweep goes on and after it (a card that is
# put in), a camera of which none comes until the crew says that there are no more.
# The pictures are another rig's: nobody judges them.
# usage: lumid_files_test.sh LUMID LUMI
set -u
lumid=$1 lumi=$2
. "$(dirname "$0")/expect.sh"
. "$(dirname "$0")/lumid_alone.sh"

await() { # TEXT: until lumid's status says it
    tries=0
    until "$lumi" capture status >status 2>&1 && grep -q -e "$1" status; do
        kill -0 $daemon 2>/dev/null || fail "lumid has ended: $(cat log)"
        tries=$((tries + 1))
        [ $tries -lt 600 ] || fail "no '$1': $(cat status log)"
        sleep 0.2
    done
}
record() { # CAMERA FIRST LAST: files as a GoPro names them, written beside and moved in
    shot=$2
    while [ "$shot" -le "$3" ]; do
        cp "$(printf 'seen/data/frames/r%02dc%02d.jpg' "$1" "$shot")" "card$1/.writing"
        mv "card$1/.writing" "$(printf 'card%d/100GOPRO/GOPR%04d.JPG' "$1" $((101 + shot)))"
        shot=$((shot + 1))
    done
}
begin() { # NAME
    "$lumi" capture start --name "$1" plan.txt >said 2>&1 || fail "$1 does not begin: $(cat said)"
    grep -q "trigger c01 .*records by itself" said || fail "its trigger is said to be tested: $(cat said)"
    await 'state     sweeping'
    await 'shots     [3-9]'
}

"$lumi" sim shoot object --rig arc:2x12:0.2 --size 64x48 --format jpeg -o seen >/dev/null || fail "no pictures"
"$lumi" rig profile check --print arc16 | sed 's/^width = .*/width = 64/; s/^height = .*/height = 48/
    s/^cx = .*/cx = 32/; s/^cy = .*/cy = 24/; s/^\(f[xy]\) = .*/\1 = 33/' >rig.txt || fail "no rig"
"$lumi" sim board --profile rig.txt --pty "$scratch/board" >board.txt 2>&1 &
board=$!
"$lumi" capture plan still --profile arc16 --print >still.txt || fail "no plan"
sed 's/^positions = .*/positions = 12/; s/^cameras = .*/cameras = c00, c01/; s/^turn_time_s.*/turn_time_s = 16.8/
     s/^position_time_s.*/position_time_s = 1.4/' still.txt >plan.txt
mkdir -p captures card0/100GOPRO card1/100GOPRO
cp seen/data/frames/r00c00.jpg card1/100GOPRO/GOPR0001.JPG # of yesterday
{
    printf '[rig]\nlink = serial:%s/board\n[capture]\nfolder = %s/captures\nretakes = 0\n' "$scratch" "$scratch"
    printf 'frame_patience_s = 1000\n[http]\nlisten = localhost:0\n[judge]\njudging = no\n'
    for camera in 0 1; do
        printf '[camera c0%d]\naddress = files:%s/card%d\noptions = Settle=0.2\n' $camera "$scratch" $camera
    done
} >lumid.conf
: >log
"$lumid" --config lumid.conf 2>>log &
daemon=$!
tries=0
until port=$(sed -n 's/.*ready, port \([0-9]*\),.*/\1/p' log | tail -1) && [ -n "$port" ]; do
    kill -0 $daemon 2>/dev/null || fail "lumid has ended: $(cat log)"
    tries=$((tries + 1))
    [ $tries -lt 600 ] || fail "lumid is not ready: $(cat log)"
    sleep 0.05
done
export LUMID_ADDRESS=localhost:$port
await 'rig .*firmware'

# ---- some at once, the rest from the card ----

begin whole
record 0 0 2
await 'shots     1[0-2]'
record 0 3 11
record 1 0 4
await 'state     draining: waiting for the files of c01: 5 of 12 have come'
record 1 5 11
await 'state     done: sealed, complete'
"$lumi" verify captures/whole >said 2>&1 || fail "whole: $(cat said)"
"$lumi" info captures/whole >info.txt || fail "info"
grep -q "frames    24, 24 received" info.txt || fail "$(cat info.txt status log)"
# Each its picture, byte for byte, and in its place.
for camera in 0 1; do
    for shot in 00 01 02 03 04 05 06 07 08 09 10 11; do
        cmp "captures/whole/data/frames/c0$camera-t00-p0$shot.jpg" "seen/data/frames/r0${camera}c$shot.jpg" ||
            fail "shot $shot of c0$camera is another"
    done
done

# ---- a camera that had no battery ----

rm -r card0/100GOPRO card1/100GOPRO
mkdir card0/100GOPRO card1/100GOPRO
begin half
record 0 0 11
await 'state     draining: waiting for the files of c01: 0 of 12 have come'
"$lumi" capture resume >said 2>&1 || fail "resume: $(cat said)"
await 'state     done'
"$lumi" verify captures/half >said 2>&1 || fail "half: $(cat said)"
"$lumi" capture retake --list >missing.txt 2>&1
[ "$(grep -c "no file of it was found" missing.txt)" -eq 12 ] || fail "$(cat missing.txt status)"
kill -TERM $daemon
wait $daemon || fail "lumid ended with $?: $(cat log)"
daemon=
exit 0
