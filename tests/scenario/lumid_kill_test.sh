#!/bin/sh
# The daemon itself is killed (kill -9) again and again while it takes captures from a simulated rig of processes: each
# time what it had told to be stored is there, it comes back and goes on, and in the end every capture is complete.
# usage: lumid_kill_test.sh LUMI LUMID CAPTURE_KEPT [KILLS]
set -eu
lumi=$1 lumid=$2 capture_kept=$3 kills=${4:-10}
# shellcheck source=tests/scenario/rig_daemon.sh
here=$(cd "$(dirname "$0")" && pwd)
. "$here/rig_daemon.sh"

# ---- inside the rig's network ----

start() {
    launch_daemon
    await_daemon
}
state() { # what its status says of the state: one word
    "$lumi" capture status >status.txt 2>&1 || fail "no status: $(cat status.txt)"
    sed -n 's/^state  *\([a-z]*\).*/\1/p' status.txt
}
# Until the next kill: two of three come when some more frames were told of, the third whatever is under way then. The
# numbers are the same in every run. On a busy computer it takes its time until there is a frame at all.
seed=7
frames_told() {
    grep -c '"frame"' events.txt || :
}
moment() {
    seed=$(((seed * 1103515245 + 12345) % 2147483648))
    if [ $((killed % 3)) -gt 0 ] || [ $killed -ge "$kills" ]; then
        frames=$(($(frames_told) + 1 + seed / 65536 % 5))
        tries=0
        while [ "$(frames_told)" -lt $frames ] && [ $tries -lt 1500 ] && [ "$(state)" != done ]; do
            tries=$((tries + 1))
            sleep 0.05
        done
    fi
    sleep "$(awk -v n="$seed" -v most=$((killed % 3 ? 1 : 5)) 'BEGIN { printf "%.2f", most * (n / 2147483648) ^ 2 }')"
}
begin() { # NAME; a frame of a test may be lost on a busy computer
    tries=0
    until "$lumi" capture start --name "$1" "$LUMI_SIM_RIG/plan.txt" >said.txt 2>&1; do
        tries=$((tries + 1))
        [ $tries -lt 3 ] || fail "$(cat said.txt)"
    done
}
# The frames that were told of as stored are rows with whole files: nobody has opened the capture since the kill.
check_kept() { # CAPTURE
    tr -d ' ' <events.txt | sed -n '/"event":"frame"/{/"state":"\(received\|accepted\)"/p;}' |
        sed -n 's/.*"shot":\([0-9]*\).*"camera":"\([^"]*\)".*/\1 \2/p' | sort -u >told.txt
    [ -s told.txt ] || return 0
    "$capture_kept" "$1" >kept.txt 2>kept.err || fail "$1: $(cat kept.err)"
    sort -u kept.txt -o kept.txt
    lost=$(comm -23 told.txt kept.txt)
    [ -z "$lost" ] || fail "told to be stored, and not there (shot, camera): $lost; $(cat kept.err)"
    proven=$((proven + $(wc -l <told.txt)))
}
# Until it is done; what only an operator may decide is decided.
await_done() {
    tries=0
    while now=$(state) && [ "$now" != done ]; do
        tries=$((tries + 1))
        [ $tries -lt 1500 ] || fail "it comes to no end: $(cat status.txt)"
        case $now in
        paused | interrupted) "$lumi" capture resume >/dev/null 2>&1 || : ;;
        failed) fail "it has failed: $(cat status.txt)" ;;
        esac
        sleep 0.2
    done
}
# Killed often enough, and at least once when frames had been told of.
enough() {
    [ $killed -ge "$kills" ] && { [ $proven -gt 0 ] || [ $killed -ge $((kills + 5)) ]; }
}
# A capture, the daemon being killed up to ten times in it.
take() { # NAME
    capture=$LUMI_SIM_RIG/captures/$1
    : >events.txt
    "$lumi" capture watch --json --follow >events.txt 2>watch.err &
    watch=$!
    begin "$1"
    here=0
    while ! enough && [ $here -lt 10 ]; do
        moment
        now=$(state)
        if [ "$now" = done ] || [ "$now" = idle ]; then
            break
        fi
        kill -9 $daemon
        wait $daemon 2>/dev/null || :
        killed=$((killed + 1)) here=$((here + 1))
        echo "$now" >>moments.txt
        check_kept "$capture"
        start
        # Killed before there was a capture: nothing to go on with.
        if [ "$(state)" = idle ] && [ ! -e "$capture/manifest-sha256.txt" ]; then
            begin "$1"
        fi
    done
    [ "$(state)" = idle ] || await_done
    kill $watch 2>/dev/null || :
    wait $watch || :
}

if [ "${5:-}" = operate ]; then
    judge_nothing
    export LUMID_ADDRESS=http://localhost:8483
    daemon='' watch='' killed=0 captures=0 proven=0
    trap 'kill -9 $daemon $watch 2>/dev/null || :' EXIT
    trap 'exit 1' INT TERM
    start
    while ! enough; do
        captures=$((captures + 1))
        [ $captures -le $((kills + 2)) ] || fail "$killed kills in $captures captures"
        take "take-$captures"
    done
    kill -TERM $daemon
    wait $daemon || fail "it ended with $?"
    daemon=
    [ $proven -gt 0 ] || fail "nothing was told to be stored before any kill"
    echo "killed $killed times in $captures captures, while it was: $(sort moments.txt | uniq -c | tr -s ' \n' ' ')"
    echo "$proven times a frame that was told to be stored before a kill was there after it"
    exit 0
fi

# ---- outside ----

need_network
rm -rf lumid_kill_test.tmp
mkdir lumid_kill_test.tmp
cd lumid_kill_test.tmp
"$lumi" sim rig object --rig arc:2x10:0.2 --size 32x32 --white 0.008 -o rig --seed 5 --position-time 1.6 --patience 60 --port 8483 \
    --own-network -- sh "$here/lumid_kill_test.sh" "$lumi" "$lumid" "$capture_kept" "$kills" operate ||
    fail "the rig ended badly"
for capture in rig/captures/take-*; do
    "$lumi" verify "$capture" >said.txt 2>&1 || fail "$capture: $(cat said.txt)"
    [ -e "$capture/manifest-sha256.txt" ] || fail "$capture is not sealed"
    "$lumi" info "$capture" >info.txt
    grep -q " 40 accepted" info.txt || fail "$capture: $(cat info.txt)"
done
