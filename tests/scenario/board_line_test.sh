#!/bin/sh
# board_line_test.sh LUMI SERVE_BOARD IMAGE: `lumi rig` with the flashed bytes on the emulated board at the end of a serial
# line: a board without a profile is configured and homed, sweeps, and its log holds every shot once.
lumi=$1 serve=$2 image=$3
[ -r "$image" ] || {
    echo "skipped: no image of the firmware: the cross compiler or nanopb's source is missing"
    exit 77
}
# shellcheck source=tests/scenario/expect.sh
. "$(dirname "$0")/expect.sh"
# shellcheck source=tests/scenario/rig_line.sh
. "$(dirname "$0")/rig_line.sh"
cd "$scratch" || exit 1

serve_line "$serve" "$image" board.rig 3
cat >short.plan <<'PLAN'
[sweep]
mode = continuous
positions = 12
turn_time_s = 7
exposures_s = 1/1000
PLAN

expect 0 "stm32f405" rig status
expect 0 "state     no profile" rig status
expect_line 1 "without a profile" rig home
rig "profile set" board.rig || fail "no profile could be set"
rig "profile get" >got || fail "no profile came back"
cmp got board.rig || fail "another profile came back"
expect_line 1 "lost" rig run short.plan
rig home || fail "home"
rig run short.plan --log sweep.jsonl || fail "the sweep: $(tail -3 sweep.jsonl)"
each_once sweep.jsonl 12
expect 0 "state     idle" rig status
exec 7>&-
wait
