#!/bin/sh
# Views for the poles of rigs that stand on a tripod and have the end of their arm in every picture, against what a camera
# would see there if the tripod were nothing but its shadow; with true poses, and rendered from fields with true and with
# calibrated poses. Truth without the shadow is compared as well. About 40 core-minutes.
# usage: poles.sh BUILD [DIR [CASE...]], a case is PLACE:RIG:SCALE:SIZE:DENSITY
set -eu
. "$(dirname "$0")/functions"
lumi=$(realpath "$1")/cli/lumi compare=$(realpath "$1")/tests/scenario/compare_views
to_transforms=$(dirname "$0")/../scenario/places_to_transforms.awk
work_folder "${2:-}"
[ $# -gt 2 ] && shift 2 && cases=$* ||
    cases="room:bar2:0.25:240x192:1 court:bar2:0.25:240x192:1 room:arc16:0.25:240x192:2 court:arc16:0.25:240x192:2"
machine

# What a camera sees from the poles of $rig: $rig.shadow, $rig.none.
see_truth() { # PLACE
    places=$rig.true.work/subsample/all.places
    awk -v flags=s -f "$to_transforms" "$places" >"$rig.poles.json"
    radius=$(awk '$1 == "view" && $4 ~ "s" { print sqrt($8 ^ 2 + $12 ^ 2 + $16 ^ 2); exit }' "$places")
    for kind in shadow none; do
        [ $kind = none ] || shadow="--tripod-shadow $radius"
        [ -d "$rig.$kind" ] || "$lumi" sim truth "$1" --poses "$rig.poles.json" ${shadow:-} --no-depth -o "$rig.$kind"
        [ -d "$rig.$kind.capture" ] || "$lumi" import "$rig.$kind/transforms.json" -o "$rig.$kind.capture" >/dev/null
        "$lumi" stage equiangular "$rig.$kind.capture" >/dev/null
        shadow=
    done
}

# The views themselves.
compare_views() { # KIND
    set -- "$1" "$rig.$1.capture.work"/equiangular/*.exr
    kind=$1
    shift
    for name in $(awk '$1 == "view" && $4 ~ "s" { print $2 }' "$rig.true.work/subsample/all.places"); do
        said=$("$compare" "$rig.true.work/synthesize/$name.exr" "$1" "$rig-$kind-$name.png")
        shift
        echo "$case, truth's tripod: $kind, $name: $said"
        [ "$kind" = none ] || floor "$name" "${said%% *}" 30 dB
    done
}

for case in $cases; do
    IFS=: read -r place model scale size density <<EOF
$case
EOF
    rig=$dir/$place.$model.$scale.$size
    [ -d "$rig" ] || "$lumi" sim shoot "$place" --rig "$model" --scale "$scale" --size "$size" --tripod --arm --seed 4 \
        --pose-error 5,0.5 --truth-capture "$rig.true" --truth-poses "$rig.json" -o "$rig"
    options="--equalize no --subsample yes --synthesize yes --density $density --prefilter 0 --quality 95"
    # shellcheck disable=SC2086
    "$lumi" process "$rig.true" --calibrate no $options -o "$rig.true.lumi" >"$rig.true.log"
    # shellcheck disable=SC2086
    "$lumi" process "$rig" --calibrate yes $options -o "$rig.lumi" >"$rig.log"
    see_truth "$place"
    compare_views shadow
    compare_views none
    judge_heading
    judge "rendered, true poses" "$rig.true.lumi" "$rig.shadow/transforms.json"
    judge "rendered, calibrated" "$rig.lumi" "$rig.shadow/transforms.json" --aligned "$rig.work" --aligned-truth "$rig.json"
done
exit "$missed"
