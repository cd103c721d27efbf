#!/bin/sh
# `room` as the whole arc16 sees it, without noise: all 1,152 frames, processed, and judged by views from random eyes within
# 0.6 of its radius, all around and up to 45 degrees up and down. At full resolution it takes hours of shooting and hours of
# processing with 2 cores and 20 GB of disk; at half (SHRINK 2) a quarter of that. What is there already in DIR is used again,
# and processing goes on where it was interrupted; shooting starts anew.
# usage: rig.sh BUILD [DIR [SHRINK [VIEWS]]]     (SHRINK: divides the resolution, 4; VIEWS: 48)
set -eu
. "$(dirname "$0")/functions"
lumi=$1/cli/lumi
shrink=${3:-4} views=${4:-48}
work_folder "${2:-}"

size=$((1280 / shrink))x$((1024 / shrink))
[ -d "$dir/rig.capture" ] || "$lumi" sim shoot room --rig arc16 --size $size -o "$dir/rig.capture"
[ -d "$dir/truth" ] || "$lumi" sim truth room --from "$dir/rig.capture" --random "$views" --no-depth -o "$dir/truth"
# The views as they are: what the other stages are worth is stages_worth.sh.
"$lumi" process "$dir/rig.capture" -o "$dir/rig.lumi" --synthesize no --subsample no --prefilter 0
machine
"$lumi" info "$dir/rig.lumi"
judge_heading
judge "room, arc16, $size" "$dir/rig.lumi" "$dir/truth/transforms.json" --sheet "$dir/rig.png"
floor "mean PSNR" "$mean" 34 dB
floor "worst PSNR" "$worst" 28 dB
judge "room, arc16, plane" "$dir/rig.lumi" "$dir/truth/transforms.json" --method plane
exit $missed
