#!/bin/sh
# The Debian package, made in Debian 13, under systemd as the first process: installed it runs, though no driver of a camera
# is loaded yet; as its own user, behind all that the unit forbids, it gets at the board (USB), a USB camera (libcamera),
# vivid (V4L2) and gpio-sim, and takes a capture; killed it comes back; stopped and removed it is gone.
set -eu
here=/src/tests/hardware/lumid
lumi() { /usr/bin/lumi "$@"; }
tell_log() { journalctl -u lumid --no-pager -o cat -n "${1:-1000}"; }
bad() {
    echo "$1"
    systemctl status lumid --no-pager -n 0 || true
    tell_log 20
    exit 1
}
active() { [ "$(systemctl is-active lumid)" = active ]; }
. $here/devices.sh
. $here/talk.sh

[ "$(cat /proc/1/comm)" = systemd ] || bad "systemd is not the first process"
dpkg -i "$LUMI_BUILD"/package/lumisphere_*.deb
active || bad "installed, and not running"
systemctl is-enabled lumid
[ "$(systemctl show -P Type lumid)" = notify ] && [ -n "$(systemctl show -P StatusText lumid)" ] || bad "it has not said that it is ready"
lumi capture status
[ "$(stat -c %U /proc/"$(systemctl show -P MainPID lumid)")" = lumid ] || bad "not its own user"

# The drivers come after lumid, as with a camera that is plugged in later.
if [ -e /dev/video0 ]; then bad "there was a camera before"; fi
load_gpio
load_cameras
systemctl stop lumid
lumi rig profile set $here/profile.txt
sed 's,^folder =.*,folder = /var/lib/lumisphere/captures,' $here/lumid.conf >/etc/lumisphere/lumid.conf
echo 0 >/sys/bus/platform/drivers/vivid/unbind 2>/dev/null || echo vivid.0 >/sys/bus/platform/drivers/vivid/unbind
systemctl start lumid || bad "it does not start"
echo vivid.0 >/sys/bus/platform/drivers/vivid/bind
for words in 'camera c00 is there' 'camera c01 is there' 'the board is there'; do
    wait_until 60 "$words" logged 1 "$words"
done
sed 's/^positions =.*/positions = 6/' $here/plan.txt >/run/plan.txt
lumi capture start /run/plan.txt --name place || bad "no capture"
wait_until 120 "the first frames" at_least stored 2

echo "lumid is killed after $(status_of stored) frames"
systemctl kill --signal=KILL lumid
wait_until 60 "lumid again" logged 3 'ready, port'
wait_state 300 done
[ "$(status_of complete)" = true ] || bad "it is not complete"
lumi verify /var/lib/lumisphere/captures/place
echo "emergency stop"
echo pull-up >"$lines/sim_gpio0/pull"
wait_until 30 "the emergency stop" logged 1 '^emergency stop'

systemctl restart lumid || bad "it does not start again"
[ "$(systemctl show -P Result lumid)" = success ] || bad "restarted: $(systemctl show -P Result lumid)"
systemctl stop lumid
[ "$(systemctl show -P Result lumid)" = success ] || bad "stopped: $(systemctl show -P Result lumid)"
echo nonsense >>/etc/lumisphere/lumid.conf
! systemctl start lumid 2>/dev/null || bad "started with nonsense in its configuration"
[ "$(systemctl show -P ExecMainStatus lumid)" = 3 ] || bad "nonsense: $(systemctl show -P ExecMainStatus lumid)"
sed -i '$d' /etc/lumisphere/lumid.conf
systemctl reset-failed lumid
systemctl start lumid || bad "the configuration is mended, and it does not start"

dpkg -r lumisphere
[ -z "$(pidof lumid)" ] && ! systemctl cat lumid >/dev/null 2>&1 || bad "removed, and still there"
[ -e /var/lib/lumisphere/captures/place ] || bad "a capture is gone"
dpkg -P lumisphere
