#!/bin/sh
# Runs one script of this folder in a virtual machine with Debian 13's kernel, in which the tree, built there, lies at /src:
# real drivers, simulated devices. Skipped, with words, where the machine cannot be had.
# usage: vm.sh CACHE vm_NAME.sh [word=value...]      (words go to the kernel's command line)
#
# vm_NAME.host.sh, where there is one, is sourced first, on this machine: it may start programs (their process numbers into
# $helpers) and add to $qemu, the machine's arguments. $work is a folder of its own; the machine sees it as /out.
# host_asked WORD... is called there when the machine writes a line "host: WORD..." on its console; host_again STATUS when
# the machine has ended (STATUS empty: without a word, as after a power cut: kill -9 $machine); 0 starts it again.
set -eu
cache=$1 script=$2
shift 2
here=$(cd "$(dirname "$0")" && pwd)
source=$(cd "$here/../.." && pwd)
build=$source/build/debian13

"$here/vm/root.sh" "$cache" || exit $?
cache=$(cd "$cache" && pwd)
work=$(mktemp -d)
helpers= machine=
finish() {
    [ -z "$machine" ] || kill -9 "$machine" 2>/dev/null || true
    for process in $helpers; do
        kill -9 "$process" 2>/dev/null || true
    done
    rm -rf "$work"
}
trap finish EXIT
trap 'exit 1' INT TERM
(
    flock 9
    "$here/vm/build.sh" "$cache"
) 9>"$source/build/debian13.lock"

host_asked() {
    echo "nobody here does '$*'"
}
host_again() {
    return 1
}
qemu=
name=${script%.sh}
if [ -e "$here/$name.host.sh" ]; then
    . "$here/$name.host.sh"
fi

# TCG: KVM is not to be had everywhere, and hangs where it is nested badly.
boot() {
    rm -f "$work/status"
    : >"$work/console"
    # shellcheck disable=SC2086
    qemu-system-x86_64 -accel tcg,thread=multi -cpu max -smp 2 -m 2048 -nographic -no-reboot -nodefaults \
        -serial stdio -kernel "$cache/kernel" -initrd "$cache/initrd" \
        -append "console=ttyS0 quiet loglevel=4 panic=-1 mitigations=off no_timer_check net.ifnames=0 lumi.script=$script $words" \
        -fsdev "local,id=root,path=$cache/root,security_model=none,readonly=on,multidevs=remap" \
        -device virtio-9p-pci,fsdev=root,mount_tag=root \
        -fsdev "local,id=source,path=$source,security_model=none,readonly=on,multidevs=remap" \
        -device virtio-9p-pci,fsdev=source,mount_tag=source \
        -fsdev "local,id=out,path=$work,security_model=none" -device virtio-9p-pci,fsdev=out,mount_tag=out \
        $qemu </dev/null >"$work/console" 2>&1 &
    machine=$!
}

# The console's new lines, shown, and what they ask for.
listen() {
    now=$(wc -l <"$work/console")
    [ "$now" -gt "$lines" ] || return 0
    sed -n "$((lines + 1)),${now}p" "$work/console" | tr -d '\r' >"$work/new"
    lines=$now
    cat "$work/new"
    while read -r first rest; do
        # shellcheck disable=SC2086
        [ "$first" != host: ] || host_asked $rest
    done <"$work/new"
}

# Until it ends, or its time is over.
watch() {
    lines=0 waited=0
    while kill -0 "$machine" 2>/dev/null; do
        listen
        sleep 0.2
        waited=$((waited + 1))
        if [ $waited -gt $((5 * ${LUMI_VM_SECONDS:-900})) ]; then
            echo "the machine has not ended after ${LUMI_VM_SECONDS:-900} s"
            exit 1
        fi
    done
    listen
    machine=
}

# QEMU's two threads may see a kernel that patches its own code half patched ("Oops: int3" in sched_clock_cpu): such a
# machine never came to its script, and is started again.
words="$*" lost=0
while :; do
    boot
    watch
    if ! grep -q "vm: " "$work/console" && [ $lost -lt 3 ]; then
        lost=$((lost + 1))
        echo "the machine was lost while it started; once more"
        continue
    fi
    status=$(cat "$work/status" 2>/dev/null || true)
    host_again "$status" || break
done
[ -n "$status" ] || { echo "the machine ended without a word"; exit 1; }
exit "$status"
