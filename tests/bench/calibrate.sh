#!/bin/sh
# The whole chain against truth: places shot with rigs that are not where they believe to be (5 mm and 0.5° a frame, and
# systematic errors), with noise and vignetting. The poses after calibration against the true ones, and the finished views
# against those of the same pictures with true poses. Both runs are done in the same way, brightness evened out too.
# usage: calibrate.sh BUILD [DIR [SCALE SIZE [PLACE:RIG...]]]
#   DIR is kept, and gone on with; the others are 0.25 320x256 room:bar2 room:arc16 court:bar2 court:arc16.
# Ends with a table, and with 1 where something wanted was missed: 0.5 mm and 0.02° (median), no camera off by 5 mm, views
# at most 0.5 dB below those with true poses.
set -eu
. "$(dirname "$0")/functions"
lumi=$(realpath "${1:?usage: calibrate.sh BUILD [DIR [SCALE SIZE [PLACE:RIG...]]]}")/cli/lumi
work_folder "${2:-}"
scale=${3:-0.25} size=${4:-320x256}
[ $# -le 4 ] && set -- room:bar2 room:arc16 court:bar2 court:arc16 || shift 4

# Core-seconds of this shell's children so far, in $seconds (in this very shell: a subshell's begin at 0).
spent() {
    times >"$dir/times"
    seconds=$(awk 'NR == 2 { gsub("s", ""); split($1, u, "m"); split($2, s, "m"); print 60 * (u[1] + s[1]) + u[2] + s[2] }' \
        "$dir/times")
}

number() { # NAME FILE: of a line of JSON
    sed "s/.*\"$1\":\([-0-9.e]*\).*/\1/" "$2"
}

decibels() { # FIELD TRUTH SHEET [OPTIONS...]: the mean of its views
    field=$1 views=$2 sheet=$3
    shift 3
    "$lumi" eval "$field" --truth "$views" --sheet "$sheet" "$@" >"${sheet%.png}.txt"
    awk '$1 == "mean" { print $2 }' "${sheet%.png}.txt"
}

one() { # PLACE RIG
    place=$1 rig=$2 name=$1-$2 c=$dir/$1-$2
    [ -d "$c" ] || "$lumi" sim shoot "$place" --rig "$rig" --scale "$scale" --size "$size" --vignetting 0.3 --full-well 12000 \
        --read-noise 6 --pose-error 5,0.5 --mechanism-error yes --truth-poses "$c.json" --truth-capture "$c.true" -o "$c"
    [ -d "$c.views" ] ||
        "$lumi" sim truth "$place" --from "$c.true" --random 12 --seed 5 --no-depth -o "$c.views"
    spent
    begin=$seconds
    for stage in masks features pairs calibrate; do
        "$lumi" stage $stage "$c" --calibrate yes >/dev/null
    done
    spent
    seconds=$(awk -v a="$begin" -v b="$seconds" 'BEGIN { printf "%.0f", b - a }')
    head -n 1 "$c.work/calibrate/report.txt"
    "$lumi" eval --poses "$c.work" --truth "$c.json" | tee "$c.poses.txt"
    "$lumi" eval --poses "$c.work" --truth "$c.json" --json >"$c.poses"
    "$lumi" process "$c" --calibrate yes --equalize yes -o "$c.lumi" >/dev/null
    "$lumi" process "$c.true" --calibrate no --equalize yes -o "$c.true.lumi" >/dev/null
    found=$(decibels "$c.lumi" "$c.views/transforms.json" "$c.png" --aligned "$c.work" --aligned-truth "$c.json")
    true=$(decibels "$c.true.lumi" "$c.views/transforms.json" "$c.true.png")
    awk -v name="$place, $rig" -v found="$found" -v true="$true" -v seconds="$seconds" -v n="$(number found "$c.poses")" \
        -v all="$(number truths "$c.poses")" -v mm="$(number position_median_mm "$c.poses")" \
        -v far="$(number position_worst_mm "$c.poses")" -v turn="$(number rotation_median_degrees "$c.poses")" \
        -v turned="$(number rotation_worst_degrees "$c.poses")" 'BEGIN {
            printf "| %s | %d of %d | %.2f / %.1f mm | %.4f° / %.3f° | %.2f, %.2f dB | %s core-s |\n", name, n, all, mm, far,
                turn, turned, found, true, seconds
            exit !(mm <= 0.5 && far <= 5 && turn <= 0.02 && found >= true - 0.5) }' >>"$dir/table" ||
        { missed=1; echo "$name: MISSED"; }
}

machine
echo "pose errors 5 mm and 0.5° a frame, mechanism errors, noise, vignetting; scale $scale, pictures of $size"
: >"$dir/table"
for what in "$@"; do
    one "${what%:*}" "${what#*:}"
done
echo
echo "| | pictures used | position, median / worst | rotation, median / worst | views: calibrated, true poses | masks to calibrate |"
echo "|---|---|---|---|---|---|"
cat "$dir/table"
exit "$missed"
