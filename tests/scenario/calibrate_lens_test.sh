#!/bin/sh
# lumi calibrate lens on the chessboard of Debian's opencv-doc, where that is installed.
# usage: calibrate_lens_test.sh LUMI
set -u
. "$(dirname "$0")/expect.sh"
lumi=$1

expect_line 2 "--board is missing" "$lumi" calibrate lens "$scratch"
expect_line 2 "corners wanted" "$lumi" calibrate lens "$scratch" --board 2x6
expect_line 3 "no pictures" "$lumi" calibrate lens "$scratch" --board 9x6
expect_line 3 "" "$lumi" calibrate lens "$scratch/none.png" --board 9x6
examples=/usr/share/doc/opencv-doc/examples/data
if ! [ -e $examples/left01.jpg ]; then
    echo "opencv-doc is not installed: its pictures are not tried"
    exit 77
fi
mkdir "$scratch/left"
cp $examples/left0?.jpg $examples/left1?.jpg "$scratch/left"
expect 0 "13 pictures, 0 without a board; 0.196 px" "$lumi" calibrate lens "$scratch/left" --board 9x6 --model pinhole \
    --name studio -o "$scratch/lens.txt"
grep -q '^\[lens studio\]$' "$scratch/lens.txt" || fail "no lens in the file"
grep -q '^fx = 533\.[01]' "$scratch/lens.txt" || fail "another focal length: $(grep fx "$scratch/lens.txt")"
expect_line 3 "do not tell the lens" "$lumi" calibrate lens "$scratch/left/left01.jpg" --board 9x6
