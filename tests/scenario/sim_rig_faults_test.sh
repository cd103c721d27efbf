#!/bin/sh
# A simulated rig as processes, the daemon on it, and in one sweep: a camera unplugged and back, a frame that is never
# sent, one that is late, an exposure that is wrong, the board's link cut. The capture is complete; and however the rig
# ends, it leaves nothing behind.
# usage: sim_rig_faults_test.sh LUMI LUMID
set -eu
lumi=$1 lumid=$2
here=$(cd "$(dirname "$0")" && pwd)
# shellcheck source=tests/scenario/rig_daemon.sh
. "$here/rig_daemon.sh"

if [ "${3:-}" = operate ]; then
    start_daemon 8482
    start_capture
    end_capture
    exit 0
fi

need_network
rm -rf sim_rig_faults_test.tmp
mkdir sim_rig_faults_test.tmp
cd sim_rig_faults_test.tmp
# A camera's first triggers are tests, two to five, and so are those of one that was away.
cat >faults.txt <<EOF
at shot 6 camera 0 unplugged for 4s
at shot 12 camera 1 frames dropped for 2.5s
at shot 14 camera 2 frames late 1.2s for 2.5s
at shot 16 camera 3 exposure 4 for 2.5s
at shot 18 link cut for 8s
EOF
"$lumi" sim rig object --rig arc:4x16:0.2 --size 48x48 --white 0.008 -o rig --position-time 2 --patience 6 --port 8482 \
    --faults faults.txt --own-network -- sh "$here/sim_rig_faults_test.sh" "$lumi" "$lumid" operate ||
    fail "the rig ended badly"
capture=$(echo rig/captures/*.capture)
"$lumi" verify "$capture" || fail "the capture is not whole"
"$lumi" info "$capture" >info.txt
grep -q " 64 accepted" info.txt || fail "$(cat info.txt)"
for part in "camera c00 is not there" "camera c00 is there" "c01 lost 1 frames" "c02, came 1" "c03 took shot" "fault host-lost came"; do
    grep -q "$part" rig/lumid.log || fail "the log says nothing of: $part"
done

# ---- however it ends ----

start_rig() { # in a process group of its own
    rm -rf ends
    setsid "$lumi" sim rig object --rig arc:4x8:0.2 --size 32x32 -o ends --drive --own-network -- sleep 600 \
        >ends.txt 2>&1 &
    rig=$!
    tries=0
    until grep -q "^ready" ends.txt; do
        tries=$((tries + 1))
        [ $tries -lt 300 ] && kill -0 $rig || fail "not ready: $(cat ends.txt)"
        sleep 0.1
    done
    [ "$(pgrep -c -g $rig)" -ge 5 ] && [ -L ends/board ] || fail "not all are there: $(ps -o pid,args -g $rig)"
}
end_rig() { # STATUS: of the rig
    status=0
    wait $rig || status=$?
    [ $status -eq "$1" ] || fail "status $status: $(cat ends.txt)"
    ! pgrep -g $rig || fail "left behind: $(ps -o pid,args -g $rig)"
    [ ! -L ends/board ] || fail "the terminal's link is left"
}
start_rig
kill -INT $rig
end_rig 0
start_rig
kill -KILL "$(pgrep -g $rig | sed -n 4p)" # after ourselves, the board, the drive: cameras
end_rig 1
grep -q "cameras .* ended by signal 9" ends.txt || fail "who died is not said: $(cat ends.txt)"
start_rig
kill -KILL "$(pgrep -g $rig | sed -n 2p)" # the board
end_rig 1
