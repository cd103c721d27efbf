#!/bin/sh
# COLMAP on a capture of calibrate.sh, beside our calibration: its lens given and kept, all pictures matched with all,
# guided; its time, how many pictures it places, and how far off they are.
# usage: colmap.sh BUILD CAPTURE TRUTH.json [DIR]
set -eu
. "$(dirname "$0")/functions"
lumi=$1/cli/lumi capture=$2 truth=$3
work_folder "${4:-}"
command -v colmap >/dev/null || { echo "colmap.sh: colmap is not installed (script/bootstrap all)" >&2; exit 1; }
export QT_QPA_PLATFORM=offscreen
rm -rf "$dir/db" "$dir/sparse"
mkdir -p "$dir/sparse"
lens=$(sed -n 's/.*"fl_x": \([^,]*\), "fl_y": \([^,]*\), "cx": \([^,]*\), "cy": \([^,]*\), .*/\1,\2,\3,\4,0,0,0,0/p' "$truth" | head -1)
quiet() { "$@" >"$dir/log" 2>&1 || { tail -5 "$dir/log" >&2; exit 1; }; }
begin=$(date +%s)
quiet colmap feature_extractor --database_path "$dir/db" --image_path "$capture/data/frames" --ImageReader.camera_model OPENCV_FISHEYE \
    --ImageReader.single_camera 1 --ImageReader.camera_params "$lens" --SiftExtraction.use_gpu 0
quiet colmap exhaustive_matcher --database_path "$dir/db" --SiftMatching.use_gpu 0 --SiftMatching.guided_matching 1
quiet colmap mapper --database_path "$dir/db" --image_path "$capture/data/frames" --output_path "$dir/sparse" \
    --Mapper.ba_refine_focal_length 0 --Mapper.ba_refine_principal_point 0 --Mapper.ba_refine_extra_params 0
echo "colmap: $(($(date +%s) - begin)) s, $(ls "$dir/sparse" | wc -l) models"
for model in "$dir"/sparse/*; do
    "$lumi" eval --poses "$model" --truth "$truth" || true
done
