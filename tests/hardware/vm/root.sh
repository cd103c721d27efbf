#!/bin/sh
# Debian 13 in a folder: what the programs are built from (script/bootstrap's list), drivers' tools, a kernel with its
# modules, and gpio-sim, which Debian's kernel lacks, built from Debian's own source. Prints why and ends with 77 where that
# cannot be had.
# usage: root.sh CACHE     (makes CACHE/root, CACHE/kernel, CACHE/initrd; some 2 GB; kept for the next time)
set -eu
cache=$1
here=$(cd "$(dirname "$0")" && pwd)
source=$(cd "$here/../../.." && pwd)
mirror=${LUMI_DEBIAN_MIRROR:-http://deb.debian.org/debian}

skip() {
    echo "skipped: $1"
    exit 77
}
[ "$(uname -m)" = x86_64 ] || skip "the virtual machine is an x86"
for tool in qemu-system-x86_64 mmdebstrap; do
    command -v $tool >/dev/null || skip "$tool is missing (script/bootstrap test)"
done

packages="$("$source/script/bootstrap" list build | grep -v -e arm-none-eabi),libcmocka-dev,libusbredirparser-dev,libcamera-ipa"
packages="$(echo "$packages" | tr '\n' ',' | sed 's/,,*/,/g'),usbutils,kmod,udev,busybox-static,gpiod,v4l-utils,iproute2,xz-utils,dpkg-dev,file,systemd-sysv"
wanted=$(cat "$0" && echo "$packages $mirror")
root=$cache/root
if [ -e "$cache/made" ] && [ "$(cat "$cache/made")" = "$wanted" ]; then
    exit 0
fi
[ -w "$(dirname "$cache")" ] || mkdir -p "$(dirname "$cache")" || skip "$cache cannot be written"
free=$(df -Pk "$(dirname "$cache")" | awk 'NR == 2 { print int($4 / 1048576) }')
[ "$free" -ge 4 ] || skip "$cache: $free GB are free, 4 are wanted"
if [ "$(id -u)" = 0 ]; then
    mode=root
else
    mode=unshare
    unshare -rm true 2>/dev/null || skip "not root, and no user namespaces"
fi

rm -rf "$cache"
mkdir -p "$cache"
cache=$(cd "$cache" && pwd)
root=$cache/root
# The kernel is unpacked, not installed: an initramfs of Debian's is of no use here.
cat >"$cache/kernel.sh" <<'KERNEL'
set -e
root=$1
in_root() { chroot "$root" sh -ec "$1"; }
in_root '
cd /var/tmp
image=$(apt-cache depends linux-image-amd64 | sed -n "s/.*Depends: \(linux-image-[0-9][^ ]*\)$/\1/p" | head -1)
version=${image#linux-image-}
series=${version%%.*}.$(echo "$version" | cut -d. -f2)
apt-get download -q "$image" linux-source-$series "linux-headers-$version" "linux-headers-${version%-amd64}-common" \
    "linux-kbuild-${version%-amd64}"
dpkg-deb -x ${image}_*.deb /
for package in linux-headers-*.deb linux-kbuild-*.deb; do dpkg-deb -x "$package" /; done
dpkg-deb --fsys-tarfile linux-source-*.deb | tar -xO ./usr/src/linux-source-$series.tar.xz |
    tar -xJ linux-source-$series/drivers/gpio/gpio-sim.c linux-source-$series/drivers/gpio/dev-sync-probe.c \
    linux-source-$series/drivers/gpio/dev-sync-probe.h linux-source-$series/kernel/irq/irq_sim.c 2>/dev/null || true
mkdir gpio && cd gpio
cp ../linux-source-$series/drivers/gpio/*.[ch] ../linux-source-$series/kernel/irq/irq_sim.c .
# Not exported to modules: its public sister does the same and takes the lock itself.
sed -i "s/handle_simple_irq(irq_to_desc(\([^)]*\)))/generic_handle_irq_safe(\1)/" irq_sim.c
grep -q MODULE_LICENSE irq_sim.c || echo "#include <linux/module.h>
MODULE_LICENSE(\"GPL\");" >>irq_sim.c
echo "obj-m := gpio-sim.o irq_sim.o" >Makefile
[ ! -e dev-sync-probe.c ] || echo "obj-m += dev-sync-probe.o" >>Makefile
make -s -C /usr/lib/modules/$version/build M=$PWD modules CONFIG_DEBUG_INFO_BTF_MODULES=
mkdir -p /usr/lib/modules/$version/extra
cp *.ko /usr/lib/modules/$version/extra/
depmod $version
cd / && rm -rf /var/tmp/*
'
KERNEL
echo "making a Debian 13 of $(echo "$packages" | tr ',' ' ' | wc -w) packages in $root" >&2
mmdebstrap --quiet --mode=$mode --variant=minbase --aptopt='APT::Install-Recommends "false"' \
    --dpkgopt='path-exclude=/usr/share/doc/*' --dpkgopt='path-exclude=/usr/share/man/*' \
    --dpkgopt='path-exclude=/usr/share/locale/*' --include="$packages,make,libelf1t64,bc,flex,bison" \
    --customize-hook="sh '$cache/kernel.sh' \"\$1\"" trixie "$root" "$mirror" >"$cache/log" 2>&1 ||
    skip "Debian 13 could not be made: $(grep -v '^$' "$cache/log" | tail -1)"

version=$(basename "$(ls -d "$root"/usr/lib/modules/*-amd64 | head -1)")
cp "$root/boot/vmlinuz-$version" "$cache/kernel"
disk=$cache/initrd.d
mkdir -p "$disk/bin" "$disk/proc" "$disk/sys" "$disk/dev" "$disk/new" "$disk/ro" "$disk/rw"
cp "$root/usr/bin/busybox" "$disk/bin/"
: >"$disk/order"
for module in virtio_pci virtio_blk 9pnet_virtio 9p ext4 overlay; do
    chroot "$root" modprobe -S "$version" --show-depends $module 2>/dev/null | awk '/insmod/ { print $2 }'
done | awk '!seen[$0]++' | while read -r file; do
    name=$(basename "$file" .xz)
    "$root/usr/bin/busybox" xz -dc "$root$file" >"$disk/$name" 2>/dev/null || cp "$root$file" "$disk/$name"
    echo "$name" >>"$disk/order"
done
cp "$here/init" "$disk/init"
chmod +x "$disk/init"
(cd "$disk" && find . | "$root/usr/bin/busybox" cpio -o -H newc 2>/dev/null | gzip -1) >"$cache/initrd"
rm -rf "$disk"
printf '%s' "$wanted" >"$cache/made"
