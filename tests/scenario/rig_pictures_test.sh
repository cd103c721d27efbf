#!/bin/sh
# Pictures of the cameras of a simulated rig: live while nothing is under way, in a sweep, and afterwards; the capture is
# complete all the same.
# usage: rig_pictures_test.sh LUMI LUMID WATCH_PICTURES
set -eu
lumi=$1 lumid=$2 pictures=$3
here=$(cd "$(dirname "$0")" && pwd)
# shellcheck source=tests/scenario/rig_daemon.sh
. "$here/rig_daemon.sh"

cameras() { # FILE
    "$pictures" "$LUMID_ADDRESS" get /api/v1/cameras >"$1" || fail "the cameras cannot be had"
}
# Whether no camera is armed: nobody asks it for pictures.
rest() {
    tries=0
    until "$pictures" "$LUMID_ADDRESS" get /api/v1/status >status.json && ! grep -q '"armed":true' status.json; do
        tries=$((tries + 1))
        [ $tries -lt 100 ] || fail "cameras are still asked for pictures"
        sleep 0.1
    done
}

if [ "${4:-}" = operate ]; then
    # No retakes for smears: what cameras of a few pixels see looks so.
    printf '\n[judge]\nblur_pixels = 50\n' >>"$LUMI_SIM_RIG/lumid.conf"
    start_daemon 8484
    cameras before.json
    grep -q '"last":null' before.json || fail "there is a picture before there was a frame"
    ! "$pictures" "$LUMID_ADDRESS" get /api/v1/cameras/c00/last.jpg >/dev/null 2>&1 || fail "a picture of no frame"
    ! "$pictures" "$LUMID_ADDRESS" live c99 1 2>/dev/null || fail "a camera that is not there"

    # Nothing is under way: test pictures, of this camera alone, until nobody watches any more.
    "$pictures" "$LUMID_ADDRESS" live c00 3 >live.txt || fail "idle: $(cat live.txt)"
    cameras idle.json
    grep -q '"name":"c00","there":true,"live":true,"text":"","last":{"frame":"","shot":null,' idle.json || fail "no figures: $(cat idle.json)"
    grep -q '"name":"c01","there":true,"live":true,"text":"","last":null' idle.json || fail "c01 was asked, too: $(cat idle.json)"
    rest

    # In a sweep: those that come; who watches does not disturb.
    "$pictures" "$LUMID_ADDRESS" live c00 1000 >/dev/null 2>&1 &
    first=$!
    "$pictures" "$LUMID_ADDRESS" live c01 1000 >/dev/null 2>&1 &
    second=$!
    start_capture
    wait_for sweeping
    "$pictures" "$LUMID_ADDRESS" live c01 3 >live.txt || fail "in the sweep: $(cat live.txt)"
    grep -q "3 different" live.txt || fail "in the sweep: $(cat live.txt)"
    cameras sweep.json
    for camera in c00 c01; do
        grep -q "\"name\":\"$camera\",\"there\":true,\"live\":true,\"text\":\"\",\"last\":{\"frame\":\"$camera-t0[01]-p00[0-9]\",\"shot\":[0-9]" \
            sweep.json || fail "no picture of a frame: $(cat sweep.json)"
        "$pictures" "$LUMID_ADDRESS" get /api/v1/cameras/$camera/last.jpg >$camera.jpg || fail "$camera: no picture"
    done
    end_capture

    # And afterwards.
    for camera in c00 c01; do
        "$pictures" "$LUMID_ADDRESS" live $camera 3 >live.txt || fail "afterwards: $(cat live.txt)"
    done
    kill $first $second
    rest
    exit 0
fi

need_network
rm -rf rig_pictures_test.tmp
mkdir rig_pictures_test.tmp
cd rig_pictures_test.tmp
"$lumi" sim rig room --rig arc:3x4:0.18 --size 96x77 -o rig --seed 4 --bits 12 --patience 60 \
    --port 8484 --own-network -- \
    sh "$here/rig_pictures_test.sh" "$lumi" "$lumid" "$pictures" operate || fail "the rig ended badly"
capture=$(echo rig/captures/*.capture)
"$lumi" verify "$capture" || fail "the capture is not whole"
"$lumi" info "$capture" >info.txt
grep -q " 24 accepted" info.txt || fail "not all is there: $(cat info.txt)"
# Frames of before and after it are of no account.
! grep -q "of no shot" rig/lumid.log || fail "a frame of no shot"
