#!/bin/sh
# damage_test.sh LUMI DAMAGE_FIELD: what `lumi render` does with damaged files: a picture, or one line that names the file
# and exit status 3; nothing half-written, no crash, no hang.
lumi=$1
# shellcheck source=tests/scenario/expect.sh
. "$(dirname "$0")/expect.sh"

mkdir "$scratch/in" "$scratch/out"
"$2" "$scratch/in" || fail "no damaged files"
pictures=0
refused=0
for file in "$scratch"/in/*.lumi; do
    timeout 60 "$lumi" render "$file" --pose 0.01,0.01,0,90,90 --size 48x32 -o "$scratch/out/view.png" \
        >"$scratch/said" 2>"$scratch/error"
    status=$?
    case $status in
    0)
        [ -s "$scratch/out/view.png" ] || fail "$file: status 0 and no picture"
        pictures=$((pictures + 1))
        ;;
    3)
        [ -z "$(ls -A "$scratch/out")" ] || fail "$file: refused, but $(ls -A "$scratch/out") is there"
        [ "$(wc -l <"$scratch/error")" -eq 1 ] || fail "$file: more or less than one line: $(cat "$scratch/error")"
        grep -Fq "$file: " "$scratch/error" || fail "$file is not named: $(cat "$scratch/error")"
        refused=$((refused + 1))
        ;;
    *)
        fail "$file: status $status: $(cat "$scratch/error")"
        ;;
    esac
    [ "$file" = "$scratch/in/whole.lumi" ] && [ $status -ne 0 ] && fail "the whole file is refused"
    rm -f "$scratch"/out/*
done
[ $pictures -gt 20 ] && [ $refused -gt 20 ] || fail "$pictures pictures, $refused refused: too few of one"
echo "damage_test: passed ($pictures pictures, $refused refused)"
