# shellcheck shell=sh
# The emulated board (LUMI_BOARD_REDIR with the flashed bytes LUMI_IMAGE) on the machine's USB, by the usbredir protocol.
# shellcheck disable=SC2154
[ -r "${LUMI_IMAGE:-}" ] || { echo "skipped: no image of the firmware: the cross compiler or nanopb's source is missing"; exit 77; }
"$LUMI_BOARD_REDIR" "$LUMI_IMAGE" "$work/socket" >"$work/redir" 2>&1 &
redir=$!
helpers="$helpers $redir"
while ! grep -q waiting "$work/redir"; do
    kill -0 $redir 2>/dev/null || { cat "$work/redir"; exit 1; }
    sleep 0.1
done
qemu="$qemu -device qemu-xhci -chardev socket,id=board,path=$work/socket -device usb-redir,chardev=board"
host_asked() {
    [ "$1" != unplug ] || kill -USR1 $redir
}
