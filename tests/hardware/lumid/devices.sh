# shellcheck shell=sh
# In the virtual machine: drivers for lumid's devices. GPIO lines that nobody drives, one of them the emergency stop; a
# camera of the kernel's own; the USB, on which the board and a camera are.
load_gpio() {
    modprobe irq_sim 2>/dev/null || true
    modprobe gpio-sim
    gpio=/sys/kernel/config/gpio-sim/rig
    mkdir -p $gpio/bank0
    echo 8 >$gpio/bank0/num_lines
    echo rig >$gpio/bank0/label
    number=0
    for name in ESTOP LAMP EXPSYNC; do
        mkdir $gpio/bank0/line$number
        echo $name >$gpio/bank0/line$number/name
        number=$((number + 1))
    done
    live_gpio
}

# The chip comes, or comes back, at a place of its own; echo 0 there takes it away.
live_gpio() {
    echo 1 >$gpio/live
    # shellcheck disable=SC2034
    lines=/sys/devices/platform/$(cat $gpio/dev_name)/$(cat $gpio/bank0/chip_name)
}

load_cameras() { # [vivid's words...]
    modprobe vivid n_devs=1 node_types=0x1 no_error_inj=0 "$@"
    modprobe xhci-pci
    modprobe uvcvideo
    for _ in $(seq 600); do
        # shellcheck disable=SC2012
        [ "$(ls /dev/video* 2>/dev/null | wc -l)" -ge 2 ] && grep -qs 1209 /sys/bus/usb/devices/*/idVendor && return 0
        sleep 0.1
    done
    echo "vivid, the USB camera, or the board has not come"
    return 1
}
