#!/bin/sh
# lumid, built here, takes a capture through the kernel's real drivers: the board on USB (libusb), a USB camera (libcamera),
# vivid (V4L2, several planes, its own buffers) whose exposures an edge of gpio-sim shows (libgpiod 2). In the middle of the
# sweep vivid's pictures are damaged and dropped, each device is unplugged and comes back, the chip with the emergency stop
# as well, and the emergency stop is pressed. In the end every planned frame must be there.
set -eu
vivid=multiplanar=2 configuration=/run/lumid.conf
. /src/tests/hardware/lumid/machine.sh
sed 's/^\[camera c01\]/&\nsync = rig:EXPSYNC\ndmabuf = yes/' $here/lumid.conf >$configuration
mount -t tmpfs tmpfs /disk
mkdir /disk/captures

# Edges as of a camera that exposes ten times a second, all the time; no program is started for one.
cat >/run/pulses <<'END'
exec 9<>/run/wait
while :; do
    for pull in /sys/devices/platform/gpio-sim.*/gpiochip*/sim_gpio2/pull; do
        for level in pull-up pull-down; do
            { echo $level >"$pull"; } 2>/dev/null
            read -r -t 0.04 -u 9
        done
    done
done
END
mkfifo /run/wait
bash /run/pulses &
pulses=$!
grep -l vivid /sys/class/video4linux/video*/name >/run/vivid
vivid_set() { v4l2-ctl -d "/dev/$(basename "$(dirname "$(head -1 /run/vivid)")")" --set-ctrl "$1"; }
go_on() { lumi capture clear && lumi capture resume; }

lumi rig profile set $here/profile.txt
start_lumid
lumi devices
lumi capture start $here/plan_long.txt --name place --preflight
lumi capture status --checks

lumi capture start $here/plan_long.txt --name place
wait_state 120 sweeping
# Some frames are in before anything happens.
wait_until 120 "some frames" at_least stored 4

echo "vivid damages a picture and drops others after $(status_of stored) frames"
vivid_set inject_v4l2_buf_flag_error=1
vivid_set percentage_of_dropped_buffers=30
before=$(status_of stored)
wait_until 120 "frames all the same" at_least stored $((before + 3))
vivid_set percentage_of_dropped_buffers=0

echo "the USB camera is unplugged after $(status_of stored) frames"
echo "host: unplug-camera"
wait_until 60 "the USB camera gone" logged 1 'camera c00 is not there'
wait_until 60 "and back" logged 2 'camera c00 is there'
echo "the board is unplugged after $(status_of stored) frames"
echo "host: unplug-board"
wait_until 60 "the board gone" logged 1 'the board is gone'
wait_until 60 "and back" logged 2 'the board is there'
wait_state 120 sweeping draining done
echo "vivid goes and comes back after $(status_of stored) frames"
echo vivid.0 >/sys/bus/platform/drivers/vivid/unbind
wait_until 60 "vivid gone" logged 1 'camera c01 is not there'
echo vivid.0 >/sys/bus/platform/drivers/vivid/bind
wait_until 60 "and back" logged 2 'camera c01 is there'

echo "the GPIO chip goes and comes back after $(status_of stored) frames"
echo 0 >$gpio/live
wait_until 60 "the chip gone" logged 1 'its chip is gone; that counts as pressed'
wait_state 60 interrupted
live_gpio
wait_until 60 "its emergency stop released" logged 1 'the emergency stop is released'
wait_until 60 "the fault cleared" go_on
wait_state 120 sweeping draining done
echo "emergency stop after $(status_of stored) frames"
echo pull-up >"$lines/sim_gpio0/pull"
wait_state 60 interrupted
echo pull-down >"$lines/sim_gpio0/pull"
wait_until 60 "the emergency stop released" logged 2 'the emergency stop is released'
wait_until 60 "the fault cleared" go_on
wait_state 400 done
lumi capture status
[ "$(status_of complete)" = true ]
[ "$(status_of missing)" = 0 ]
# The first twenty exposures of which no edge was seen are named: of most it was, though the chip was away for a while.
unseen=$(grep -c 'no sync edge of shot' /out/lumid.log || true)
echo "$unseen exposures were seen by no edge"
[ "$unseen" -lt 12 ]
lumi verify /disk/captures/place
lumi info /disk/captures/place
kill $lumid $pulses
wait $lumid
