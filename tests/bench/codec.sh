#!/bin/sh
# Bytes of the codec against WebP (method 6) and a VP9 video of the same images, at equal YUV PSNR (near 38, 40, 42 and
# 45 dB), and tiles decoded a second and core in random order: the shop at grid strides 1 and 2 (SIDE x SIDE views in its
# middle) and 6 (the whole grid), and `room` photographed with noise. bench_codec.c says what is counted. About 10
# core-minutes, three a set, most of them the peers'.
# usage: codec.sh BUILD [DIR [SIDE [SET...]]]
#   DIR: kept, its photographs used again; SIDE: 5 (21 is all, at stride 1, and hours); SET: of 1 2 6 room (all)
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
    set -- 1 2 6 room
fi
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
noisy_room() {
    [ -d "$dir/room" ] || "$lumi" sim shoot room --rig planar:5x5:0.05 --fov 60 --size 480x384 --full-well 10000 \
        --read-noise 4 --bits 10 -o "$dir/room"
    echo "room, 10,000 electrons at white, 4 electrons of read noise, 10 bits"
    find "$dir/room" -name '*.png' | sort | xargs "$bench" 5 48
}

for set in "$@"; do
    case $set in
    room) noisy_room ;;
    *) if [ -d "$data" ]; then stride "$set" "$([ "$set" -gt 2 ] && echo 48 || echo 24)"; else echo "skipped: stride $set: no $data"; fi ;;
    esac
done
