# shellcheck shell=sh
# The board, the USB camera, a disk, and somebody who pulls the machine's plug.
. "$here/vm_lumid.host.sh"
. "$here/vm_power.host.sh"
most=15000
