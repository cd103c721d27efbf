#!/bin/sh
# Bytes of the codec against WebP (method 6) and a VP9 video of the same images, at equal YUV PSNR (near 38, 40, 42 and
# 45 dB), and tiles decoded a second and core in random order: the shop at grid strides 1 and 2 (SIDE x SIDE views in its
# middle) and 6 (the whole grid), at full and at half size, cut and squeezed to 640 x 384, and `room` photographed with
# noise. bench_codec.c says what is counted. About half a core-hour, most of it the peers'.
# usage: codec.sh BUILD [DIR [SIDE [SET...]]]
#   DIR: kept, its photographs used again; SIDE: 5 (21 is all, at stride 1, and hours)
#   SET: of 1 2 6 1h 2h 6h 2c 1s 2s 6s room (all); h is half size, c 640 x 384 out of the middle, s all of it squeezed to
#        640 x 384
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
    set -- 1 2 6 1h 2h 6h 2c 1s 2s 6s room
fi
machine

stride() { # STRIDE QUANTIZERS [OPTION VALUE]
    n=$((20 / $1 + 1)) by=$1 quantizers=$2
    shift 2
    [ $n -le "$side" ] || n=$side
    files=$(awk -v s="$by" -v n=$n -v folder="$data" 'BEGIN {
        first = int((20 - (n - 1) * s) / 2)
        for (r = 0; r < n; r++) for (c = 0; c < n; c++)
            printf "%s/r%02dc%02d.jpg ", folder, first + r * s, first + c * s
        exit }')
    range=24
    [ "$by" -le 2 ] || range=48
    echo "shop, stride $by $*"
    # shellcheck disable=SC2086
    "$bench" --quantizers "$quantizers" "$@" $n $range $files
}
noisy_room() {
    [ -d "$dir/room" ] || "$lumi" sim shoot room --rig planar:5x5:0.05 --fov 60 --size 480x384 --full-well 10000 \
        --read-noise 4 --bits 10 -o "$dir/room"
    echo "room, 10,000 electrons at white, 4 electrons of read noise, 10 bits"
    find "$dir/room" -name '*.png' | sort | xargs "$bench" --quantizers 34,26,18,10 5 48
}

for set in "$@"; do
    case $set in
    room) noisy_room ;;
    *)
        if [ ! -d "$data" ]; then
            echo "skipped: stride $set: no $data"
        else
            case $set in
            6h) stride 6 30,22,16,9 --scale 480x320 ;;
            6s) stride 6 30,22,16,9 --scale 640x384 ;;
            *h) stride "${set%h}" 32,24,16,9 --scale 480x320 ;;
            *c) stride "${set%c}" 30,23,17,10 --crop 640x384 ;;
            *s) stride "${set%s}" 32,24,16,9 --scale 640x384 ;;
            *) stride "$set" 30,22,16,9 ;;
            esac
        fi
        ;;
    esac
done
