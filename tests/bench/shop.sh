#!/bin/sh
# The shop: every third row and column as input (49 of 441 views), the 144 views one step diagonally off the inputs and
# inside their grid as truth. The disks against the best single plane (the paper's CMBF+P), and against themselves at
# another quality of the images.
# usage: shop.sh BUILD [DIR] [--quick]   (DIR: kept, and gone on with; --quick: one truth view in nine)
# Exits with 77 where the data are missing, with 1 where a floor is missed.
set -eu
. "$(dirname "$0")/functions"
data=$(dirname "$0")/../../../shared/data/shop
[ -f "$data/transforms.json" ] || skip "no $data"
lumi=$1/cli/lumi
quick=
shift
for argument in "$@"; do [ "$argument" = --quick ] && quick=1; done
[ "${1:-}" = --quick ] && shift
work_folder "${1:-}"

between='(01|02|04|05|07|08|10|11|13|14|16|17)'
[ -z "$quick" ] || between='(02|07|11|16)'
[ -d "$dir/shop.capture" ] || "$lumi" import "$data/transforms.json" --every 3x3 -o "$dir/shop.capture"
"$lumi" process "$dir/shop.capture" -o "$dir/shop.lumi"
"$lumi" info "$dir/shop.lumi"
machine
judge_heading
judge disks "$dir/shop.lumi" "$data/transforms.json" --frames "(images/)?r${between}c${between}.*"
disks=$mean
judge plane "$dir/shop.lumi" "$data/transforms.json" --frames "(images/)?r${between}c${between}.*" --method plane
floor "mean PSNR of the disks" "$disks" 32 dB
floor "over the best plane" "$(awk -v a="$disks" -v b="$mean" 'BEGIN { printf "%.2f", a - b }')" 4 dB
exit $missed
