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
cd "$scratch" || exit 1

mkfifo control
"$serve" "$image" board.rig 3 <control >terminal &
exec 7>control
tries=0
until [ -s terminal ]; do
    tries=$((tries + 1))
    [ $tries -lt 600 ] || fail "no emulated board"
    sleep 0.05
done
board=$(cat terminal)
rig() {
    what=$1
    shift
    # shellcheck disable=SC2086
    "$lumi" rig $what -l "$board" "$@"
}
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
grep -o '"shot":[0-9]*,"lost":false' sweep.jsonl | tr -dc '0-9\n' | sort -n >had
seq 0 11 >wanted
cmp had wanted || fail "the log does not hold every shot once"
expect 0 "state     idle" rig status
exec 7>&-
wait
