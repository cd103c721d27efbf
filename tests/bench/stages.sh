#!/bin/sh
# What the pipeline costs: core-seconds a megapixel of every stage and the most memory held, by `lumi process --json`, on
# captures of several kinds; and how that memory grows with the number of images.
#
# Nine large images, and 9, 40, 80 and 160 of 128 x 128. What 1,300 large images take is `script/bench memory`'s matter.
# usage: stages.sh BUILD [DIR] [CAPTURE...]   (DIR: kept, its photographs used again; CAPTURE: also of these)
set -eu
. "$(dirname "$0")/functions"
lumi=$1/cli/lumi
shift
work_folder "${1:-}"
[ $# -eq 0 ] || shift
machine

# Rows of `lumi process --json`: stage, core-seconds a megapixel (of views), memory held at most so far; sets $peak (MB).
measure() { # NAME CAPTURE
    rm -rf "$2.work"
    "$lumi" process "$2" -o "$dir/stages.lumi" --json >"$dir/$1.json" 2>"$dir/$1.log" || { cat "$dir/$1.log" >&2; exit 1; }
    rm -rf "$2.work" "$dir/stages.lumi"
    awk -v name="$1" -F '[:,]' '
        { gsub(/[" ]/, "") }
        $1 == "stage" { stage[++n] = $2 }
        $1 == "core_s" { core[n] = $2 }
        $1 == "wall_s" { wall[n] = $2 }
        $1 == "peak_bytes" { peak[n] = $2 }
        $1 == "images" { images = $2 }
        $1 == "width" { width = $2 }
        $1 == "height" { height = $2 }
        END {
            mpx = images * width * height / 1e6
            printf "%s: %d views of %d x %d, %.1f Mpx\n%-18s %12s %10s %16s\n", name, images, width, height, mpx, "stage",
                   "core-s/Mpx", "wall s", "MB at most"
            for (i = 1; i <= n; i++) {
                printf "%-18s %12.2f %10.1f %16.0f\n", stage[i], core[i] / mpx, wall[i], peak[i] / 1e6
                sum += core[i] / mpx
            }
            printf "%-18s %12.2f\n", "all", sum
        }' "$dir/$1.json"
    peak=$(sed -n 's/.*"peak_bytes" : \([0-9]*\).*/\1/p' "$dir/$1.json" | tail -n 1)
}

[ -d "$dir/large.capture" ] ||
    "$lumi" sim shoot room --rig planar:3x3:0.05 --fov 90 --size 1280x1024 -o "$dir/large.capture"
measure large "$dir/large.capture"

[ -d "$dir/many" ] || "$lumi" sim truth room --rig sphere:8x20:0.35 --fov 90 --size 128x128 --no-depth -o "$dir/many"
points=
for count in 9 40 80 160; do
    rm -rf "$dir/many$count.capture"
    "$lumi" import "$dir/many/transforms.json" --limit $count -o "$dir/many$count.capture"
    measure many$count "$dir/many$count.capture"
    points="$points $count:$peak"
done
for capture in "$@"; do
    measure "$(basename "$capture")" "$capture"
done

echo "memory at most, by the number of images:$points (images:bytes)"
