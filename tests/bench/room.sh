#!/bin/sh
# `room` as the full arc16 sees it, without noise: ROWS × COLUMNS neighbouring frames of its 16 × 72 around the equator, at
# the rig's own spacing, lens and resolution; truth from eyes up to 3 cm about the centre that look into that wedge at the
# frames' pixel density. The whole rig (`lumi sim shoot room --rig arc16`) is hours of shooting and hours of processing
# with 2 cores; a wedge has the same neighbours everywhere but at its rim.
# usage: room.sh BUILD [DIR] [ROWS COLUMNS [SHRINK [FIRST]]]
#   DIR: kept, and gone on with; 4 8: 32 frames, about 10 core-minutes; SHRINK: divides the resolution (1); FIRST: the
#   wedge's first column. 0 looks at the hardest part: foliage before a bright window, wires and a plant.
set -eu
. "$(dirname "$0")/functions"
lumi=$1/cli/lumi
rows=${3:-4} columns=${4:-8} shrink=${5:-1} first=${6:-0}
work_folder "${2:-}"

# Poses are the rig's own; pictures of 20 × 16 pixels are thrown away.
[ -d "$dir/rig" ] || "$lumi" sim truth room --rig arc16 --size 20x16 --no-depth -o "$dir/rig"
awk -v rows="$rows" -v columns="$columns" -v first="$first" -v k="$(awk -v s="$shrink" 'BEGIN { print 64 / s }')" -v truth="$dir/truth.json" '
    function value(name,  text) {
        text = $0
        sub(".*\"" name "\": *", "", text)
        sub(/[,}].*/, "", text)
        return name == "file_path" ? text : text + 0
    }
    BEGIN { pi = atan2(0, -1); print "{\"frames\": [" }
    /"file_path"/ {
        take = value("row") >= 8 - rows / 2 && value("row") < 8 + rows / 2 && value("col") >= first && value("col") < first + columns
        focal = k * value("fl_x"); w = k * value("w"); h = k * value("h")
        if (take)
            printf "%s{\"file_path\": %s, \"camera_model\": \"OPENCV_FISHEYE\", \"w\": %d, \"h\": %d, \"fl_x\": %.17g, \"fl_y\": %.17g, \"cx\": %.17g, \"cy\": %.17g, \"k1\": 0, \"k2\": 0, \"k3\": 0, \"k4\": 0, \"row\": %d, \"col\": %d,\n",
                n++ ? ",\n" : "", value("file_path"), w, h, focal, focal, w / 2, h / 2, value("row"), value("col")
    }
    /"transform_matrix"/ && take {
        matrix = $0
        sub(/\}\]?,? *$/, "}", matrix); sub(/\}\]\}$/, "}", matrix)
        printf "%s", matrix
        split(matrix, entry, /[][, ]+/)
        x += entry[6]; y += entry[10]
    }
    END {
        print "]}"
        az = atan2(y, x); degree = pi / 180
        # Half the wedge, less a border of 6 degrees for eyes that are not at the centre.
        a = ((columns - 1) * 2.5 - 6) * degree; b = ((rows - 1) * 5.625 - 6) * degree
        w = 2 * int(focal * sin(a) / cos(a)); h = 2 * int(focal * sin(b) / cos(b))
        printf "{\"camera_model\": \"OPENCV\", \"w\": %d, \"h\": %d, \"fl_x\": %.17g, \"fl_y\": %.17g, \"cx\": %.17g, \"cy\": %.17g, \"frames\": [\n", w, h, focal, focal, w / 2, h / 2 > truth
        for (i = 0; i < 12; i++) {
            # Eyes on a spiral over a sphere of 3 cm: golden angle in azimuth, equal steps of height.
            z = .03 * (1 - (2 * i + 1) / 12); r = sqrt(.0009 - z * z); t = 2.399963 * i
            printf "%s{\"file_path\": \"eye%02d.png\", \"transform_matrix\": [[%.17g, 0, %.17g, %.17g], [%.17g, 0, %.17g, %.17g], [0, 1, 0, %.17g], [0, 0, 0, 1]]}",
                i ? ",\n" : "", i, sin(az), -cos(az), r * cos(t), -cos(az), -sin(az), r * sin(t), z > truth
        }
        print "]}" > truth
    }' "$dir/rig/transforms.json" >"$dir/wedge.json"

[ -d "$dir/wedge" ] || "$lumi" sim truth room --poses "$dir/wedge.json" --no-depth -o "$dir/wedge"
[ -d "$dir/truth" ] || "$lumi" sim truth room --poses "$dir/truth.json" --no-depth -o "$dir/truth"
[ -d "$dir/wedge.capture" ] || "$lumi" import "$dir/wedge/transforms.json" -o "$dir/wedge.capture"
for quality in 70 90; do
    "$lumi" process "$dir/wedge.capture" -o "$dir/room$quality.lumi" -q $quality
done
machine
judge_heading
for quality in 70 90; do
    judge "room, wedge, quality $quality" "$dir/room$quality.lumi" "$dir/truth/transforms.json" \
        --sheet "$dir/room$quality.png"
done
# The mean that is wanted, 34 dB, is one over views all around (rig.sh); this wedge is the hardest of them.
floor "worst PSNR" "$worst" 28 dB
judge "room, wedge, plane" "$dir/room90.lumi" "$dir/truth/transforms.json" --method plane
exit $missed
