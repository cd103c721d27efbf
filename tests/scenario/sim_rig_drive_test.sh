#!/bin/sh
# A simulated rig with an industrial drive: the daemon takes a start-stop capture with it, the drive being silent for a
# while and then having an alarm, which is reset when a person says that it goes on.
# usage: sim_rig_drive_test.sh LUMI LUMID
set -eu
lumi=$1 lumid=$2
here=$(cd "$(dirname "$0")" && pwd)
# shellcheck source=tests/scenario/rig_daemon.sh
. "$here/rig_daemon.sh"

if [ "${3:-}" = operate ]; then
    judge_nothing
    start_daemon 8481
    start_capture
    "$lumi" capture status --json | grep -q 'simulated answers: [^"]*, at 0.000 turns' ||
        fail "the drive was not asked: $("$lumi" capture status --json)"
    wait_for "interrupted: the drive: drive simulated: fault 42$" # nothing goes on by itself
    sleep 1                                                     # until the cause is gone
    "$lumi" capture resume || fail "resume"
    end_capture
    exit 0
fi

need_network
rm -rf sim_rig_drive_test.tmp
mkdir sim_rig_drive_test.tmp
cd sim_rig_drive_test.tmp
# A camera's first two triggers are tests.
printf 'at shot 5 drive silent for 3s\nat shot 8 drive alarm for 500ms\n' >faults.txt
"$lumi" sim rig object --rig arc:4x8:0.2 --size 48x48 --white 0.008 -o rig --drive --position-time 2 --patience 8 --port 8481 \
    --faults faults.txt --own-network -- sh "$here/sim_rig_drive_test.sh" "$lumi" "$lumid" operate ||
    fail "the rig ended badly"
grep -q "the drive: .*no answer" rig/lumid.log || fail "nobody noticed the silence"
capture=$(echo rig/captures/*.capture)
"$lumi" verify "$capture" || fail "the capture is not whole"
"$lumi" info "$capture"
# The platform was turned: no two pictures of a camera are the same.
all=$(find "$capture" -name '*.dng' | wc -l)
other=$(find "$capture" -name '*.dng' -exec tail -c 4608 {} \; | split -b 4608 --filter=sha256sum | sort -u | wc -l)
[ "$all" -eq "$other" ] && [ "$all" -ge 32 ] || fail "$all frames, $other different ones"
