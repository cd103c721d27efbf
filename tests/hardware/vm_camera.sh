#!/bin/sh
# Cameras under their real drivers: vivid through V4L2; a USB camera through V4L2 and through libcamera.
set -eu
bin=$LUMI_BUILD/tests/hardware
modprobe vivid n_devs=2 multiplanar=1,2 node_types=0x1,0x1 no_error_inj=0
"$bin/camera_vivid"
rmmod vivid
modprobe xhci-pci
modprobe uvcvideo nodrop=1
for _ in $(seq 100); do
    [ ! -e /dev/video0 ] || break
    sleep 0.2
done
"$bin/camera_uvc" v4l2:LUMI-UVC-1
LIBCAMERA_LOG_LEVELS='*:ERROR' "$bin/camera_uvc" libcamera:LUMI-UVC-1
