#!/bin/sh
# The real Linux kernel drives the emulated board: a virtual machine with Debian 13's kernel, its xHCI controller and a
# USB device that is our firmware's bytes on the emulated chip, joined by the usbredir protocol. lsusb reads every
# descriptor; usb_hello opens the device with libusb. Skipped, with words, where a tool is missing.
# usage: usb_vm.sh BOARD_REDIR USB_HELLO IMAGE CACHE
# CACHE keeps the unpacked Debian packages (some 140 MB) for the next time.
set -eu
redir=$1 hello=$2 image=$3 cache=$4

skip() {
    echo "skipped: $1"
    exit 77
}
for tool in qemu-system-x86_64 mmdebstrap; do
    command -v $tool >/dev/null || skip "$tool is missing (script/bootstrap all)"
done
[ -r "$image" ] || skip "no image of the firmware: the cross compiler or nanopb's source is missing"
[ "$(uname -m)" = x86_64 ] || skip "the virtual machine is an x86"

work=$(mktemp -d)
redir_pid= qemu_pid=
finish() {
    [ -z "$qemu_pid" ] || kill "$qemu_pid" 2>/dev/null || true
    [ -z "$redir_pid" ] || kill -9 "$redir_pid" 2>/dev/null || true
    rm -rf "$work"
}
trap finish EXIT

# Packages unpacked, none installed: the virtual machine runs from memory.
root=$cache/trixie
if [ ! -e "$root.done" ]; then
    rm -rf "$root"
    mkdir -p "$cache"
    mmdebstrap --quiet --variant=extract --aptopt='APT::Install-Recommends "false"' \
        --dpkgopt='path-exclude=/usr/share/*' --include=busybox-static,libusb-1.0-0,usbutils,linux-image-amd64 \
        trixie "$root" http://deb.debian.org/debian >"$work/mmdebstrap" 2>&1 ||
        skip "Debian 13's packages could not be had: $(tail -1 "$work/mmdebstrap")"
    : >"$root.done"
fi
kernel=$(ls "$root"/boot/vmlinuz-* | head -1)
modules=$root/usr/lib/modules/${kernel##*/vmlinuz-}/kernel

# A memory disk of busybox, the USB modules, libusb, lsusb and the test.
disk=$work/disk
mkdir -p "$disk/bin" "$disk/proc" "$disk/sys" "$disk/dev" "$disk/lib" "$disk/lib64"
cp "$root/usr/bin/busybox" "$root/usr/bin/lsusb" "$disk/bin/"
cp "$hello" "$disk/bin/usb_hello"
cp "$root/usr/lib64/ld-linux-x86-64.so.2" "$disk/lib64/"
for library in libusb-1.0.so.0 libudev.so.1 libc.so.6 libpthread.so.0 libm.so.6 libcap.so.2; do
    cp -L "$root/usr/lib/x86_64-linux-gnu/$library" "$disk/lib/"
done
for module in common/usb-common core/usbcore host/xhci-hcd host/xhci-pci; do
    "$root/usr/bin/busybox" xz -dc "$modules/drivers/usb/$module.ko.xz" >"$disk/${module##*/}.ko"
done
cat >"$disk/init" <<'INIT'
#!/bin/busybox sh
/bin/busybox --install -s /bin
export PATH=/bin LD_LIBRARY_PATH=/lib
mount -t proc proc /proc; mount -t sysfs sys /sys; mount -t devtmpfs dev /dev
for module in usb-common usbcore xhci-hcd xhci-pci; do
    insmod /$module.ko
done
for i in $(seq 100); do
    grep -qs 1209 /sys/bus/usb/devices/*/idVendor && break
    sleep 0.2
done
echo "vm: $(uname -r), device after $(cut -d' ' -f1 /proc/uptime) s"
lsusb -v -d 1209:0001
usb_hello && echo "vm: PASSED"
dmesg | grep -E 'usb [0-9]' | tail -20
poweroff -f
INIT
chmod +x "$disk/init" "$disk/bin/"*
(cd "$disk" && find . | "$root/usr/bin/busybox" cpio -o -H newc 2>/dev/null | gzip -1) >"$work/initrd"

"$redir" "$image" "$work/socket" >"$work/redir" 2>&1 &
redir_pid=$!
while ! grep -q waiting "$work/redir"; do
    kill -0 $redir_pid 2>/dev/null || { cat "$work/redir"; exit 1; }
    sleep 0.1
done
nice qemu-system-x86_64 -accel tcg,thread=multi -cpu max -smp 2 -m 512 -nographic -no-reboot -nodefaults -serial stdio \
    -kernel "$kernel" -initrd "$work/initrd" -append "console=ttyS0 quiet panic=-1 mitigations=off no_timer_check" \
    -device qemu-xhci -chardev socket,id=board,path="$work/socket" -device usb-redir,chardev=board \
    </dev/null >"$work/console" 2>&1 &
qemu_pid=$!

seconds=0 unplugged=
while kill -0 $qemu_pid 2>/dev/null; do
    if [ -z "$unplugged" ] && grep -q 'UNPLUG NOW' "$work/console"; then
        unplugged=yes
        kill -USR1 $redir_pid
    fi
    sleep 0.5
    seconds=$((seconds + 1))
    [ $seconds -lt 600 ] || break
done
cat "$work/console"
kill -TERM $redir_pid 2>/dev/null || true
sleep 0.5
cat "$work/redir"
grep -q 'vm: PASSED' "$work/console"
