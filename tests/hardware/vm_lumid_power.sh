#!/bin/sh
# lumid takes a capture while the machine loses its power again and again (vm_lumid_power.host.sh); the rig, which has its own,
# goes on or waits. Each time lumid comes up, finds out what is there, and goes on by itself; in the end the capture is
# complete.
set -eu
. /src/tests/hardware/lumid/machine.sh
mount -t ext4 /dev/vda /disk
mkdir -p /disk/captures

if [ ! -e /disk/begun ]; then
    lumi rig profile set $here/profile.txt
    start_lumid
    lumi capture start $here/plan_long.txt --name place
    for _ in $(seq 600); do
        [ -d /disk/captures/place ] && break
        sleep 0.1
    done
    : >/disk/begun
    sync /disk/begun
else
    # What every earlier life had been told was stored must be there, before anything goes on.
    [ ! -e /disk/captures/place/data/capture.db ] || lumi verify /disk/captures/place
    start_lumid
fi
echo "host: storing $(($(status_of frames) - $(status_of stored)))"
wait_state 600 done
kill $lumid
wait $lumid || true
lumi capture status >/dev/null 2>&1 && exit 1
lumi verify /disk/captures/place
lumi info /disk/captures/place
umount /disk
