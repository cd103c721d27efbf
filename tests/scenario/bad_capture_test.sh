#!/bin/sh
# Captures with something wrong in them: it is found, named in the report with what to do, and the rest is calibrated or
# the whole refused in one line.
# usage: bad_capture_test.sh LUMI [DIR]   (DIR: captures of an earlier run are taken from there)
. "$(dirname "$0")/expect.sh"
lumi=$1
dir=${2:-$scratch}

shoot() { # NAME OPTIONS...
    name=$1
    shift
    [ -d "$dir/$name" ] && return
    "$lumi" sim shoot room --rig arc:6x14:0.4 --size 240x192 --pose-error 3,0.3 --truth-poses "$dir/$name.json" "$@" \
        -o "$dir/$name" || fail "no capture $name"
}
find_poses() { # NAME: up to the stage before the last
    for stage in features pairs; do
        "$lumi" stage $stage "$dir/$1" -w "$scratch/$1.work" --calibrate yes >/dev/null || fail "$1: stage $stage"
    done
}
calibrate() { # NAME
    find_poses "$1"
    "$lumi" stage calibrate "$dir/$1" -w "$scratch/$1.work" --calibrate yes >/dev/null || fail "$1: not calibrated"
    report=$(cat "$scratch/$1.work/calibrate/report.txt")
}
reported() { # PART
    echo "$report" | grep -Fq -e "$1" || fail "the report does not say '$1': $report"
}

# A black frame, a row that never came, a camera that shares nothing with the others.
shoot A --fault black=r02c03 --fault isolated=c00 --fault missing-row=5
calibrate A
reported "frame r02c03 is black"
reported "camera c05 has 0 of 14 pictures"
reported "camera c00"
reported "take it again"
echo "$report" | head -1 | grep -Eq "calibrated 5[0-9] of 70" || fail "the rest is not calibrated: $report"

# Two cameras whose pictures were exchanged.
shoot B --fault swapped=c02:c03
calibrate B
reported "camera c02 and camera c03 are in each other's place"
reported "exchange their names"
echo "$report" | head -1 | grep -q "calibrated 56 of 84" || fail "the rest is not calibrated: $report"

# It turned the other way.
shoot C --fault backwards --fault unfocused=c04
find_poses C
expect_line 3 "turned the other way" "$lumi" stage calibrate "$dir/C" -w "$scratch/C.work" --calibrate yes
