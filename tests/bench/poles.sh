#!/bin/sh
# Views for the poles of a rig, with and without its tripod, against what a camera would see there. About 15 core-minutes.
# usage: poles.sh BUILD [DIR] [PLACE [SCALE [SIZE]]]
set -eu
. "$(dirname "$0")/functions"
lumi=$1/cli/lumi compare=$1/tests/scenario/compare_views
place=${3:-room} scale=${4:-0.35} size=${5:-320x256}
work_folder "${2:-}"
machine
for stand in "" --tripod; do
    rig=$dir/$place$stand
    [ -d "$rig.capture" ] || "$lumi" sim shoot "$place" --rig bar2 --scale "$scale" --size "$size" $stand -o "$rig.capture"
    for stage in subsample equiangular match depth synthesize; do
        "$lumi" stage $stage "$rig.capture" --subsample yes --synthesize yes
    done
    places=$rig.capture.work/subsample/all.places
    awk -v flags=s -f "$(dirname "$0")/../scenario/places_to_transforms.awk" "$places" >"$dir/poles.json"
    [ -d "$dir/truth" ] || "$lumi" sim truth "$place" --poses "$dir/poles.json" --no-depth -o "$dir/truth"
    [ -d "$dir/truth.capture" ] || "$lumi" import "$dir/truth/transforms.json" -o "$dir/truth.capture"
    "$lumi" stage equiangular "$dir/truth.capture"
    set -- $(ls "$dir"/truth.capture.work/equiangular/*.exr)
    for name in $(awk '$1 == "view" && $4 ~ "s" { print $2 }' "$places"); do
        said=$("$compare" "$rig.capture.work/synthesize/$name.exr" "$1" "$rig-$name.png")
        shift
        echo "$place $stand $name: $said"
        floor "$name" "${said%% *}" 30 dB
    done
done
exit $missed
