#!/bin/sh
# What evening out exposure and vignetting gives back: rendered views of a capture with vignetting and cameras of
# different gain, as it is and equalised, beside the clean capture's; true poses, no other stage between. Only ratios of
# gains can be seen, so the common factor is searched for in steps of 0.06 stops.
# usage: color.sh BUILD_FOLDER
set -eu
lumi=$1/cli/lumi
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
cd "$scratch"
shoot="--rig arc:4x9:0.2 --size 256x204"
only="--calibrate no --synthesize no --subsample no --prefilter 0"
"$lumi" sim shoot room $shoot -o clean >/dev/null
"$lumi" sim shoot room $shoot --vignetting 0.2 --camera-gain 0.3 -o uneven >/dev/null
"$lumi" sim truth room --from clean --random 6 --seed 3 --size 200x150 --no-depth -o truth >/dev/null
mean() { # WHAT CAPTURE OPTIONS
    what=$1 capture=$2
    shift 2
    "$lumi" process "$capture" -o field.lumi $only "$@" >/dev/null
    echo "$what: $("$lumi" eval field.lumi -t truth/transforms.json | grep '^mean')"
}
mean clean clean
mean uneven uneven
for stops in -0.06 0 0.06 0.12; do
    mean "equalised, $stops stops" uneven --equalize yes --exposure $stops
done
cat uneven.work/equalize/report.txt
