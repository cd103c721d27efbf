# Sourced by the tests that run lumid on `lumi sim rig`: $lumi and $lumid are the programs.

fail() {
    echo "$*"
    [ ! -f rig/lumid.log ] || tail -40 rig/lumid.log
    exit 1
}

# Skips where no network of one's own can be had.
need_network() {
    network=$(unshare -rn true 2>&1) || network=$(unshare -n true 2>&1) || {
        echo "no network namespace here ($network): skipped"
        exit 77
    }
}

launch_daemon() {
    "$lumid" --config "$LUMI_SIM_RIG/lumid.conf" >>"$LUMI_SIM_RIG/lumid.log" 2>&1 &
    daemon=$!
}
await_daemon() {
    tries=0
    until "$lumi" capture status >status.txt 2>&1; do
        tries=$((tries + 1))
        [ $tries -lt 300 ] || fail "the daemon does not answer"
        kill -0 $daemon || fail "the daemon has ended"
        sleep 0.2
    done
}
# Of so small pictures nothing is to be judged.
judge_nothing() {
    printf '\n[judge]\nblur_pixels = 1000\nexposure_stops = 20\nsharpness_share = 0\n' >>"$LUMI_SIM_RIG/lumid.conf"
}
# Within the rig's network: the daemon, until this shell ends.
start_daemon() { # PORT
    export LUMID_ADDRESS=http://localhost:$1
    : >"$LUMI_SIM_RIG/lumid.log"
    launch_daemon
    trap 'kill $daemon 2>/dev/null; wait $daemon || true' EXIT
    trap 'exit 1' INT TERM
    await_daemon
}

# Starts the plan and watches it from then on, in watch.txt. On a busy computer a frame of a test may be lost: once more.
start_capture() {
    "$lumi" capture start "$LUMI_SIM_RIG/plan.txt" || "$lumi" capture start "$LUMI_SIM_RIG/plan.txt" || fail "start"
    "$lumi" capture watch >watch.txt 2>&1 &
    watch=$!
}
wait_for() { # PART of a line of watch.txt
    tries=0
    until grep -q "$1" watch.txt; do
        tries=$((tries + 1))
        [ $tries -lt 600 ] || fail "not within two minutes: $1"
        sleep 0.2
    done
}
end_capture() {
    wait $watch || fail "$(tail -5 watch.txt)"
}
