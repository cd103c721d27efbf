#!/bin/sh
# What each stage between depth and compression is worth: views and flicker of one place, shot by one rig, with and
# without prefilter, synthesis and subsampling, at equal bytes.
#
#   tests/bench/worth.sh BUILD [DIR [PLACE [RIG [SCALE [GP [FRAMES [VIEWS]]]]]]]
#
# PLACE room, RIG arc16, SCALE 0.25, geometry precision 5, 12 frames, 12 views. Poses are the true ones. The fields'
# size is that of the first, at quality 80. Views: random ones within 0.6 of the cameras' radius. Flicker: four slow
# paths through the middle, one to each side, which go 2 mm sideways and turn 0.2° a frame; what changes between
# neighbouring frames and does not in the truth, mean over the paths, grey levels of 255.
set -eu
here=$(dirname "$0")
. "$here/functions"

build=${1:?usage: worth.sh BUILD [DIR [PLACE [RIG [SCALE [GP [FRAMES [VIEWS]]]]]]]}
work_folder "${2:-}"
place=${3:-room} rig=${4:-arc16} scale=${5:-0.25} gp=${6:-5} frames=${7:-12} views=${8:-12}
lumi=$(realpath "$build")/cli/lumi

# Frames of four paths as nerfstudio's transforms.json: x right, y up, z backward; camera to world by rows.
slow_paths() { # FRAMES WIDTH HEIGHT FOV_DEGREES
    awk -v n="$1" -v w="$2" -v h="$3" -v fov="$4" 'BEGIN {
        pi = 3.14159265358979
        f = w / 2 / (sin(fov * pi / 360) / cos(fov * pi / 360))
        printf "{\"w\":%d,\"h\":%d,\"fl_x\":%.9f,\"fl_y\":%.9f,\"cx\":%g,\"cy\":%g,\"frames\":[", w, h, f, f, w / 2, h / 2
        for (k = 0; k < 4 * n; k++) {
            side = int(k / n); i = k % n
            a = (90 * side + 20 + 0.2 * i) * pi / 180
            c = cos(a); s = sin(a); along = 0.002 * (i - n / 2)
            printf "%s{\"file_path\":\"images/side%dframe%03d.png\",\"transform_matrix\":[", k ? "," : "", side, i
            printf "[%.12f,0,%.12f,%.12f],[%.12f,0,%.12f,%.12f],", s, -c, s * along, -c, -s, -c * along
            printf "[0,1,0,%.12f],[0,0,0,1]]}", along / 4
        }
        print "]}"
    }'
}

machine
echo "$place, $rig at $scale, gp $gp"
[ -d "$dir/capture" ] || "$lumi" sim shoot "$place" --rig "$rig" --scale "$scale" -o "$dir/capture"
[ -d "$dir/truth" ] || "$lumi" sim truth "$place" --from "$dir/capture" --random "$views" --seed 3 -o "$dir/truth"
slow_paths "$frames" 320 240 75 >"$dir/path.json"
[ -d "$dir/path" ] || "$lumi" sim truth "$place" --poses "$dir/path.json" -o "$dir/path"

bytes=
# A field, made of the same work folder: what does not change is not made again.
field() { # NAME OPTIONS...
    name=$1
    shift
    "$lumi" process "$dir/capture" --gp "$gp" --calibrate no -o "$dir/$name.lumi" "$@" ${bytes:+--target-bytes "$bytes"} \
        >"$dir/$name.log"
    [ -n "$bytes" ] || bytes=$(stat -c %s "$dir/$name.lumi")
    for side in 0 1 2 3; do
        numbers=$(seq -s '|' $((side * frames)) $((side * frames + frames - 1)))
        "$lumi" eval "$dir/$name.lumi" --truth "$dir/path/transforms.json" --frames "v0*($numbers)\$" --flicker --json
    done >"$dir/$name.flicker"
    judge "$name" "$dir/$name.lumi" "$dir/truth/transforms.json"
    printf '%-28s %s bytes; %s\n' '' "$(stat -c %s "$dir/$name.lumi")" "$(awk -F '[:,}]' '
        { rendered += $4 / 4; truth += $6 / 4; flicker += $8 / 4 }
        END { printf "from frame to frame %.3f, truth %.3f, flicker %.3f", rendered, truth, flicker }' "$dir/$name.flicker")"
}

judge_heading
field plain --quality 80 --prefilter 0 --synthesize no --subsample no
field prefilter --prefilter 4 --synthesize no --subsample no
field synthesis --prefilter 0 --synthesize yes --subsample no
field subsampling --prefilter 0 --synthesize no --subsample yes
field all --prefilter 4 --synthesize yes --subsample yes
exit "$missed"
