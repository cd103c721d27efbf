#!/bin/sh
# Edges of the kernel's simulated GPIO chip through libgpiod 2.
set -eu
modprobe irq_sim 2>/dev/null || true
modprobe gpio-sim
config=/sys/kernel/config/gpio-sim/rig
mkdir -p $config/bank0/line0 $config/bank0/line1
echo 8 >$config/bank0/num_lines
echo rig >$config/bank0/label
echo ESTOP >$config/bank0/line0/name
echo EXPSYNC >$config/bank0/line1/name
echo 1 >$config/live
"$LUMI_BUILD/tests/hardware/gpio_chip" rig "/sys/devices/platform/$(cat $config/dev_name)" $config/live
