#!/bin/sh
# Captures with something wrong in them become light fields of what is right: what is wrong is found, left out, and named
# with what to do about it, by `lumi process` and in the calibration's report.
# usage: bad_capture_test.sh LUMI [MAKE_FILMS [DIR]]   (without MAKE_FILMS: the first capture alone; DIR: captures of an
#        earlier run are taken from there)
# shellcheck source=tests/scenario/expect.sh
. "$(dirname "$0")/expect.sh"
lumi=$1 make_films=$2 dir=${3:-$scratch}
cd "$scratch" || exit 1

shoot() { # NAME OPTIONS...
    name=$1
    shift
    [ -d "$dir/$name" ] && return
    "$lumi" sim shoot object --rig arc:4x12:0.3 --size 160x128 --pose-error 3,0.3 "$@" -o "$dir/$name" -j 2 >/dev/null ||
        fail "no capture $name"
}
process() { # CAPTURE USED OPTIONS...: to the field, with "USED of ALL" pictures
    name=$(basename "$1")
    capture=$1
    used=$2
    shift 2
    expect 0 "calibrated $used pictures" "$lumi" process "$capture" -w "$name.work" -o "$name.lumi" -q 50 --prefilter 0 \
        -j 2 "$@"
    expect_field "$name.lumi" "${used% of *}"
}
expect_field() { # FILE PICTURES: most of them are views of it (some are too near to one another)
    views=$("$lumi" info --json "$1" | sed -n 's/.*"fine":{"views":\([0-9]*\),.*/\1/p')
    [ -n "$views" ] && [ "$views" -ge $(($2 / 2)) ] || fail "$1 has $views views, of $2 pictures"
}
named() { # PART...: in what was printed, and in the report
    for part in "$@"; do
        echo "$out" | grep -Fq -e "$part" || fail "$name: not said: '$part' in: $out"
        grep -Fq -e "$part" "$name.work/calibrate/report.txt" || fail "$name: the report does not say '$part'"
    done
}
clean() { # a line for each thing that is wrong, and no other
    lines=$(echo "$out" | sed -n '/^  calibrated/,/^[a-z]/p' | grep -c '^  [a-z]')
    [ "$lines" -eq $(($1 + 1)) ] || fail "$name: $((lines - 1)) remarks, not $1: $out"
}

# A row that never came, a black frame, an unfocused camera.
shoot dull --fault missing-row=0 --fault black=r01c05 --fault unfocused=c03
process "$dir/dull" "23 of 36"
named "camera c00 has 0 of 12 pictures in turn 0: a missing row" "Take the row again" \
    "frame r01c05 is black" "shutter and lens cap" "camera c03 is unfocused" "Focus it and take them again"
clean 3
[ -z "$make_films" ] && exit

# A camera whose pictures share nothing with the others'.
shoot alone --fault isolated=c00
process "$dir/alone" "36 of 48"
named "camera c00 shares nothing with the other cameras" "not mirrored"
clean 1

# Two cameras whose pictures were exchanged: the field is made without them, and with them once that is said.
shoot swapped --fault swapped=c01:c02
process "$dir/swapped" "24 of 48"
named "camera c01 and camera c02 are in each other's place" "--exchange c01:c02"
clean 1
process "$dir/swapped" "48 of 48" --exchange c01:c02
clean 0
expect_line 2 "has no camera c09" "$lumi" process "$dir/swapped" -o x.lumi --exchange c01:c09
expect_line 2 "two cameras wanted" "$lumi" process "$dir/swapped" -o x.lumi --exchange c01

# It turned the other way: nothing fits, until that is said.
shoot backwards --fault backwards
expect_line 3 "turned the other way" "$lumi" process "$dir/backwards" -w backwards.work -o backwards.lumi -j 2
grep -Fq -e "run it with --backwards" backwards.work/calibrate/report.txt || fail "the report does not say what to do"
[ ! -e backwards.lumi ] || fail "a field of poses that are wrong"
process "$dir/backwards" "48 of 48" --backwards
clean 0

# Brackets of unequal length.
shoot brackets --brackets=-2,0,2 --fault unequal-brackets
process "$dir/brackets" "48 of 48"
named "brackets of unequal length: 8 of 48 pictures lack a shot" "that of +2 stops"
echo "$out" | grep -Fq "r00c04: the shot of +2 stops is missing; merged without it" || fail "merge said nothing: $out"

# Videos, of one of which pictures were dropped about two positions.
shoot whole
printf '%s\n' 'turn 9.6' 'drop c02 118 6' 'drop c02 166 6' >script
"$make_films" "$dir/whole" films script || fail "make_films"
expect 0 "c02: 12 pictures of the video were dropped" "$lumi" import films --rig films.rig -o dropped -j 2
process dropped "46 of 46"
named "camera c02 lacks 2 of 12 pictures in turn 0 (positions 5, 8): the video lacks whole pictures"
clean 1
