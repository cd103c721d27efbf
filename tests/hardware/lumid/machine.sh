# shellcheck shell=sh
# In the virtual machine: drivers and devices for lumid, and how to talk with it.
bin=$LUMI_BUILD
here=/src/tests/hardware/lumid
lumi() { "$bin/cli/lumi" "$@"; }
tell_log() { cat /out/lumid.log; }
. $here/devices.sh
. $here/talk.sh

load_gpio
# shellcheck disable=SC2086
load_cameras ${vivid:-}
mkdir -p /disk

start_lumid() {
    "$bin/daemon/lumid/lumid" --config "${configuration:-$here/lumid.conf}" >>/out/lumid.log 2>&1 &
    lumid=$!
    for _ in $(seq 300); do
        lumi capture status >/dev/null 2>&1 && return 0
        kill -0 $lumid 2>/dev/null || break
        sleep 0.1
    done
    echo "lumid did not start:"
    tail -5 /out/lumid.log
    return 1
}
