#!/bin/sh
# Bytes of the codec against WebP (method 6) and a VP9 video of the same images, at equal YUV PSNR (near 38, 40, 42 and
# 45 dB), and tiles decoded a second and core in random order: the shop at grid strides 1 and 2 (SIDE x SIDE views in its
# middle) and 6 (the whole grid), at full and at half size, and `room` photographed with noise. bench_codec.c says what is
# counted. About 20 core-minutes, most of them the peers'.
# usage: codec.sh BUILD [DIR [SIDE [SET...]]]
#   DIR: kept, its photographs used again; SIDE: 5 (21 is all, at stride 1, and hours)
#   SET: of 1 2 6 1h 2h 6h room (all); h is half size, where SIDE is half as much again
set -eu
. "$(dirname "$0")/functions"
bench=$1/tests/bench/bench_codec lumi=$1/cli/lumi
data=$(dirname "$0")/../../../shared/data/shop/images
[ -x "$bench" ] || skip "bench_codec was not built: no libwebp"
work_folder "${2:-}"
side=${3:-5}
if [ $# -gt 3 ]; then
    shift 3
else
    set -- 1 2 6 1h 2h 6h room
fi
machine

stride() { # STRIDE [--half]
    n=$((20 / $1 + 1)) most=$side half=${2:-}
    [ -z "$half" ] || most=$((side * 3 / 2))
    [ $n -le "$most" ] || n=$most
    files=$(awk -v s="$1" -v n=$n -v folder="$data" 'BEGIN {
        first = int((20 - (n - 1) * s) / 2)
        for (r = 0; r < n; r++) for (c = 0; c < n; c++)
            printf "%s/r%02dc%02d.jpg ", folder, first + r * s, first + c * s
        exit }')
    range=24
    [ "$1" -le 2 ] || range=48
    echo "shop, stride $1${half:+, half size}"
    # shellcheck disable=SC2086
    "$bench" $half $n $range $files
}
noisy_room() {
    [ -d "$dir/room" ] || "$lumi" sim shoot room --rig planar:5x5:0.05 --fov 60 --size 480x384 --full-well 10000 \
        --read-noise 4 --bits 10 -o "$dir/room"
    echo "room, 10,000 electrons at white, 4 electrons of read noise, 10 bits"
    find "$dir/room" -name '*.png' | sort | xargs "$bench" 5 48
}

for set in "$@"; do
    case $set in
    room) noisy_room ;;
    *)
        if [ ! -d "$data" ]; then
            echo "skipped: stride $set: no $data"
        elif [ "${set%h}" = "$set" ]; then
            stride "$set"
        else
            stride "${set%h}" --half
        fi
        ;;
    esac
done
