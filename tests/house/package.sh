#!/bin/sh
# The Debian package: built, and installed by dpkg over this machine's own root (an overlay that goes with the test); the
# program runs there by the unit's own command as the user lumid, and what is removed and purged is gone, captures are not.
# The unit's exposure by systemd's own figure. Skipped where overlays cannot be mounted.
# usage: package.sh CPACK BUILD
set -eu
cpack=$1 build=$2
skip() {
    echo "skipped: $1"
    exit 77
}
[ "$(id -u)" = 0 ] || skip "dpkg wants to be root"
for tool in dpkg dpkg-shlibdeps unshare chroot setpriv ip; do
    command -v $tool >/dev/null || skip "$tool is missing"
done
top=$(mktemp -d)
trap 'rm -rf "$top"' EXIT
mkdir "$top/mount"
unshare -mn sh -c "mount -t tmpfs tmpfs '$top/mount' && cd '$top/mount' && mkdir upper work root &&
    mount -t overlay overlay -o lowerdir=/,upperdir=upper,workdir=work root" 2>/dev/null || skip "no overlays here"

(cd "$build" && "$cpack" -G DEB -B "$top/package" >"$top/log" 2>&1) || { cat "$top/log"; exit 1; }
deb=$(ls "$top"/package/lumisphere_*.deb)
dpkg-deb -I "$deb" | grep -E '^ Depends:.*libc6.*libglib2.0' >/dev/null || { echo "its dependencies are missing"; exit 1; }

cat >"$top/outside" <<'END'
set -e
mount -t tmpfs tmpfs "$2"
cd "$2"
mkdir upper work root
mount -t overlay overlay -o lowerdir=/,upperdir=upper,workdir=work root
mount -t proc proc root/proc
mount --bind /dev root/dev
cp "$1" root/lumisphere.deb
cp "$3" root/inside
ip link set lo up
env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin chroot root sh -e /inside
END
cat >"$top/inside" <<'END'
# Nothing of an earlier installation, and no service manager that a script might talk to.
rm -rf /etc/lumisphere /var/lib/lumisphere /run/systemd/system /run/udev/control
bad() {
    echo "$1"
    exit 1
}
dpkg -i /lumisphere.deb >/log 2>&1 || bad "dpkg -i: $(cat /log)"
id lumid >/dev/null || bad "no user lumid"
[ "$(stat -c %U /var/lib/lumisphere/captures)" = lumid ] || bad "the captures' folder is not lumid's"
[ -e /etc/systemd/system/multi-user.target.wants/lumid.service ] || bad "the service is not enabled"
command=$(sed -n 's/^ExecStart=//p' /usr/lib/systemd/system/lumid.service)
setpriv --reuid lumid --regid lumid --init-groups "$command" --check >/log 2>&1 || bad "--check: $(cat /log)"
setpriv --reuid lumid --regid lumid --init-groups "$command" 2>/log &
process=$!
tries=0
until grep -q 'ready, port 8470' /log; do
    kill -0 $process || bad "it does not start: $(cat /log)"
    tries=$((tries + 1))
    [ $tries -lt 200 ] || bad "it is not ready: $(cat /log)"
    sleep 0.1
done
lumi capture status >/log2 2>&1 || bad "lumi capture status: $(cat /log2)"
kill -TERM $process
wait $process || bad "it ended with $?: $(cat /log)"
echo kept >/var/lib/lumisphere/captures/kept
printf '#mine\n' >>/etc/lumisphere/lumid.conf
dpkg -i /lumisphere.deb >/log 2>&1 || bad "dpkg -i again: $(cat /log)"
grep -q '^#mine' /etc/lumisphere/lumid.conf || bad "the configuration is overwritten"
dpkg -r lumisphere >/log 2>&1 || bad "dpkg -r: $(cat /log)"
[ ! -e /usr/bin/lumid ] && [ -e /etc/lumisphere/lumid.conf ] || bad "it is not removed, or its configuration is"
dpkg -P lumisphere >/log 2>&1 || bad "dpkg -P: $(cat /log)"
[ ! -e /etc/lumisphere ] && [ -e /var/lib/lumisphere/captures/kept ] || bad "purged wrongly"
END
unshare -mn sh "$top/outside" "$deb" "$top/mount" "$top/inside"

dpkg-deb -x "$deb" "$top/tree"
unit=$top/tree/usr/lib/systemd/system/lumid.service
if command -v systemd-analyze >/dev/null && systemd-analyze security --help | grep -q threshold; then
    systemd-analyze security --offline=true --threshold=20 --no-pager "$unit" >"$top/log" 2>&1 || { tail -1 "$top/log"; exit 1; }
    tail -1 "$top/log"
fi
echo "$(basename "$deb") of $(stat -c %s "$deb") bytes: installed, run, removed, purged"
