#!/bin/sh
# The firmware's image for QEMU's netduinoplus2 (an STM32F405 that nobody here wrote) boots there and answers on its
# serial line: start-up, interrupts and USART seen by an independent machine.
# usage: qemu_board.sh QEMU_HELLO IMAGE
set -eu
hello=$1 image=$2
if ! command -v qemu-system-arm >/dev/null; then
    echo "skipped: qemu-system-arm is missing (script/bootstrap)"
    exit 77
fi
if [ ! -r "$image" ]; then
    echo "skipped: no image of the firmware: the cross compiler or nanopb's source is missing"
    exit 77
fi
work=$(mktemp -d)
# The machine's second serial line is USART2.
qemu-system-arm -M netduinoplus2 -kernel "$image" -display none -monitor none -serial null \
    -serial "unix:$work/serial,server=on,wait=off" -icount shift=3,sleep=on 2>"$work/qemu" &
pid=$!
trap 'kill $pid 2>/dev/null; rm -rf "$work"' EXIT
"$hello" "$work/serial" && exit 0
cat "$work/qemu"
exit 1
