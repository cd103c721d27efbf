#!/bin/sh
# A simulated rig as processes, the daemon on it, a small capture, processed; held against the same views taken at true
# poses without blur and noise.
# usage: sim_rig_test.sh LUMI LUMID
set -eu
lumi=$1 lumid=$2
here=$(cd "$(dirname "$0")" && pwd)
# shellcheck source=tests/scenario/rig_daemon.sh
. "$here/rig_daemon.sh"

# Called inside the rig's network.
if [ "${3:-}" = operate ]; then
    start_daemon 8479
    start_capture
    end_capture
    exit 0
fi

need_network
rm -rf sim_rig_test.tmp
mkdir sim_rig_test.tmp
cd sim_rig_test.tmp
views="--rig arc:13x34:0.18 --scale 0.25 --size 96x77"
# One camera loses packets, one sends frames twice: the capture is complete all the same.
printf 'at shot 3 camera 0 packets lost 0.05\nat shot 4 camera 1 frames doubled for 3s\n' >faults.txt
# shellcheck disable=SC2086
"$lumi" sim rig room $views -o rig --seed 4 --position-time 4 --full-well 10000 --read-noise 4 --bits 12 \
    --patience 60 --port 8479 --faults faults.txt --own-network -- sh "$here/sim_rig_test.sh" "$lumi" "$lumid" operate ||
    fail "the rig ended badly"
capture=$(echo rig/captures/*.capture)
"$lumi" verify "$capture" || fail "the capture is not whole"
"$lumi" info "$capture" >info.txt
# shellcheck disable=SC2086
"$lumi" sim shoot room $views -o true.capture
# shellcheck disable=SC2086
"$lumi" sim truth room $views --random 4 --seed 5 --fov 60 --size 64x48 --no-depth -o truth
for name in rig true; do
    [ $name = rig ] && from=$capture || from=true.capture
    "$lumi" process "$from" -o $name.lumi >/dev/null || fail "$name: processing"
    "$lumi" eval $name.lumi --truth truth/transforms.json --json >$name.json || fail "$name: eval"
done
psnr() { # of all views
    awk -F: '/"mean"/ { on = 1 } on && /"psnr_rgb"/ { print $2 + 0; exit }' "$1"
}
awk -v rig="$(psnr rig.json)" -v true="$(psnr true.json)" 'BEGIN {
    printf "rig %.2f dB, true poses %.2f dB\n", rig, true
    exit !(rig > 0 && true > 0 && rig > true - 2)
}' || fail "the capture's pictures are further from the truth than blur and noise make them"
