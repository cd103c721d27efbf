#!/bin/sh
# Builds what runs in the virtual machine with Debian 13's own compiler and libraries, into SOURCE/build/debian13.
# usage: build.sh CACHE
set -eu
cache=$1
source=$(cd "$(dirname "$0")/../../.." && pwd)
[ -d "$cache/root" ] || { echo "no $cache/root: root.sh makes it"; exit 1; }
[ "$(id -u)" = 0 ] && space="unshare -m" || space="unshare -rm"
mkdir -p "$source/build/debian13"
# The tree is mounted where it is seen in the virtual machine too, so that paths in the build are the same there.
cat >"$cache/build.sh" <<'BUILD'
set -e
root=$1 source=$2
mkdir -p "$root/src"
mount --rbind "$source" "$root/src"
mount -t proc proc "$root/proc" 2>/dev/null || mount --rbind /proc "$root/proc"
mount --rbind /dev "$root/dev"
exec env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin chroot "$root" sh -ec '
export HOME=/root
cd /src
cmake -G Ninja -S . -B build/debian13 -DCMAKE_BUILD_TYPE=Release >build/debian13.log
ninja -C build/debian13 lumi_hardware >>build/debian13.log'
BUILD
# shellcheck disable=SC2086
$space sh "$cache/build.sh" "$cache/root" "$source" || {
    echo "the build in Debian 13 failed:"
    tail -30 "$source/build/debian13.log"
    exit 1
}
