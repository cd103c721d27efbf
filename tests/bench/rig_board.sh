#!/bin/sh
# The flashed bytes on the emulated board: trigger errors and step jitter of a sweep against its plan, instructions of
# every interrupt (the means and the worst case), and the step rates it reaches. In virtual time: the machine this runs
# on makes no difference to the figures. An instruction counts as one cycle of 168 MHz.
# usage: rig_board.sh BUILD
set -eu
. "$(dirname "$0")/functions"
bench=$1/tests/bench/bench_board sweep=$1/tests/scenario/board_sweep image=$1/firmware/lumirig/lumirig.bin
[ -x "$bench" ] || skip "bench_board was not built: no libunicorn-dev"
[ -r "$image" ] || skip "no image of the firmware: no arm-none-eabi-gcc"
machine
for name in serial usb emergency; do
    printf '\n%s\n' "sweep, $name:"
    LUMI_TEST_FILTER="*$name*" "$sweep" 2>/dev/null | grep -E ' us$| cy$|^interrupt|^emergency'
done
echo
"$bench" "$image"
