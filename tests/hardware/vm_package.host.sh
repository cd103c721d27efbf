# shellcheck shell=sh
# The board and the USB camera.
. "$here/vm_lumid.host.sh"
