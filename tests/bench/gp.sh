#!/bin/sh
# Meshes of 2, 10 and 20 triangles a tile (gp = 1, 5, 10) side by side, as in figure 7 of Overbeck et al. 2018: a field of
# `room` from 5 × 5 cameras, 6 cm apart; truth between the cameras. A picture (bench_gp.c says what is where) and a table:
# triangles and bytes a tile of the middle view's mesh, PSNR of one rendered view; PSNR of all truth views; geometry's bytes
# of the whole file.
# usage: gp.sh BUILD [DIR]   (DIR: kept, picture gp.png in it; without, the picture is not kept)
set -eu
. "$(dirname "$0")/functions"
lumi=$1/cli/lumi bench=$1/tests/bench/bench_gp
work_folder "${2:-}"

[ -d "$dir/gp.capture" ] || "$lumi" sim shoot room --rig planar:5x5:0.06 --fov 60 --size 512x384 -o "$dir/gp.capture"
[ -d "$dir/truth" ] || "$lumi" sim truth room --rig planar:4x4:0.06 --fov 60 --size 512x384 --no-depth -o "$dir/truth"
photo=$(find "$dir/gp.capture" -name '*.png' | sort | sed -n 13p)
name=$(basename "$photo" .png)
truth=$(find "$dir/truth" -name '*.png' | sort | sed -n 6p)
set --
for gp in 1 5 10; do
    "$lumi" process "$dir/gp.capture" -o "$dir/gp$gp.lumi" --gp $gp -q 90
    "$lumi" render "$dir/gp$gp.lumi" --poses "$dir/truth/transforms.json" --frames ".*$(basename "$truth" .png).*" \
        -o "$dir/gp$gp.png"
    set -- "$@" "$dir/gp$gp.lumi" "$dir/gp$gp.png"
done
machine
echo "columns of gp.png: gp = 1, 5, 10"
"$bench" "$dir/gp.png" 12 "$photo" "$dir/gp.capture.work/depth/$name.exr" "$truth" "$@"
judge_heading
for gp in 1 5 10; do judge "gp $gp" "$dir/gp$gp.lumi" "$dir/truth/transforms.json"; done
for gp in 1 5 10; do
    printf 'gp %-3s' $gp
    "$lumi" info "$dir/gp$gp.lumi" | grep -i geometry
done
