#!/bin/sh
# Cameras under their real drivers: vivid through V4L2.
set -eu
modprobe vivid n_devs=2 multiplanar=1,2 node_types=0x1,0x1 no_error_inj=0
"$LUMI_BUILD/tests/hardware/camera_vivid"
