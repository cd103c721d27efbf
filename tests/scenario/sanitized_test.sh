#!/bin/sh
# Every program of the chain once, for the sanitizers that this build was made with: shot, processed, rendered, judged.
# usage: sanitized_test.sh LUMI SUPPRESSIONS_FOR_THREADS
set -eu
lumi=$1
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
export TSAN_OPTIONS="suppressions=$2 exitcode=66"

"$lumi" sim shoot room --rig planar:3x3:0.05 --size 96x64 -o "$scratch/room.capture"
"$lumi" sim truth room --from "$scratch/room.capture" --random 2 -o "$scratch/truth"
"$lumi" verify "$scratch/room.capture"
"$lumi" process "$scratch/room.capture" -o "$scratch/room.lumi"
"$lumi" info "$scratch/room.lumi"
"$lumi" eval "$scratch/room.lumi" --truth "$scratch/truth/transforms.json" --sheet "$scratch/sheet.png"
"$lumi" eval "$scratch/room.lumi" --codec "$scratch/room.capture"
"$lumi" render "$scratch/room.lumi" --path orbit --size 64x48 -o "$scratch/orbit.webm"
"$lumi" export "$scratch/room.capture" --transforms "$scratch/exported.json"
"$lumi" import "$scratch/exported.json" -o "$scratch/again.capture"
