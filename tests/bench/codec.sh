#!/bin/sh
# Bytes of the codec against WebP (method 6) and a VP9 video of the same images, at equal YUV PSNR (near 38, 40, 42 and
# 45 dB), and tiles decoded a second and core in random order: the shop at grid strides 6 (the whole grid), 2 and 1 (SIDE ×
# SIDE views in its middle), and `room` photographed with noise. bench_codec.c says what is counted.
# usage: codec.sh BUILD [DIR] [SIDE]   (DIR: kept, its photographs used again; SIDE: 5; 21 is all, at stride 1, and hours)
set -eu
. "$(dirname "$0")/functions"
bench=$1/tests/bench/bench_codec lumi=$1/cli/lumi
data=$(dirname "$0")/../../../shared/data/shop/images
[ -x "$bench" ] || skip "bench_codec was not built: no libwebp"
side=${3:-5}
work_folder "${2:-}"
machine

stride() { # STRIDE RANGE
    set -- "$1" "$2" "$(awk -v s="$1" -v side="$side" -v folder="$data" 'BEGIN {
        n = int(20 / s) + 1; if (side < n) n = side
        first = int((20 - (n - 1) * s) / 2)
        for (r = 0; r < n; r++) for (c = 0; c < n; c++)
            printf "%s/r%02dc%02d.jpg ", folder, first + r * s, first + c * s
        exit }')"
    echo "shop, stride $1"
    # shellcheck disable=SC2086
    "$bench" "$(printf '%s\n' $3 | sed 's/.*r\(..\)c.*/\1/' | uniq -c | awk 'NR == 1 { print $1 }')" "$2" $3
}
if [ -d "$data" ]; then
    stride 6 48
    stride 2 24
    stride 1 24
else
    echo "skipped: shop: no $data"
fi

[ -d "$dir/room" ] || "$lumi" sim shoot room --rig planar:5x5:0.05 --fov 60 --size 640x512 --full-well 10000 \
    --read-noise 4 --bits 10 -o "$dir/room"
echo "room, 10,000 electrons at white, 4 electrons of read noise, 10 bits"
find "$dir/room" -name '*.png' | sort | xargs "$bench" 5 48
