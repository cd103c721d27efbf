#!/bin/sh
# Does the machine stand: its kernel's drivers, the libraries the programs were built with, the programs themselves.
set -eu
build=$LUMI_BUILD
modprobe vivid n_devs=1
modprobe irq_sim 2>/dev/null || true
modprobe gpio-sim
"$build/cli/lumi" --version
grep -q vivid /sys/class/video4linux/*/name
ls -d /sys/kernel/config/gpio-sim
