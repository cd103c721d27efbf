#!/bin/sh
# rig_run_test.sh LUMI SERVE_RIG: a crew's evening with a simulated rig (40 times as fast) at the end of a line: from a
# board without a profile to a whole sweep, with Ctrl-C, an emergency stop, a cable that breaks and a board that restarts
# on the way, every shot once in the log.
lumi=$1 serve=$2
# shellcheck source=tests/scenario/expect.sh
. "$(dirname "$0")/expect.sh"
# shellcheck source=tests/scenario/rig_line.sh
. "$(dirname "$0")/rig_line.sh"
cd "$scratch" || exit 1

serve_line "$serve" arc16 40
shots_in() { # LOG: how many lines say that a shot was fired
    grep -c '"shot":[0-9]*,"lost":false' "$1"
}
await_shots() { # LOG COUNT
    tries=0
    until [ -s "$1" ] && [ "$(shots_in "$1")" -ge "$2" ]; do
        tries=$((tries + 1))
        [ $tries -lt 1200 ] || fail "no $2 shots in $1"
        sleep 0.05
    done
}

# A new board.
expect 0 "state     no profile" rig status
expect_line 1 "without a profile" rig home
expect_line 3 "no profile" rig "profile get"
printf '[rig]\nname = x\n' >bad.rig
expect_line 3 "bad.rig" rig "profile set" bad.rig
"$lumi" rig profile check arc16 >/dev/null || fail "arc16 is no profile"
rig "profile set" arc16 || fail "no profile could be set"
rig "profile get" -o rig.txt || fail "no profile could be got"
# A rig 40 times as fast sees its host's heartbeats 40 times as rarely.
sed -i 's/^host_timeout_s.*/host_timeout_s = 600/' rig.txt
rig "profile set" rig.txt || fail "the profile could not be changed"
rig "profile get" | cmp -s - rig.txt || fail "another profile came back"

# Position unknown: nothing but home.
printf '[sweep]\nturn_time_s = 120\n' >plan
expect_line 1 "the board refuses" rig jog 0.1
expect_line 1 "the board refuses" rig run plan
rig home || fail "home"
expect 0 '"position_known":true' rig status --json
rig jog 0.25 || fail "jog"
rig jog -- -0.25 || fail "jog back"
expect_line 3 "farther or faster" rig jog 100000
rig "test triggers" --gap 0.2 || fail "test triggers"
expect_line 2 "no camera 'nobody'" rig "test triggers" nobody

# Plans that cannot be are refused before anything moves.
printf '[sweep]\nturn_time_s = 0.5\n' >hasty
expect_line 3 "hasty" rig run hasty
printf '[sweep]\nexposure_s = 1/10\n' >blurred
expect_line 3 "blurred" rig run blurred
expect_line 3 "no firmware of a rig" rig flash plan
expect 0 "state     idle" rig status

# Ctrl-C in the middle.
"$lumi" rig run -l "$board" plan --log log >printed 2>&1 &
runner=$!
await_shots log 10
kill -INT $runner
wait $runner
[ $? -eq 1 ] || fail "a paused sweep ended with another status: $(cat printed)"
grep -q "paused: .* shots are missing" printed || fail "nothing is said of what is missing: $(cat printed)"
expect 0 "state     paused" rig status
fired=$(shots_in log)
[ "$fired" -ge 10 ] && [ "$fired" -lt 72 ] || fail "$fired shots after a pause"
expect_line 3 "is there already" rig run plan --log log
expect_line 3 "--resume takes what is missing" rig run plan --log other
[ ! -e other ] || fail "a sweep that never began left a log"

# On with it, until somebody presses the switch.
"$lumi" rig run -l "$board" plan --resume --log log >printed 2>&1 &
runner=$!
await_shots log $((fired + 5))
echo "estop 1" >&7
wait $runner
[ $? -eq 1 ] || fail "an emergency stop ended with another status: $(cat printed)"
grep -q "emergency stop" printed || fail "no word of the emergency stop: $(cat printed)"
expect_line 1 "still pressed" rig clear
expect_line 1 "stopped" rig run plan --resume --log log
echo "estop 0" >&7
tries=0
until rig clear >/dev/null 2>&1; do
    tries=$((tries + 1))
    [ $tries -lt 100 ] || fail "the emergency stop cannot be cleared"
    sleep 0.05
done
expect 0 "position  unknown" rig status
rig home || fail "home after an emergency stop"

# The cable breaks, and the host's program is killed; the board goes on by itself.
fired=$(shots_in log)
"$lumi" rig run -l "$board" plan --resume --log log >printed 2>&1 &
runner=$!
await_shots log $((fired + 3))
kill -KILL $runner
wait $runner 2>/dev/null
echo "cut 1" >&7
sleep 0.5
expect_line 1 "nothing answers" rig status
echo "cut 0" >&7
# What is done meanwhile takes nothing from the log.
rig clear >/dev/null || fail "clear with nothing to clear"
rig "profile get" >/dev/null || fail "profile get"
rig run plan --resume --log log >printed 2>&1 || fail "the sweep was not completed: $(cat printed)"
each_once log 72
grep -q '"event_lost"' log && fail "events were lost: $(grep event_lost log)"

# The board restarts in the middle of another sweep: what the log has is not taken again.
printf '[sweep]\nname = second\nturn_time_s = 100\n' >second
"$lumi" rig run -l "$board" second --log log2 >printed 2>&1 &
runner=$!
await_shots log2 8
echo reset >&7
wait $runner
[ $? -eq 1 ] || fail "a restart ended with another status: $(cat printed)"
grep -q "started again" printed || fail "no word of the restart: $(cat printed)"
rig home || fail "home after a restart"
grep -v -e '"shot":2,' -e '"shot":5,' log2 >holes && mv holes log2 # as if two had been lost
rig run second --resume --log log2 --json >printed 2>&1 || fail "not completed after a restart: $(cat printed)"
grep -q '"fired":72,"lost":0,"missing":0,"complete":true' printed || fail "$(cat printed)"
each_once log2 72

# The board holds another unfinished sweep: what is complete leaves it alone, what is not is refused.
printf '[sweep]\nname = third\nturn_time_s = 100\n' >third
"$lumi" rig run -l "$board" third --log log3 >printed 2>&1 &
runner=$!
await_shots log3 8
kill -INT $runner
wait $runner
expect 0 "72 shots fired" rig run plan --resume --log log
head -n 30 log2 >part
expect_line 3 "another sweep, third" rig run second --resume --log part
rig status | grep -q "sweep     0 fired" && fail "the board has forgotten the other sweep"
rig run second --resume --again --log part >printed 2>&1 || fail "not completed after another sweep: $(cat printed)"
each_once part 72
printf '{"log":"lumi rig run","ver' >torn
rig run second --resume --log torn >printed 2>&1 || fail "not gone on with after a torn log: $(cat printed)"
grep -q "begun anew" printed || fail "nothing is said of a torn log: $(cat printed)"
each_once torn 72
rig run third --resume --log log3 >printed 2>&1 || fail "the other sweep was not completed: $(cat printed)"
each_once log3 72

# Stopped by hand; an emergency stop by the link.
"$lumi" rig run -l "$board" plan --again >printed 2>&1 &
runner=$!
sleep 0.5
rig status --json 2>/dev/null | grep -q '"state":' && fail "the line was open to two programs"
kill -INT $runner
kill -INT $runner
wait $runner
[ $? -eq 1 ] || fail "stopped with another status: $(cat printed)"
rig stop || fail "stop"
rig stop --emergency || fail "emergency stop"
expect 0 "faults    estop" rig status
rig clear | grep -q "cleared: estop" || fail "clear"

# Lines that are not ours.
"$lumi" rig status -l nosuch 2>/dev/null
[ $? -eq 2 ] || fail "an address that is none"
expect_line 3 "/dev/lumi-nosuch" "$lumi" rig status -l /dev/lumi-nosuch
echo quit >&7
