#!/bin/sh
# rig_files_test.sh LUMI: profiles and plans that cannot be are refused with exit status 3 and one line, before there is
# a rig; those that can be are told in numbers.
lumi=$1
# shellcheck source=tests/scenario/expect.sh
. "$(dirname "$0")/expect.sh"
cd "$scratch" || exit 1

# The paper's sweeps.
plan() { # LINE...: a plan of these lines in ./plan
    printf '[sweep]\n' >plan
    printf '%s\n' "$@" >>plan
}
can() { expect 0 "$1" "$lumi" rig plan check plan --profile "$2"; }
cannot() { expect_line 3 "$1" "$lumi" rig plan check plan --profile "$2"; }
for time in 30 60 120; do
    plan "turn_time_s = $time"
    can "72 shots, 1152 frames in" arc16
done
plan
can "144 shots, 2304 frames in" arc16x2
can "1296 shots, 2592 frames in 9:0" bar2
plan "mode = start-stop" "turn_time_s = 60"
can "1152 frames in" arc16
plan "mode = start-stop" "position_time_s = 1.5" "exposure_s = 1/60" "stops = -2 0 +2"
can "3888 shots, 7776 frames in 32:24 min" bar2
plan "mode = video" "turns = 1"
can "a video of 1 turn in 0:3" arc16

# What is printed is read again, and says the same.
for rig in arc16 arc16x2 bar2; do
    "$lumi" rig profile check $rig --print >$rig.rig || fail "$rig is not printed"
    "$lumi" rig profile check $rig.rig --print | cmp - $rig.rig || fail "$rig changes when it is read"
    expect 0 "$rig.rig: $rig" "$lumi" rig profile check $rig.rig
done
expect 0 '"steps_per_turn":28800.0' "$lumi" rig profile check bar2.rig --json
plan "mode = start-stop" "turn_time_s = 200" "exposures_s = 1/1000, 0.0123" "cameras = c01"
"$lumi" rig plan check plan --profile bar2 --print >again || fail "the plan is not printed"
"$lumi" rig plan check again --profile bar2 --print | cmp - again || fail "the plan changes when it is read"

# Profiles that cannot be.
refused() { # FROM TO REASON: bar2 with a line changed
    grep -q "^$1" bar2.rig || fail "bar2 has no line '$1'"
    sed "s|^$1.*|$2|" bar2.rig >bad.rig
    expect_line 3 "$3" "$lumi" rig profile check bad.rig
    [ "$out" != "${out#*bad.rig}" ] || fail "the file is not named: $out"
}
refused "gear_motor" "gear_motor = 0" "a ratio of the drive is zero"
refused "hold_m" "hold_m = 2" "is longer than its string of"
refused "turns = " "turns = 60" "60 turns need"
refused "channel = 1" "channel = 0" "both on channel 0"
refused "channel = 1" "channel = 16" "channel 16"
refused "shutter_lag_s" "shutter_lag_s = 100" "shutter_lag of 100 s"
refused "speed_max_deg_s" "speed_max_deg_s = 2000" "steps/s, the board makes 100000"
refused "jerk_max_deg_s3" "jerk_max_deg_s3 = nan" "is no number"
refused "estop" "estop = ramp, brake, triggers-off" "the motor stops at once"
refused "slack = " "slack = off, brake, triggers-off" "the arm falls"
refused "overspeed = " "overspeed = sing" "bad.rig:"
for i in 02 03 04 05 06 07 08 09 10 11 12 13 14 15 16; do
    printf '[camera c%s]\nlens = fisheye\nradius_m = 0.4\n' $i
done | cat bar2.rig - >bad.rig
expect_line 3 "more than 16 cameras" "$lumi" rig profile check bad.rig
head -c 20000 /dev/zero >bad.rig
expect_line 3 "bad.rig" "$lumi" rig profile check bad.rig
expect_line 3 "nosuch" "$lumi" rig profile check nosuch
expect_line 3 "is a folder" "$lumi" rig profile check .

# Plans that outrun the rig.
plan "turn_time_s = 5"
cannot "the motor makes 1.0472 (a turn in 6 s)" bar2
plan "turn_time_s = 8" "exposures_s = 1/1000"
cannot "the cameras take a picture every" bar2
plan "turns = 50"
cannot "of string, there are" bar2
plan "turns = 2"
cannot "with the arm held by its brake" arc16
plan "mode = start-stop" "position_time_s = 0.7"
cannot "0.7 s a position: the move takes" bar2
plan "exposures_s = 1/100"
cannot "smears 1.28 pixels, 1 are allowed" bar2
sed 's/^f\([xy]\) = .*/f\1 = 1145.9155902616465/' bar2.rig >fine.rig # 20 pixels a degree
plan "exposures_s = 1/250"
can "at most 0.96 pixels of blur" fine.rig
plan "exposures_s = 1/200"
cannot "smears 1.2 pixels, 1 are allowed" fine.rig
plan "cameras = c07"
cannot "plan:2: cameras: the rig has no camera 'c07'" bar2
sed 's/^channel = 1$/channel = none/' bar2.rig >still.rig
plan "mode = video" "cameras = c01"
cannot "camera 'c01' has no channel for its record line" still.rig
plan "positions = 4096" "turns = 3"
cannot "are 12288 shots, the board keeps 8192" bar2
plan "turn_time_s = nan"
cannot "plan:2: turn_time_s: 'nan' is no number" bar2
expect_line 3 "nosuch" "$lumi" rig plan check nosuch --profile bar2
expect_line 3 "nosuch" "$lumi" rig plan check plan --profile nosuch
expect_line 2 "--profile PROFILE is missing" "$lumi" rig plan check plan
expect_line 2 "either --json or --print" "$lumi" rig profile check bar2 --json --print
expect_line 2 "usage: lumi rig profile check" "$lumi" rig profile check

echo "rig_files_test: passed"
