#!/bin/sh
# lumid, built here, takes a capture through the kernel's real drivers: the board on USB (libusb), a USB camera (libcamera),
# vivid (V4L2), gpio-sim (libgpiod 2); in the middle of the sweep each is unplugged and comes back, and the emergency stop is
# pressed. In the end every planned frame must be there.
set -eu
. /src/tests/hardware/lumid/machine.sh
mount -t tmpfs tmpfs /disk
mkdir /disk/captures

lumi rig profile set $here/profile.txt
start_lumid
lumi devices
lumi capture start $here/plan.txt --name place --preflight
lumi capture status --checks

lumi capture start $here/plan.txt --name place
wait_state 120 sweeping
# Some frames are in before anything happens.
for _ in $(seq 200); do
    [ "$(status_of stored)" -ge 4 ] && break
    sleep 0.2
done

echo "the USB camera is unplugged after $(status_of stored) frames"
echo "host: unplug-camera"
sleep 4
echo "the board is unplugged after $(status_of stored) frames"
echo "host: unplug-board"
sleep 4
wait_state 120 sweeping draining done
echo "vivid goes and comes back after $(status_of stored) frames"
echo 0 >/sys/bus/platform/drivers/vivid/unbind 2>/dev/null ||
    echo vivid.0 >/sys/bus/platform/drivers/vivid/unbind
sleep 2
echo vivid.0 >/sys/bus/platform/drivers/vivid/bind
sleep 2
echo "emergency stop after $(status_of stored) frames"
echo pull-up >"$lines/sim_gpio0/pull"
wait_state 60 interrupted
echo pull-down >"$lines/sim_gpio0/pull"
sleep 1
lumi capture clear
lumi capture resume
wait_state 400 done
lumi capture status
[ "$(status_of complete)" = true ]
[ "$(status_of missing)" = 0 ]
lumi verify /disk/captures/place
lumi info /disk/captures/place
kill $lumid
wait $lumid
