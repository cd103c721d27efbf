# shellcheck shell=sh
# A disk of the machine's own, and somebody who pulls its plug: LUMI_POWER_CUTS times, at moments that LUMI_SEED names. What the
# kernel in there had not yet given to its disk is lost.
# shellcheck disable=SC2154
wanted=${LUMI_POWER_CUTS:-20} seed=${LUMI_SEED:-1} cuts=0 killer=
truncate -s 256M "$work/disk"
mke2fs -q -t ext4 "$work/disk" 2>/dev/null || /sbin/mke2fs -q -t ext4 "$work/disk"
: >"$work/acknowledged"
qemu="$qemu -drive file=$work/disk,format=raw,if=virtio,cache=writeback"
power_asked() {
    [ "$1" = storing ] && [ $cuts -lt "$wanted" ] && [ "$2" -gt 8 ] || return 0
    cuts=$((cuts + 1))
    seed=$(((seed * 1103515245 + 12345) % 2147483648))
    after=$(((seed / 65536) % ${most:-1200}))
    echo "power cut $cuts, $after ms after it began"
    (sleep "$((after / 1000)).$(printf %03d $((after % 1000)))"; kill -9 "$machine") &
    killer=$!
}
host_asked() {
    power_asked "$@"
}
host_again() {
    [ -z "$killer" ] || wait $killer 2>/dev/null || true
    killer=
    if [ -z "$1" ]; then
        return 0
    fi
    [ "$cuts" -ge "$wanted" ] || {
        echo "only $cuts of $wanted power cuts came before it was done"
        status=1
    }
    [ -s "$work/acknowledged" ] || {
        echo "$cuts power cuts"
        return 1
    }
    echo "$cuts power cuts, $(grep -c stored "$work/acknowledged") frames were said to be stored, each once: $(grep stored "$work/acknowledged" | sort | uniq -d | wc -l) twice"
    return 1
}
