#!/bin/sh
# firmware_stack.awk finds what it is there for, on a little program of its own.
# usage: firmware_stack_test.sh HERE
set -eu
here=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

# main pushes 5 registers (20) and takes 100, calls a (16 + 400) through a pointer, which calls b (8); the interrupt
# takes 24 and its frame 40. A hundred functions more, so that it looks like a firmware.
base() {
    cat >symbols <<'END'
08000100 T Reset_Handler
08000200 T a
08000300 t b
08000400 T TICK_Handler
08000500 T __aeabi_dmul
END
    cat >disassembly <<'END'
08000100 <Reset_Handler>:
 8000100:	b5f0      	push	{r4, r5, r6, r7, lr}
 8000102:	b099      	sub	sp, #100	@ 0x64
 8000104:	4798      	blx	r3
08000200 <a>:
 8000200:	e92d 41f0 	stmdb	sp!, {r4, r5, r6, lr}
 8000204:	f5ad 7dc8 	sub.w	sp, sp, #400	@ 0x190
 8000208:	f000 f87a 	bl	8000300 <b>
08000300 <b>:
 8000300:	b510      	push	{r4, lr}
 8000302:	bd10      	pop	{r4, pc}
08000400 <TICK_Handler>:
 8000400:	f84d ed18 	str.w	lr, [sp, #-24]!
 8000404:	4770      	bx	lr
08000500 <__aeabi_dmul>:
 8000500:	4770      	bx	lr
END
    i=0
    while [ $i -lt 100 ]; do
        printf '0801%04x T filler%d\n' $((i * 4)) $i >>symbols
        printf '0801%04x <filler%d>:\n 801%04x:\t4770      \tbx\tlr\n' $((i * 4)) $i $((i * 4)) >>disassembly
        i=$((i + 1))
    done
    echo ' 8000000 01020008 00000000 00000000 00000000  ........' >words # a's address, the lowest bit set
    printf 'group table: a\ndefault table\ninterrupt 2: TICK_Handler\n' >calls
}
run() {
    awk -f "$here/firmware_stack.awk" CALLS=calls BOUND="${1:-2000}" calls symbols disassembly words
}
finds() { # TEXT: it fails and says so
    if run >said; then
        echo "not found: $1"
        exit 1
    fi
    grep -q "$1" said || { cat said; echo "not said: $1"; exit 1; }
}

base
run >said
grep -qx 'stack 608 of 2000 bytes' said || { cat said; exit 1; }
if run 607 >said; then
    echo "one byte too many is not found"
    exit 1
fi

base
sed -i 's/^group table: a$/group table: b/' calls
finds 'the address of a is stored'

base
sed -i 's/^ 8000302:.*/ 8000302:\tf7ff ff7d \tbl\t8000200 <a>/' disassembly
finds 'calls in a ring'
echo 'recursion b: 3' >>calls
run >said # 3 rings of 424 bytes
grep -qx 'stack 1456 of 2000 bytes' said || { cat said; exit 1; }

base
sed -i 's/^ 8000404:.*/ 8000404:\tf000 f87c \tbl\t8000500 <__aeabi_dmul>/' disassembly
finds 'double arithmetic'

base
sed -i 's/^ 8000102:.*/ 8000102:\tebad 0d03 \tsub.w\tsp, sp, r3/' disassembly
finds 'sp is moved by a register'

base
sed -i 's/TICK/TOCK/' calls
finds 'no interrupt TOCK_Handler'
echo "firmware_stack.awk sees what it looks for"
