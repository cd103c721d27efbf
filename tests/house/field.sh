#!/bin/sh
# A small capture and the field made from it, for the tests that want one.
# usage: field.sh LUMI FOLDER
set -eu
lumi=$1 folder=$2
rm -rf "$folder"
mkdir -p "$folder"
"$lumi" sim shoot room --rig planar:3x3:0.05 --size 192x128 -o "$folder/room.capture"
"$lumi" process "$folder/room.capture" -o "$folder/room.lumi"
