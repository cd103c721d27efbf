#!/bin/sh
# What the firmware's image is held to.
# usage: firmware.sh size|symbols|stack|header|same ROOT FOLDER [NANOPB GENERATED VERSION]
#   FOLDER has lumirig.elf and .bin; empty or without them: skipped (77)
set -eu
check=$1 root=$2 out=$3
here=$root/tests/house
elf=$out/lumirig.elf bin=$out/lumirig.bin

if [ -z "$out" ] || [ ! -e "$bin" ]; then
    echo "skipped: the firmware is not built here (script/bootstrap gets what it needs)"
    exit 77
fi

symbol() { # its address, decimal
    printf '%d\n' "0x$(arm-none-eabi-nm "$elf" | awk -v name="$1" '$3 == name { print $1 }')"
}

case $check in
size)
    flash=$(stat -c %s "$bin")
    ram=$(($(symbol bss_end) - 0x20000000))
    stack=$(($(symbol stack_top) - $(symbol stack_bottom)))
    echo "flash $flash of 131072 bytes, RAM $ram of 49152 bytes, of which stack $stack"
    [ "$flash" -gt 16384 ] && [ "$flash" -le 131072 ] && [ "$ram" -gt 4096 ] && [ "$ram" -le 49152 ]
    ;;
symbols)
    # No heap, no stdio, no system calls: nothing of them is in the image.
    if arm-none-eabi-nm "$elf" | grep -E ' (_?(malloc|calloc|realloc|free)(_r)?|_?sbrk(_r)?|.*printf.*|.*scanf.*|f?puts.*|fopen.*|strto[dfl].*|_impure_.*|__assert_func|abort|_exit|_(read|write|open|close)(_r)?)$'; then
        exit 1
    fi
    arm-none-eabi-nm "$elf" | grep -q ' core_poll$'
    ;;
stack)
    work=$(mktemp -d)
    trap 'rm -rf "$work"' EXIT
    arm-none-eabi-nm "$elf" >"$work/symbols"
    arm-none-eabi-objdump -d "$elf" >"$work/disassembly"
    arm-none-eabi-objdump -s -j .text -j .ram_code -j .data -j .vectors "$elf" >"$work/words"
    awk -f "$here/firmware_stack.awk" CALLS="$here/firmware_calls.txt" \
        BOUND=$(($(symbol stack_top) - $(symbol stack_bottom))) "$here/firmware_calls.txt" "$work/symbols" \
        "$work/disassembly" "$work/words"
    ;;
header)
    # Sealing what is sealed changes nothing: size and checksum are right. Another byte does.
    work=$(mktemp -d)
    trap 'rm -rf "$work"' EXIT
    seal=$4
    "$seal" "$bin" "$work/again"
    cmp "$bin" "$work/again"
    [ "$(dd if="$bin" bs=1 skip=512 count=7 2>/dev/null)" = LUMIRIG ]
    [ "$(od -An -tu4 -j524 -N4 "$bin" | tr -d ' ')" = "$(stat -c %s "$bin")" ]
    [ "$(dd if="$bin" bs=1 skip=536 count=9 2>/dev/null)" = stm32f405 ]
    cp "$bin" "$work/other"
    printf x | dd of="$work/other" bs=1 seek=1000 conv=notrunc 2>/dev/null
    "$seal" "$work/other" "$work/resealed"
    [ "$(od -An -tx4 -j532 -N4 "$work/resealed")" != "$(od -An -tx4 -j532 -N4 "$bin")" ]
    if "$seal" "$elf" "$work/wrong" 2>/dev/null; then
        exit 1
    fi
    ;;
same)
    seal=$4 nanopb=$5 generated=$6 version=$7
    work=$(mktemp -d)
    trap 'rm -rf "$work"' EXIT
    there=$work/made/tree
    mkdir -p "$there"
    cp -r "$root/proto" "$root/firmware" "$there"
    cp -r "$generated" "$work/made/generated"
    cp -r "$nanopb" "$work/made/nanopb"
    cmake -S "$there/firmware/stm32f405/cross" -B "$work/made/out" -G Ninja \
        -DCMAKE_TOOLCHAIN_FILE="$there/firmware/stm32f405/cross/arm-none-eabi.cmake" -DLUMI_ROOT="$there" \
        -DLUMI_GENERATED="$work/made/generated" -DLUMI_NANOPB="$work/made/nanopb" -DLUMI_SEAL="$seal" \
        -DLUMI_VERSION="$version" --log-level=WARNING >"$work/log" 2>&1 &&
        CCACHE_DISABLE=1 cmake --build "$work/made/out" -j2 -t lumirig >>"$work/log" 2>&1 || { cat "$work/log"; exit 1; }
    cmp "$bin" "$work/made/out/lumirig.bin"
    sha256sum "$bin" | cut -d' ' -f1
    ;;
esac
