#!/bin/sh
# What a run from a rig's capture to a field costs at 1280 x 1024: core-seconds an image and the most memory held, stage by
# stage, each in a process of its own on one thread; and from that the wall time of 1,290 images on two cores, where
# nothing else runs: core-seconds an image times 1,290, halved; stages that make one file for all are taken to grow with
# the number of images and to use one core (compress: both).
#
# A stage's bytes a pixel (struct lumi_stage) are what it holds beyond a process that finds everything there.
# usage: process.sh BUILD [DIR] [RIG] [WIDTHxHEIGHT]   (DIR: kept, its photographs used again)
set -eu
. "$(dirname "$0")/functions"
lumi=$1/cli/lumi
shift
work_folder "${1:-}"
rig=${2:-arc:4x5:0.2}
size=${3:-1280x1024}
machine
[ -x /usr/bin/time ] || skip "no /usr/bin/time"

capture=$dir/process.capture
[ -d "$capture" ] || "$lumi" sim shoot room --rig "$rig" --size "$size" --pose-error 5,0.5 -o "$capture"
rm -rf "$capture.work"
options="--calibrate auto --equalize auto --synthesize auto --subsample auto --prefilter auto"
pixels=$(echo "$size" | awk -Fx '{ print $1 * $2 }')
images=$(find "$capture/data/frames" -type f | wc -l)

printf '%-18s %8s %14s %10s %8s %14s\n' stage outputs 'core-s/image' 'MB at most' 'B/pixel' 'of 1,290: h'
for stage in $("$lumi" stage); do
    # shellcheck disable=SC2086
    /usr/bin/time -o "$dir/cost" -f '%U %S %M' "$lumi" stage "$stage" "$capture" -j 1 $options >"$dir/said" || exit 1
    made=$(sed -n 's/.*: \([0-9]*\) made.*/\1/p' "$dir/said")
    [ "${made:-0}" -gt 0 ] || continue
    # shellcheck disable=SC2086
    /usr/bin/time -o "$dir/idle" -f '%M' "$lumi" stage "$stage" "$capture" -j 1 $options >/dev/null
    awk -v stage="$stage" -v made="$made" -v images="$images" -v pixels="$pixels" -v idle="$(cat "$dir/idle")" '{
        core = $1 + $2
        cores = made == 1 && stage != "compress" ? 1 : 2
        printf "%-18s %8d %14.2f %10.0f %8.0f %14.2f\n", stage, made, core / images, $3 * 1024 / 1e6,
               ($3 - idle) * 1024 / pixels, core / images * 1290 / cores / 3600
    }' "$dir/cost"
done | tee "$dir/process.txt"
awk -v images="$images" '{ sum += $3; hours += $6 }
    END { printf "%d images: %.1f core-s an image; 1,290 on two cores, extrapolated: %.2f h\n", images, sum, hours }' \
    "$dir/process.txt"
