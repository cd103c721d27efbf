#!/bin/sh
# A sweep's frames are stored while the power is cut again and again (vm_power.host.sh); each time what was said to be safe
# must be there.
set -eu
mkdir -p /disk
mount -t ext4 /dev/vda /disk
"$LUMI_BUILD/tests/hardware/power_store" /disk /out/acknowledged
umount /disk
