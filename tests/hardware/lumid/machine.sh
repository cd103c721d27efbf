# shellcheck shell=sh
# In the virtual machine: drivers and devices for lumid, and how to talk with it.
bin=$LUMI_BUILD
here=/src/tests/hardware/lumid
lumi() { "$bin/cli/lumi" "$@"; }

modprobe irq_sim 2>/dev/null || true
modprobe gpio-sim
gpio=/sys/kernel/config/gpio-sim/rig
mkdir -p $gpio/bank0/line0 $gpio/bank0/line1
echo 8 >$gpio/bank0/num_lines
echo rig >$gpio/bank0/label
echo ESTOP >$gpio/bank0/line0/name
echo LAMP >$gpio/bank0/line1/name
echo 1 >$gpio/live
lines=/sys/devices/platform/$(cat $gpio/dev_name)/$(cat $gpio/bank0/chip_name)
modprobe vivid n_devs=1 node_types=0x1 no_error_inj=0
modprobe xhci-pci
modprobe uvcvideo
for _ in $(seq 300); do
    # shellcheck disable=SC2012
    [ "$(ls /dev/video* 2>/dev/null | wc -l)" -ge 2 ] && grep -qs 1209 /sys/bus/usb/devices/*/idVendor && break
    sleep 0.1
done
mkdir -p /disk

start_lumid() {
    "$bin/daemon/lumid/lumid" --config "$here/lumid.conf" >>/out/lumid.log 2>&1 &
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

# The value of one member of what lumid says it is doing, by our own program's JSON.
status_of() {
    lumi capture status --json | tr ',{' '\n\n' | sed -n "s/^ *\"$1\" *: *\"\{0,1\}\([^\"}]*\).*/\1/p" | head -1
}

# Until lumid's state is one of these; at most so many seconds.
wait_state() {
    seconds=$1
    shift
    for _ in $(seq $((seconds * 4))); do
        state=$(status_of state)
        for wanted; do
            [ "$state" != "$wanted" ] || return 0
        done
        sleep 0.25
    done
    echo "state is '$state', not '$*':"
    lumi capture status
    tail -5 /out/lumid.log
    return 1
}
