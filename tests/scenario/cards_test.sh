#!/bin/sh
# cards_test.sh LUMI MAKE_CARDS MAKE_DNG: what lay on the memory cards of a rig becomes a capture with the mechanism's poses;
# what is missing, doubled, damaged or of no shot is said in a line each, and the rest becomes a light field.
lumi=$1 make_cards=$2 make_dng=$3
# shellcheck source=tests/scenario/expect.sh
. "$(dirname "$0")/expect.sh"
cd "$scratch" || exit 1

"$lumi" sim shoot object --rig arc:3x12:0.35 --size 100x80 --format jpeg -o a -j 2 >/dev/null || fail "no capture"
pictures=$(frames a)

# Four clocks, a card whose numbers go round, nothing missing: every frame is where it was, its picture too.
printf '%s\n' 'clock c01 -3600.25 40' 'clock c02 7.5 -60' 'clock c03 86400 10' 'number c01 9993' >script
"$make_cards" a cards script || fail "make_cards"
expect 0 "" "$lumi" import cards --rig cards.rig -o b -j 2
[ -z "$out" ] || fail "said of whole cards: $out"
[ "$(frames b)" -eq "$pictures" ] || fail "$(frames b) of $pictures frames"
cmp -s b/data/frames/c01-t00-p011.JPG cards/c01/DCIM/100LUMIS/IMG_0005.JPG || fail "not byte for byte, or another picture"
expect 0 "whole" "$lumi" verify b
"$lumi" export a --transforms a.json && "$lumi" export b --transforms b.json || fail "export"
grep -A40 '"frames"' a.json | grep -o '"transform_matrix".*' >a.poses
grep -A40 '"frames"' b.json | grep -o '"transform_matrix".*' >b.poses
cmp -s a.poses b.poses || fail "the mechanism's poses are others than those the pictures were taken from"

# By name of each camera; a folder nobody knows; no folder of one.
mkdir named && cp -r cards/c00 named/left && cp -r cards/c01 named/c01 && cp -r cards/c02 named/c02
expect 0 "the rig has no camera 'left'" "$lumi" import named --rig cards.rig -o c
said "c00: there is no folder of its pictures" "c03: there is no folder of its pictures"
expect 0 "c03: there is no folder" "$lumi" import named --rig cards.rig --camera c00=named/left -o d
[ "$(frames d)" -eq $((pictures * 3 / 4)) ] || fail "$(frames d) frames of three cameras"

# All that may be wrong with cards.
cat >script <<'END'
clock c01 -3600.25 40
clock c02 7.5 -60
number c01 9993
skip c00 4
stop c02 8
test c00 30
test c01 -20
copy c01 6
cut c01 9
END
"$make_cards" a bad script || fail "make_cards"
expect 0 "c00: DCIM/100LUMIS/IMG_0001.JPG taken before the sweep: not used" "$lumi" import bad --rig bad.rig -o e
said "c00: no picture of turn 0, position 4" "c02: stopped early: no picture of the last 4 shots, from turn 0, position 8" \
    "c01: DCIM/100LUMIS/IMG_0001.JPG is a copy of DCIM/100LUMIS/IMG_9999.JPG" \
    "c01: bad/c01/DCIM/100LUMIS/IMG_0004.JPG: Premature end of JPEG file" "IMG_0007.JPG taken after the sweep"
[ "$(echo "$out" | wc -l)" -eq 7 ] || fail "not a line each: $out"
[ "$(frames e)" -eq $((pictures - 6)) ] || fail "$(frames e) frames of damaged cards"
for frame in c00-t00-p003 c01-t00-p008 c01-t00-p010 c02-t00-p007 c03-t00-p011; do
    cmp -s "b/data/frames/$frame.JPG" "e/data/frames/$frame.JPG" && continue
    # Times in the files differ; the pictures may not.
    [ "$(tail -c 1000 "b/data/frames/$frame.JPG" | cksum)" = "$(tail -c 1000 "e/data/frames/$frame.JPG" | cksum)" ] ||
        fail "$frame is another picture"
done
expect 3 "IMG_0001.JPG taken before the sweep: not used (and 6 more; --strict)" "$lumi" import bad --rig bad.rig --strict -o f
[ ! -e f ] || fail "--strict left a capture"
expect 0 "42 made" "$lumi" process e -o e.lumi --calibrate no -j 2

# Brackets, one of them short: what is missing is missing in its place.
printf '%s\n' 'pace 0.4' 'bracket -2 0 2' 'clock c02 100 0' 'skip c01 13' 'skip c03 0' >script
"$make_cards" a brackets script || fail "make_cards"
expect 0 "c01: no picture of turn 0, position 4, exposure 2 of 3" "$lumi" import brackets --rig brackets.rig -o g -j 2
said "c03: no picture of turn 0, position 0, exposure 1 of 3"
[ "$(frames g)" -eq $((pictures * 3 - 2)) ] || fail "$(frames g) frames of brackets"
[ ! -e g/data/frames/c01-t00-p004-b1.JPG ] || fail "another exposure took the place of the one that is missing"
expect 0 "merge                 48 made" "$lumi" process g -o g.lumi --calibrate no -j 2
expect 0 "" "$lumi" import brackets --rig brackets.rig --brackets -2,0,2 -o h -j 2
[ "$(ls g/data/frames | cksum)" = "$(ls h/data/frames | cksum)" ] || fail "--brackets gives other frames"

# Raw files are developed with the capture's white balance: what the files say, what is said, what makes them grey.
"$lumi" sim shoot object --rig arc:3x12:0.35 --size 100x80 --format exr -o light -j 2 >/dev/null || fail "no capture"
mkdir -p raw/c01
for picture in light/data/frames/r01*.exr; do
    "$make_dng" "$picture" "raw/c01/$(basename "$picture" .exr).dng" 12 || fail "$picture"
done
for white in camera 1.66667,1,1.42857 1,1,1 auto daylight; do
    expect 0 "c01: its pictures do not tell when they were taken: matched by their order alone" \
        "$lumi" import raw --rig cards.rig --white-balance $white -o "raw-$white" -j 2
    "$lumi" stage equiangular "raw-$white" --calibrate no --synthesize no --subsample no -j 2 >/dev/null || fail "developing with $white"
    cat "raw-$white".work/equiangular/*.exr | cksum >"$white.sum"
done
for white in 1,1,1 auto; do
    cmp -s camera.sum "$white.sum" && fail "--white-balance $white changes nothing"
done
cmp -s 1,1,1.sum auto.sum && fail "--white-balance auto is none"
expect_line 2 "factors of 0.01 to 100" "$lumi" import raw --rig cards.rig --white-balance 0,1,1 -o x
expect_line 2 "--white-balance" "$lumi" import raw --rig cards.rig --white-balance warm -o x

# A lens that was calibrated stands in for the profile's, whatever it is called.
sed -n '/^\[lens/,/^$/p' cards.rig | sed 's/^\[lens .*/[lens mine]/; s/^fx = .*/fx = 47.25/' >mine.lens
expect 0 "" "$lumi" import cards --rig cards.rig --lens mine.lens -o lens -j 2
"$lumi" export lens --transforms lens.json || fail "export"
grep -q '"fl_x": *47.25' lens.json || fail "the lens is the profile's"
expect_line 3 "no section [lens" "$lumi" import cards --rig cards.rig --lens script -o x
printf '[lens mine]\nmodel = fisheye\nwidth = none\n' >bad.lens
expect_line 3 "bad.lens:3" "$lumi" import cards --rig cards.rig --lens bad.lens -o x

# Command lines and inputs that cannot be.
expect_line 3 "none: reading the folder" "$lumi" import none --rig cards.rig -o x
mkdir empty empty/c00
expect_line 3 "there are no pictures" "$lumi" import empty --rig cards.rig -o x
expect_line 3 "no folder in it is called as a camera" "$lumi" import named/left --rig cards.rig -o x
expect_line 2 "no camera of this name" "$lumi" import --camera nobody=named/left --rig cards.rig -o x
expect_line 2 "NAME=FOLDER wanted" "$lumi" import --camera nobody --rig cards.rig -o x
expect_line 2 "want a rig" "$lumi" import cards --brackets 0,1 -o x
expect_line 2 "-20 to 20 stops" "$lumi" import cards --rig cards.rig --brackets 0,99 -o x
expect_line 2 "the profile says" "$lumi" import cards --rig cards.rig --fov 90 -o x
sed 's/^height = .*/height = 60/; s/^cy = .*/cy = 30/' cards.rig >other.rig
expect_line 3 "another shape" "$lumi" import cards --rig other.rig -o x
[ ! -e x ] && [ -z "$(find . -name 'x*.partial')" ] || fail "something was left behind"
