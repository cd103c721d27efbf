#!/bin/sh
# poles_test.sh LUMI COMPARE_VIEWS: a rig on its tripod, whose head is wider than the circle of the lowest cameras and too
# near to them to be matched; the rows thinned towards the poles, the poles themselves and what is masked made from the
# other pictures, against what a camera would see there.
lumi=$1 compare=$2
here=$(cd "$(dirname "$0")" && pwd)
# shellcheck source=tests/scenario/expect.sh
. "$here/expect.sh"
cd "$scratch" || exit 1
stage() { "$lumi" stage "$@" >log 2>&1 || fail "stage $*: $(cat log)"; }
flagged() { awk -v flag="$2" '$1 == "view" && $4 ~ flag { n++ } END { print n + 0 }' "$1/subsample/all.places"; }

"$lumi" sim shoot room --rig sphere:6x14:0.3 --size 72x60 --fov 110 --lens fisheye --tripod -o rig >/dev/null || fail "no capture"

# Nothing of it is done unless it is asked for.
[ "$("$lumi" stage subsample rig | wc -l)" -le 1 ] && [ ! -e rig.work/subsample/all.places ] || fail "it was not asked for"
# Three times as dense as at the equator, so that the holes at the poles are ones. One picture has a mask drawn by hand.
mkdir masks
# 72 × 60 pixels, white, a black square of ten in its middle
base64 -d >masks/r02c03.png <<'PNG' || fail "no mask"
iVBORw0KGgoAAAANSUhEUgAAAEgAAAA8AQAAAADtJcE9AAAAGUlEQVQoz2P4DwMMQ571h4H2rIH35dBgAQC2Kg/vqc2eegAAAABJRU5ErkJggg==
PNG
wanted="--subsample yes --synthesize yes --density 3 --masks masks"
for stage in subsample equiangular match depth synthesize; do
    stage $stage rig $wanted
done
[ "$(flagged rig.work s)" -eq 2 ] || fail "no views for the poles"
kept=$(flagged rig.work k)
[ "$kept" -lt 84 ] && [ "$kept" -gt 50 ] || fail "of 84 pictures and the poles $kept are kept"
[ "$(flagged rig.work m)" -gt 10 ] || fail "hardly any picture shows the stand"
awk '$1 == "view" && $4 ~ "s" && $4 !~ "uk" { exit 1 }' rig.work/subsample/all.places || fail "a pole that is not kept"

# The poles, as a camera would see them if the tripod were nothing but its shadow.
awk -v flags=s -f "$here/places_to_transforms.awk" rig.work/subsample/all.places >poles.json
"$lumi" sim truth room --poses poles.json --no-depth --tripod-shadow 0.3 -o truth >/dev/null || fail "no truth"
"$lumi" import truth/transforms.json -o truth.capture >/dev/null || fail "no capture of the truth"
stage equiangular truth.capture
number=0
for name in $(awk '$1 == "view" && $4 ~ "s" { print $2 }' rig.work/subsample/all.places); do
    said=$("$compare" rig.work/synthesize/$name.exr truth.capture.work/equiangular/v000$number.exr $name.png) || fail "$name"
    echo "$name $said"
    echo "$said" | awk '{ exit !($1 >= 32 && $4 < 1.5) }' || fail "$name: $said, 32 dB and less than 1.5 % off wanted"
    number=$((number + 1))
done

# What is masked is made from the others: different, but hardly so.
said=$("$compare" rig.work/synthesize/r02c03.exr rig.work/equiangular/r02c03.exr mask.png) || fail "no masked picture"
echo "r02c03 $said"
echo "$said" | awk '{ exit !($1 >= 35 && $1 < 60) }' || fail "what the mask hides is $said from what is behind it"

# Threads and ranges change nothing.
cp -r rig.work again.work
rm -r again.work/synthesize
stage synthesize rig -w again.work $wanted -j 1 --range 0:3
for file in again.work/synthesize/*.exr; do
    cmp -s "$file" "rig.work/synthesize/$(basename "$file")" || fail "$(basename "$file") differs with one thread"
done

# Without: every picture a view, and none that nobody took; half of the density: about half the views.
stage subsample rig -w no.work --subsample no --synthesize yes
[ "$(flagged no.work k)" -eq 84 ] || fail "--subsample no drops views"
stage subsample rig -w no.work --subsample yes --synthesize no --density 0.4
[ "$(flagged no.work '[sm]')" -eq 0 ] || fail "--synthesize no adds views"
[ "$(flagged no.work k)" -lt $((2 * kept / 3)) ] || fail "--density 0.4"
stage subsample rig -w no.work --subsample yes --synthesize yes --stand 0
[ "$(flagged no.work m)" -eq 0 ] || fail "--stand 0 masks views"
expect 2 "--stand" "$lumi" stage subsample rig --stand -1
expect 2 "--density" "$lumi" stage subsample rig --density 0
expect 2 "--subsample" "$lumi" stage subsample rig --subsample perhaps
