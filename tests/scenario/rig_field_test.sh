#!/bin/sh
# A simulated rig, the daemon on it, and somebody who looks at the light field so far: a picture in the middle of the sweep, one
# after the program that draws it was killed, one of the sealed capture. The capture is complete as if nobody had looked.
# usage: rig_field_test.sh LUMI LUMID ASK_VIEW
set -eu
lumi=$1 lumid=$2 ask=$3
here=$(cd "$(dirname "$0")" && pwd)
# shellcheck source=tests/scenario/rig_daemon.sh
. "$here/rig_daemon.sh"

drawing() { # the program's number: lumid has no other child
    cat /proc/"$daemon"/task/*/children
}

if [ "${4:-}" = operate ]; then
    start_daemon 8487
    start_capture
    # An arc has four frames.
    "$ask" 4 1 >first.txt || fail "no picture in the sweep"
    echo "seconds from the first row to the first picture, frames, size, mean: $(cat first.txt)"
    read -r seconds frames width height mean <first.txt
    awk -v s="$seconds" -v m="$mean" 'BEGIN { exit !(s < 60 && m > 1) }' || fail "too late or too dark: $(cat first.txt)"
    [ "$width" = 160 ] && [ "$height" = 120 ] && [ "$frames" -lt 64 ] || fail "not this picture: $(cat first.txt)"
    first=$(drawing)
    kill -9 "$first"
    "$ask" 8 8 0.05 0 0 1 >second.txt || fail "no picture after a kill"
    [ "$(drawing)" != "$first" ] || fail "it was not started again"
    grep -q "the preview was ended by signal 9" "$LUMI_SIM_RIG/lumid.log" || fail "nobody said that it was killed"
    end_capture
    "$ask" 64 64 >last.txt || fail "no picture of the sealed capture"
    exit 0
fi

need_network
rm -rf rig_field_test.tmp
mkdir rig_field_test.tmp
cd rig_field_test.tmp
"$lumi" sim rig object --rig arc:4x16:0.2 --size 48x48 --white 0.008 -o rig --position-time 2 --patience 20 --port 8487 --own-network -- \
    sh "$here/rig_field_test.sh" "$lumi" "$lumid" "$ask" operate || fail "the rig ended badly"
capture=$(echo rig/captures/*.capture)
"$lumi" verify "$capture" || fail "the capture is not whole"
"$lumi" info "$capture" >info.txt
grep -q " 64 accepted" info.txt || fail "$(cat info.txt)"
