#!/bin/sh
# raw_process_test.sh LUMI MAKE_DNG: a capture of raw files becomes a light field that is as good as that of the same
# place in linear light, less what a Bayer sensor costs.
lumi=$1 make_dng=$2
# shellcheck source=tests/scenario/expect.sh
. "$(dirname "$0")/expect.sh"
cd "$scratch" || exit 1
psnr() { # FIELD
    "$lumi" eval "$1" --truth truth/transforms.json --json | grep -o '"psnr_rgb" *: *[-0-9.e]*' |
        awk -F: '{ sum += $2 } END { print sum / NR }'
}

"$lumi" sim shoot room --rig planar:3x3:0.03 --size 192x128 --fov 60 --format exr -o a -j 2 >/dev/null || fail "no capture"
"$lumi" sim truth room --from a --random 2 --size 150x100 --fov 40 --no-depth -o truth -j 2 >/dev/null || fail "no truth"
"$lumi" export a --transforms plain.json >/dev/null || fail "export"
mkdir raw
for picture in a/data/frames/*.exr; do
    "$make_dng" "$picture" "raw/$(basename "$picture" .exr).dng" 12 || fail "$picture"
done
sed 's|"[^"]*/\([^"/]*\)\.exr"|"raw/\1.dng"|' plain.json >transforms.json
expect 0 "" "$lumi" import transforms.json -o b
[ "$(find b/data/frames -name '*.dng' | wc -l)" -eq 9 ] || fail "no DNG files in the capture"
cmp -s "$(find raw -name '*.dng' | sort | head -1)" "$(find b/data/frames -name '*.dng' | sort | head -1)" ||
    fail "a raw file was not kept as it is"
"$lumi" process a -o a.lumi --cluster 3 -j 2 >/dev/null || fail "process"
expect 0 "" "$lumi" process b -o b.lumi --cluster 3 -j 2
linear=$(psnr a.lumi) raw=$(psnr b.lumi)
echo "linear light $linear dB, raw files $raw dB"
awk "BEGIN { exit !($raw > 20 && $raw > $linear - 3) }" || fail "raw files $raw dB, linear light $linear dB"

# A raw file that lost its end is found on import.
head -c 30000 "$(find raw -name '*.dng' | sort | head -1)" >cut.dng
cp cut.dng "$(find raw -name '*.dng' | sort | head -1)"
expect 3 "damaged raw file" "$lumi" import transforms.json -o c
