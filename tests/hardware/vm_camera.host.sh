# shellcheck shell=sh
# The USB camera (LUMI_UVC_DEVICE) on the machine's USB, by the usbredir protocol.
# shellcheck disable=SC2154
[ -x "${LUMI_UVC_DEVICE:-}" ] || { echo "skipped: libusbredirparser is missing"; exit 77; }
"$LUMI_UVC_DEVICE" "$work/camera" LUMI-UVC-1 20 >"$work/uvc" 2>&1 &
uvc=$!
helpers="$helpers $uvc"
qemu="$qemu -device qemu-xhci -chardev socket,id=camera,path=$work/camera,server=on,wait=off -device usb-redir,chardev=camera"
host_asked() {
    case $1 in
    unplug) kill -USR1 $uvc ;;
    break) kill -USR2 $uvc ;;
    esac
}
