#!/bin/sh
# The real Linux kernel drives the emulated board: xHCI, enumeration, libusb. lsusb reads every descriptor; usb_hello opens
# the device, talks, halts it, sees it unplugged and back.
set -eu
modprobe xhci-pci
for _ in $(seq 100); do
    grep -qs 1209 /sys/bus/usb/devices/*/idVendor && break
    sleep 0.2
done
lsusb -v -d 1209:0001
"$LUMI_BUILD/tests/hardware/usb_hello"
dmesg | grep -E 'usb [0-9]' | tail -20
