#!/bin/sh
# What lumi info says of a capture and of a field, against what was shot and what the file system says.
# usage: info.sh LUMI FOLDER_FROM_field.sh
set -eu
lumi=$1 folder=$2
fail() {
    echo "$1 says:"
    cat "$1"
    exit 1
}
has() { # FILE TEXT: the JSON object holds it
    grep -qF -e "$2" "$1" || { echo "missing: $2"; fail "$1"; }
}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

"$lumi" info --json "$folder/room.capture" >"$work/capture"
frames=$(cat "$folder/room.capture/data/frames/"* | wc -c)
all=$(find "$folder/room.capture" -type f -exec cat {} + | wc -c)
has "$work/capture" '"kind":"capture"'
has "$work/capture" '"frames":9,'
has "$work/capture" '"with_pose":9,'
has "$work/capture" '"width":192,"height":128,"pixels":221184,'
has "$work/capture" "\"images\":$frames,"
has "$work/capture" "\"all\":$all}"

"$lumi" info --json "$folder/room.lumi" >"$work/field"
has "$work/field" '"kind":"field"'
has "$work/field" '"surface":"plane"'
has "$work/field" '"fine":{"views":9,'
has "$work/field" '"width":192,"height":128,'
has "$work/field" "\"all\":$(wc -c <"$folder/room.lumi")}"
# the parts are the whole: images and geometry of both levels, and the index
awk 'BEGIN { RS = "[{}]" } /"images":/ && /"side":/ { sum += value("images") + value("geometry") }
    /"index":/ { sum += value("index"); all = value("all") }
    function value(name,   at) { at = match($0, "\"" name "\":[0-9]+"); return at ? substr($0, at + length(name) + 3, RLENGTH - length(name) - 3) + 0 : 0 }
    END { if (sum != all) { print sum " bytes in the parts, " all " in the file"; exit 1 } }' "$work/field" || fail "$work/field"

for path in "$folder/missing" "$folder/room.capture/data"; do
    status=0
    "$lumi" info "$path" >"$work/out" 2>"$work/said" || status=$?
    [ $status -eq 3 ] && grep -qF "$path" "$work/said" && [ ! -s "$work/out" ] || fail "$work/said"
done
