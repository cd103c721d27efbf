#!/bin/sh
# Bytes of the codec against WebP and VP9 video on the shop at grid strides 1, 2 and 6, and on a folder of images named
# rRRcCC.* (such as a simulated room with noise) if one is given.
#   tests/bench/codec.sh BUILD SHOP_IMAGES [FOLDER COLUMNS RANGE]
[ $# -ge 2 ] || { echo "usage: $0 BUILD SHOP_IMAGES [FOLDER COLUMNS RANGE]" >&2; exit 2; }
bench=$1/tests/bench/bench_codec
shop=$2
stride() { # STRIDE RANGE
    files='' columns=0 row=0
    while [ $row -lt 21 ]; do
        column=0 columns=0
        while [ $column -lt 21 ]; do
            files="$files $shop/$(printf 'r%02dc%02d.jpg' $row $column)"
            columns=$((columns + 1)) column=$((column + $1))
        done
        row=$((row + $1))
    done
    echo "shop, stride $1"
    # shellcheck disable=SC2086
    "$bench" $columns "$2" $files
}
if [ -d "$shop" ]; then
    stride 6 48
    stride 2 24
    stride 1 24
else
    echo "$shop is not there: skipped"
fi
if [ $# -ge 5 ]; then
    echo "$3"
    # shellcheck disable=SC2046
    "$bench" "$4" "$5" $(ls "$3"/r*c*.*)
fi
