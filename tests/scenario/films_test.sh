#!/bin/sh
# films_test.sh LUMI MAKE_FILMS: one video a camera becomes a capture: pictures at the positions between the turn marks of
# the rig's lamp, offsets between the cameras from the lamp, the sound or the motion, what is dropped, doubled, damaged or
# cut off said in a line each.
lumi=$1 make_films=$2
# shellcheck source=tests/scenario/expect.sh
. "$(dirname "$0")/expect.sh"
cd "$scratch" || exit 1
taken() { # CAPTURE CAMERA: when its pictures were taken, in order
    "$lumi" export "$1" --transforms - --original-names 2>/dev/null | grep -o "$2.mkv@[0-9.]*" ||
        { "$lumi" export "$1" --transforms names.json --original-names && grep -o "$2.mkv@[0-9.]*" names.json; }
}
near() { # CAPTURE CAMERA FIRST STEP TOLERANCE: every picture is as near to its position
    taken "$1" "$2" | sed 's/.*@//' | awk -v first="$3" -v step="$4" -v most="$5" '
        { off = $1 - first - step * (NR - 1); if (off < 0) off = -off; if (off > most) bad = NR ":" $1 }
        END { if (bad) print bad; exit bad != "" || NR != 12 }' || fail "$2 of $1: a picture of another time, or not 12"
}

"$lumi" sim shoot object --rig arc:3x12:0.35 --size 100x80 --format jpeg -o a -j 2 >/dev/null || fail "no capture"
pictures=$(frames a)

# The lamp is seen by all: 0.8 s from position to position, each camera by its own clock. Twenty pictures a second place a mark to
# half a picture, and the nearest picture to a position to half a picture more.
printf '%s\n' 'turn 9.6' 'lead c01 2.537' 'lead c02 0.9' 'lead c03 3.3' >script
"$make_films" a films script || fail "make_films"
expect 0 "" "$lumi" import films --rig films.rig -o b -j 2
[ -z "$out" ] || fail "said of whole videos: $out"
[ "$(frames b)" -eq "$pictures" ] || fail "$(frames b) of $pictures frames"
near b c00 2 0.8 0.051
near b c01 2.537 0.8 0.051
near b c02 0.9 0.8 0.051
near b c03 3.3 0.8 0.051
expect 0 "whole" "$lumi" verify b
"$lumi" import films --rig films.rig -o c -j 1 >/dev/null || fail "with one thread"
[ "$(cat b/data/frames/* | cksum)" = "$(cat c/data/frames/* | cksum)" ] || fail "threads change the pictures"

# Some do not see it: they are laid over the others by sound, or by what moves.
printf '%s\n' 'turn 9.6' 'lead c01 2.537' 'dark c01 0' 'lead c02 0.9' 'dark c02 0' 'mute c02 0' >script
"$make_films" a dark script || fail "make_films"
expect 0 "c01: the lamp was seen at 0 of 2 turn marks; the others by the sound" "$lumi" import dark --rig dark.rig -o d
said "c02: the lamp was seen at 0 of 2 turn marks"
near d c01 2.537 0.8 0.055

# Pictures that were dropped, are there twice, or damaged.
printf '%s\n' 'turn 9.6' 'drop c01 118 6' 'double c02 88' 'break c03 152' >script
"$make_films" a bad script || fail "make_films"
expect 0 "c01: 6 pictures of the video were dropped, first after 5.850 s" "$lumi" import bad --rig bad.rig -o e
said "c03: bad/c03.mkv: a picture that cannot be decoded behind 7.55 s" "c02: 1 pictures of the video are the one before again" \
    "c01: no picture of 1 positions, first of turn 0, position 5: the video lacks whole pictures at 5.9"
[ "$(frames e)" -eq $((pictures - 1)) ] || fail "$(frames e) frames of damaged videos"
taken e c02 | sed -n 4p | grep -q '@4.400' && fail "the doubled picture was taken"

# Cut off, noise, nothing.
mkdir cut
cp films/*.mkv cut
head -c "$(($(wc -c <films/c02.mkv) / 2))" films/c02.mkv >cut/c02.mkv
expect 0 "c02: the lamp was seen at 1 of 2 turn marks" "$lumi" import cut --rig films.rig -o f
said "c02: stopped early" "c02: cut/c02.mkv: ends after"
mkdir noise
head -c 100000 /dev/urandom >noise/c00.mkv
expect_line 3 "noise/c00.mkv: no video that can be read" "$lumi" import noise --rig films.rig -o x
: >noise/c00.mkv
expect_line 3 "noise/c00.mkv: no video that can be read" "$lumi" import noise --rig films.rig -o x
mkdir alone && cp dark/c02.mkv alone
expect_line 3 "alone/c02.mkv: the lamp's turn marks are not in it" "$lumi" import alone --rig films.rig -o x
expect 0 "" "$lumi" import alone --rig films.rig --marks 0.9,10.5 -o g
near g c02 0.9 0.8 0.051
mkdir both both/c01 && cp dark/c02.mkv both && cp a/data/frames/r00c00.jpg both/c01
expect_line 3 "must be of one kind" "$lumi" import both --rig films.rig -o x
expect_line 2 "two times in seconds" "$lumi" import films --rig films.rig --marks 5,4 -o x
[ ! -e x ] && [ -z "$(find . -name 'x*.partial')" ] || fail "something was left behind"
