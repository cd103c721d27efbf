#!/bin/sh
# Installs into an empty folder, builds examples/view.c against it the three ways there are (pkg-config, CMake shared,
# CMake static) and runs each.
# usage: install.sh SOURCE BUILD CC CMAKE FILE.lumi
set -eu
source=$1 build=$2 cc=$3 cmake=$4 field=$5
top=$(mktemp -d)
trap 'rm -rf "$top"' EXIT
prefix=$top/installed

"$cmake" --install "$build" --prefix "$prefix" >"$top/log" || { cat "$top/log"; exit 1; }
library=$(find "$prefix" -name liblumi.so)
libdir=$(dirname "$library")

foreign=$(nm -D --defined-only "$library" | awk '$2 ~ /[TDBR]/ && $3 !~ /^lumi_/ { print $3 }')
[ -z "$foreign" ] || { echo "exported without the prefix lumi_: $foreign"; exit 1; }

export PKG_CONFIG_PATH="$libdir/pkgconfig"
# shellcheck disable=SC2046
"$cc" -std=c17 -Wall -Wextra -Werror "$source/examples/view.c" -o "$top/view" \
    $(pkg-config --define-variable=prefix="$prefix" --cflags --libs lumi)
cp -r "$source/examples" "$top/examples"
"$cmake" -G Ninja -S "$top/examples" -B "$top/build" -DCMAKE_C_COMPILER="$cc" -DCMAKE_PREFIX_PATH="$prefix" >"$top/log" &&
    "$cmake" --build "$top/build" >>"$top/log" || { cat "$top/log"; exit 1; }

for program in "$top/view" "$top/build/view" "$top/build/view_static"; do
    status=0
    LD_LIBRARY_PATH=$libdir "$program" "$top/missing.lumi" "$top/view.ppm" 2>"$top/said" || status=$?
    [ $status -eq 3 ] && grep -q missing.lumi "$top/said" || { echo "$program: status $status"; cat "$top/said"; exit 1; }
    LD_LIBRARY_PATH=$libdir "$program" "$field" "$program.ppm"
    cmp "$program.ppm" "$top/view.ppm" || { echo "$program: another picture than the others"; exit 1; }
    # a picture of 640 × 480, and not of one colour
    [ "$(wc -c <"$program.ppm")" -eq 921615 ] && [ "$(od -An -v -tu1 -j 460815 -N 1920 "$program.ppm" | tr -s ' ' '\n' |
        sort -u | wc -l)" -gt 20 ] || { echo "$program: no picture"; exit 1; }
done
"$prefix/bin/lumi" --version
