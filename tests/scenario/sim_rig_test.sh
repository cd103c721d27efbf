#!/bin/sh
# A simulated rig as processes, the daemon on it with its judge as it is by default but for smears, a small continuous capture with
# motion blur and noise. The result is held against the same views taken at true poses, without blur and noise, and with
# both: it may lack of the first what the second lacks.
# usage: sim_rig_test.sh LUMI LUMID
set -eu
lumi=$1 lumid=$2
here=$(cd "$(dirname "$0")" && pwd)
# shellcheck source=tests/scenario/rig_daemon.sh
. "$here/rig_daemon.sh"

if [ "${3:-}" = operate ]; then
    # A sweep that smears on purpose: all else is judged as by default.
    printf '\n[judge]\nblur_pixels = 8\n' >>"$LUMI_SIM_RIG/lumid.conf"
    start_daemon 8479
    start_capture
    end_capture
    exit 0
fi

need_network
rm -rf sim_rig_test.tmp
mkdir sim_rig_test.tmp
cd sim_rig_test.tmp
views="--rig arc:5x10:0.18 --size 96x77"
noise="--full-well 10000 --read-noise 4"
# One camera loses packets, one sends frames twice: the capture is complete all the same.
cat >faults.txt <<END
at shot 3 camera 0 packets lost 0.05
at shot 4 camera 1 frames doubled for 3s
END
# Where drawing is fast 18 degrees a second, so that the platform turns 0.9 degrees in an exposure.
# shellcheck disable=SC2086
"$lumi" sim rig room $views $noise -o rig --seed 4 --continuous --exposure 0.05 --white 0.05 \
    --bits 12 --patience 60 --port 8479 --faults faults.txt --own-network -- \
    sh "$here/sim_rig_test.sh" "$lumi" "$lumid" operate || fail "the rig ended badly"
capture=$(echo rig/captures/*.capture)
"$lumi" verify "$capture" || fail "the capture is not whole"
"$lumi" info "$capture" >info.txt
grep -q " 50 accepted" info.txt || fail "not all is there: $(cat info.txt)"
turned=$(awk -F= '/^turn_time_s/ { print 360 / $2 * 0.05 }' rig/plan.txt)
# shellcheck disable=SC2086
"$lumi" sim shoot room $views --format dng -o clean.capture
# shellcheck disable=SC2086
"$lumi" sim shoot room $views --format dng $noise --bits 12 --turned "$turned" -o blurred.capture
# shellcheck disable=SC2086
"$lumi" sim truth room $views --random 4 --seed 5 --fov 60 --size 64x48 --no-depth -o truth
ln -s "$capture" rig.capture
# At the poses that are given: what rig and daemon make of them is asked, not what calibration would.
for name in rig clean blurred; do
    "$lumi" process $name.capture -o $name.lumi --calibrate no --synthesize no --subsample no --prefilter 0 >/dev/null || fail "$name: processing"
    "$lumi" eval $name.lumi --truth truth/transforms.json --json >$name.json || fail "$name: eval"
done
psnr() { # of all views
    awk -F: '/"mean"/ { on = 1 } on && /"psnr_rgb"/ { print $2 + 0; exit }' "$1"
}
awk -v rig="$(psnr rig.json)" -v clean="$(psnr clean.json)" -v blurred="$(psnr blurred.json)" 'BEGIN {
    printf "true poses %.2f dB, with blur and noise %.2f dB, rig %.2f dB\n", clean, blurred, rig
    exit !(rig > 0 && blurred > 0 && clean > 0 && rig > blurred - 0.3)
}' || fail "the capture's pictures are further from the truth than blur and noise make them"
