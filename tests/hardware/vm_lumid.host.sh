# shellcheck shell=sh
# The emulated board and the USB camera at the machine's USB.
# shellcheck disable=SC2154
[ -r "${LUMI_IMAGE:-}" ] || { echo "skipped: no image of the firmware: the cross compiler or nanopb's source is missing"; exit 77; }
[ -x "${LUMI_UVC_DEVICE:-}" ] || { echo "skipped: libusbredirparser is missing"; exit 77; }
: >"$work/redir"
# It takes a whole core where it gets one, and is content with less.
nice -n 12 "$LUMI_BOARD_REDIR" "$LUMI_IMAGE" "$work/board" >"$work/redir" 2>&1 &
redir=$!
"$LUMI_UVC_DEVICE" "$work/camera" LUMI-UVC-1 20 >"$work/uvc" 2>&1 &
uvc=$!
helpers="$helpers $redir $uvc"
while ! grep -q waiting "$work/redir"; do
    kill -0 $redir || { cat "$work/redir"; exit 1; }
    sleep 0.1
done
qemu="$qemu -device qemu-xhci -chardev socket,id=board,path=$work/board -device usb-redir,chardev=board"
qemu="$qemu -chardev socket,id=camera,path=$work/camera,server=on,wait=off -device usb-redir,chardev=camera"
host_asked() {
    case $1 in
    unplug-board) kill -USR1 $redir ;;
    unplug-camera) kill -USR1 $uvc ;;
    esac
}
