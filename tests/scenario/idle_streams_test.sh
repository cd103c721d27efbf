#!/bin/sh
# A sweep of a simulated rig beside 200 event streams of four addresses that are logged in, over TLS: the capture is complete, no
# frame is lost, every stream lasts and is told of every shot. For script/bench, with LUMI_STREAMS_FIRST, another one with
# nobody there: before ("no") or after ("yes").
# usage: idle_streams_test.sh LUMI LUMID HOLD_STREAMS
set -eu
lumi=$1 lumid=$2 hold=$3
here=$(cd "$(dirname "$0")" && pwd)
# shellcheck source=tests/scenario/rig_daemon.sh
. "$here/rig_daemon.sh"

spent() { # processor time of the daemon so far, in hundredths of a second
    awk '{ print $14 + $15 }' "/proc/$daemon/stat"
}
sweep() { # WHAT
    before=$(spent)
    begun=$(date +%s%N)
    start_capture
    end_capture
    awk -v what="$1" -v from="$before" -v to="$(spent)" -v begun="$begun" -v ended="$(date +%s%N)" 'BEGIN {
        printf "%s: %.1f s, of which lumid had a processor for %.2f s\n", what, (ended - begun) / 1e9, (to - from) / 100 }'
}
with_streams() {
    "$hold" https://127.0.0.1:8487 anna "a good password" 4 50 streams &
    streams=$!
    tries=0
    until [ -s streams ]; do
        tries=$((tries + 1))
        [ $tries -lt 600 ] && kill -0 $streams || fail "the streams are not open"
        sleep 0.1
    done
    sweep "200 event streams"
    kill -TERM $streams
    wait $streams || fail "streams ended: $(cat streams)"
    cat streams
    grep -q "200 of 200 open, 12 shots at least" streams || fail "not every stream was told of every shot"
}
if [ "${4:-}" = operate ]; then
    printf '\n[judge]\njudging = no\n' >>"$LUMI_SIM_RIG/lumid.conf"
    start_daemon 8486
    echo "a good password" >password
    "$lumi" user add anna --users "$LUMI_SIM_RIG/access/users" --password-file password >/dev/null || fail "no user"
    LUMID_TOKEN=$(cat "$LUMI_SIM_RIG/access/local.token")
    export LUMID_TOKEN
    tries=0
    until grep -q "others are answered on port 8487" "$LUMI_SIM_RIG/lumid.log"; do
        tries=$((tries + 1))
        [ $tries -lt 200 ] || fail "others are not answered"
        sleep 0.1
    done
    # What is swept second begins where the first ended, and goes the other way: its time is another.
    [ "${LUMI_STREAMS_FIRST:-}" != no ] || sweep "nobody there"
    with_streams
    [ "${LUMI_STREAMS_FIRST:-}" != yes ] || sweep "nobody there"
    exit 0
fi

need_network
rm -rf idle_streams_test.tmp
mkdir idle_streams_test.tmp
cd idle_streams_test.tmp
"$lumi" sim rig object --rig arc:2x6:0.2 --size 48x48 --white 0.008 -o rig --port 8486 --own-network -- \
    sh "$here/idle_streams_test.sh" "$lumi" "$lumid" "$hold" operate || fail "the rig ended badly"
count=0
for capture in rig/captures/*.capture; do
    "$lumi" verify "$capture" >/dev/null || fail "the capture is not whole"
    "$lumi" info "$capture" >info.txt
    grep -q " 24 received" info.txt || fail "not all is there: $(cat info.txt)"
    count=$((count + 1))
done
sweeps=1
[ -z "${LUMI_STREAMS_FIRST:-}" ] || sweeps=2
[ $count -eq $sweeps ] || fail "$count captures"
if grep -q " lost [1-9]" rig/lumid.log; then
    fail "frames were lost: $(grep ' lost ' rig/lumid.log)"
fi
