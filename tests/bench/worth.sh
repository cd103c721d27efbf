#!/bin/sh
# What each stage between depth and compression is worth: views and flicker of one place, shot by one rig on a tripod with
# the end of its arm in every picture, with and without synthesis, subsampling and prefilter, at equal bytes.
#
#   tests/bench/worth.sh BUILD [DIR [PLACE [RIG [SCALE [SIZE [DENSITY [FRAMES]]]]]]]
#
# PLACE room, RIG bar2, SCALE 0.25, SIZE 240x192, DENSITY 0.3 (of subsampling), 16 frames a path. Cameras are 5 mm and 0.5° beside their places, poses are the true ones.
# All fields have the bytes of the first at quality 60. Truth has the tripod's shadow and not the tripod, and as many pixels
# a degree as the pictures. Views: 12 random ones within 0.6 of the cameras' radius, as the pictures look; 6 that look down
# past where the stand is. Flicker: four slow paths, one to each side, which go 5 mm sideways and 1 mm up a frame; what
# changes between neighbouring frames and does not in the truth, mean over the paths, grey levels of 255; and the share of
# values that change by over 8 levels more than the truth does.
set -eu
here=$(dirname "$0")
. "$here/functions"

build=${1:?usage: worth.sh BUILD [DIR [PLACE [RIG [SCALE [SIZE [DENSITY [FRAMES]]]]]]]}
work_folder "${2:-}"
place=${3:-room} rig=${4:-bar2} scale=${5:-0.25} size=${6:-240x192} density=${7:-0.3} frames=${8:-16}
lumi=$(realpath "$build")/cli/lumi

# Views of 75° as nerfstudio's transforms.json (x right, y up, z backward; camera to world by rows): `paths` to four sides,
# or `down`: past the stand, from eyes around the axis.
transforms() { # WHAT COUNT WIDTH HEIGHT
    awk -v what="$1" -v n="$2" -v w="$3" -v h="$4" 'BEGIN {
        pi = 3.14159265358979
        f = w / 2 / (sin(75 * pi / 360) / cos(75 * pi / 360))
        printf "{\"w\":%d,\"h\":%d,\"fl_x\":%.9f,\"fl_y\":%.9f,\"cx\":%g,\"cy\":%g,\"frames\":[", w, h, f, f, w / 2, h / 2
        for (k = 0; k < (what == "down" ? n : 4 * n); k++) {
            if (what == "down") {
                a = 2 * pi * k / n; c = cos(a); s = sin(a); x = 0.1 * c; y = 0.1 * s; z = -0.05
                printf "%s{\"file_path\":\"images/down%d.png\",\"transform_matrix\":[", k ? "," : "", k
                # Looks down, its top along (c, s).
                printf "[%.12f,%.12f,0,%.12f],[%.12f,%.12f,0,%.12f],[0,0,1,%.12f],[0,0,0,1]]}", s, c, x, -c, s, y, z
                continue
            }
            side = int(k / n); i = k % n
            a = (90 * side + 20) * pi / 180
            c = cos(a); s = sin(a); along = 0.005 * (i - n / 2)
            printf "%s{\"file_path\":\"images/side%dframe%03d.png\",\"transform_matrix\":[", k ? "," : "", side, i
            printf "[%.12f,0,%.12f,%.12f],[%.12f,0,%.12f,%.12f],", s, -c, s * along, -c, -s, -c * along
            printf "[0,1,0,%.12f],[0,0,0,1]]}", along / 5
        }
        print "]}"
    }'
}

machine
echo "$place, $rig at $scale, $size"
[ -d "$dir/capture" ] || "$lumi" sim shoot "$place" --rig "$rig" --scale "$scale" --size "$size" --tripod --arm --seed 4 \
    --pose-error 5,0.5 --truth-capture "$dir/capture" --truth-poses "$dir/poses.json" -o "$dir/priors"
radius=$(tr -d ' \n' <"$dir/poses.json" | sed 's/.*"transform_matrix":\[\[\([^]]*\)\],\[\([^]]*\)\],\[\([^]]*\)\].*/\1,\2,\3/' |
    awk -F, '{ print sqrt($4 ^ 2 + $8 ^ 2 + $12 ^ 2) }')
see() { # NAME OPTIONS...
    folder=$dir/$1
    shift
    [ -d "$folder" ] || "$lumi" sim truth "$place" "$@" --tripod-shadow "$radius" --no-depth -o "$folder"
}
# The pictures' pixels a degree, for views of 75°.
see truth --from "$dir/capture" --random 12 --seed 3
width=$(sed -n 's/.*"w": *\([0-9]*\).*/\1/p' "$dir/truth/transforms.json" | head -n 1)
transforms paths "$frames" "$width" $((width * 3 / 4)) >"$dir/path.json"
see path --poses "$dir/path.json"
transforms down 6 "$width" $((width * 3 / 4)) >"$dir/down.json"
see down --poses "$dir/down.json"

bytes=
# A field, made in the same work folder: what does not change is not made again.
field() { # NAME OPTIONS...
    what=$1
    shift
    "$lumi" process "$dir/capture" --calibrate no --equalize no -o "$dir/$what.lumi" "$@" ${bytes:+--target-bytes "$bytes"} \
        >"$dir/$what.log"
    [ -n "$bytes" ] || bytes=$(stat -c %s "$dir/$what.lumi")
    for side in 0 1 2 3; do
        numbers=$(seq -s '|' $((side * frames)) $((side * frames + frames - 1)))
        "$lumi" eval "$dir/$what.lumi" --truth "$dir/path/transforms.json" --frames "v0*($numbers)\$" --flicker --json
    done >"$dir/$what.flicker"
    judge "$what" "$dir/$what.lumi" "$dir/truth/transforms.json"
    judge "$what, down" "$dir/$what.lumi" "$dir/down/transforms.json"
    printf '%-28s %s bytes, %s views; %s\n' '' "$(stat -c %s "$dir/$what.lumi")" \
        "$("$lumi" info "$dir/$what.lumi" | sed -n 's/^fine *\([0-9]*\) views.*/\1/p')" "$(awk -F '[:,}]' '
        { rendered += $4 / 4; truth += $6 / 4; flicker += $8 / 4; jumps += $10 / 4 }
        END { printf "from frame to frame %.3f, truth %.3f, flicker %.3f, jumps %.3f %%", rendered, truth, flicker,
              100 * jumps }' "$dir/$what.flicker")"
}

none="--prefilter 0 --synthesize no --subsample no"
thin="--synthesize yes --subsample yes --density $density"
judge_heading
# shellcheck disable=SC2086
{
    field none $none --quality 60
    field synthesis --prefilter 0 --synthesize yes --subsample no
    field subsampling --prefilter 0 $thin
    field all --prefilter 4 $thin
    field subsampling-gp1 --prefilter 0 $thin --gp 1
    field all-gp1 --prefilter 4 $thin --gp 1
}
exit "$missed"
