#!/bin/sh
# The whole chain against truth: a place shot with a rig that is not where it believes to be (5 mm and 0.5° a frame, and
# systematic errors), with noise and vignetting; its poses after calibration against the true ones, and the finished views
# against those of the same pictures with true poses.
# usage: calibrate.sh BUILD [DIR] [PLACE RIG SCALE SIZE [PROCESS-OPTIONS...]]
#   DIR: kept, and gone on with; PLACE RIG SCALE SIZE: room bar2 0.25 320x256
set -eu
. "$(dirname "$0")/functions"
lumi=$1/cli/lumi
work_folder "${2:-}"
place=${3:-room} rig=${4:-bar2} scale=${5:-0.25} size=${6:-320x256}
[ $# -le 6 ] && set -- || shift 6
name=$place-$rig-$scale-$size c=$dir/$place-$rig-$scale-$size

[ -d "$c" ] || "$lumi" sim shoot "$place" --rig "$rig" --scale "$scale" --size "$size" --vignetting 0.3 --full-well 12000 \
    --read-noise 6 --pose-error 5,0.5 --mechanism-error yes --truth-poses "$c.json" --truth-capture "$c.true" -o "$c"
[ -d "$c.views" ] || "$lumi" sim truth "$place" --from "$c.true" --random 8 --seed 5 --volume 0.15 --no-depth -o "$c.views"

for stage in features pairs calibrate; do
    /usr/bin/time -f "$name $stage: %e s, %U s of cores, %M KB" "$lumi" stage $stage "$c" -w "$c.work" --calibrate yes >/dev/null
done
"$lumi" eval --poses "$c.work" --truth "$c.json" | sed "s/^/$name /"
"$lumi" process "$c" -w "$c.work" --calibrate yes "$@" -o "$c.lumi" >/dev/null
"$lumi" process "$c.true" -w "$c.true.work" --calibrate no "$@" -o "$c.true.lumi" >/dev/null
echo "$name views, calibrated:"
"$lumi" eval "$c.lumi" --truth "$c.views/transforms.json" --aligned "$c.work" --aligned-truth "$c.json" | tail -3
echo "$name views, true poses:"
"$lumi" eval "$c.true.lumi" --truth "$c.views/transforms.json" | tail -3
