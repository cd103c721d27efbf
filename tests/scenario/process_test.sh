#!/bin/sh
# process_test.sh LUMI: from a simulated place to pictures, as a person does it, with everything that may come between:
# runs that are killed, other numbers of threads, stages piece by piece, sizes asked for.
lumi=$1
# shellcheck source=tests/scenario/expect.sh
. "$(dirname "$0")/expect.sh"
cd "$scratch" || exit 1
same() { cmp -s "$1" "$2" || fail "$1 and $2 differ: $3"; }
size() { wc -c <"$1" | tr -d ' '; }
be32() { od -An -tu1 -j"$2" -N4 "$1" | awk '{ print (($1 * 256 + $2) * 256 + $3) * 256 + $4 }'; }
png_size() { echo "$(be32 "$1" 16)x$(be32 "$1" 20)"; }
at_least() { # VALUE LEAST WHAT
    awk "BEGIN { exit !($1 >= $2) }" || fail "$3: $1, at least $2 wanted"
}
number() { sed -n "s/.*\"$1\" *: *\([-0-9.e]*\).*/\1/p" "$2" | head -1; }

# 4 by 4 cameras, pictures that no tile divides, four clusters.
"$lumi" sim shoot room --rig planar:4x4:0.03 --size 150x100 --fov 60 -o a -j 2 >/dev/null || fail "no capture"
"$lumi" sim truth room --from a --random 2 --size 150x100 --fov 40 --no-depth -o truth -j 2 >/dev/null || fail "no truth"
options="--cluster 4"

# The same bytes with one thread, with four, and stage by stage in pieces.
"$lumi" process a -o one.lumi $options -j 1 >/dev/null || fail "process"
"$lumi" process a -o four.lumi -w four $options -j 4 >/dev/null || fail "process with four threads"
same one.lumi four.lumi "threads"
for stage in equiangular match depth geometry geometry-coarse; do
    expect 0 "$stage: 11 made, 0 there" "$lumi" stage $stage a -w pieces --range 5:16 $options
    [ $stage != equiangular ] || expect 3 "which has not been run" "$lumi" stage match a -w pieces --range 0:5 $options
    expect 0 "$stage: 5 made, 0 there" "$lumi" stage $stage a -w pieces --range 0:5 $options
done
expect 2 "the stage 'depth' has images 0 to 16" "$lumi" stage depth a -w pieces --range 3:17 $options
"$lumi" stage compress a -w pieces $options >/dev/null || fail "stage compress"
same one.lumi pieces/compress/all.lumi "pieces"

# Nothing is made twice; one parameter changes only what rests on it; going back finds the same bytes.
expect 0 "compress               0 made     1 there" "$lumi" process a -o again.lumi $options
same one.lumi again.lumi "skipping"
expect 0 "depth                  0 made    16 there" "$lumi" process a -o gp.lumi $options --gp 1
[ "$(size gp.lumi)" -lt "$(size one.lumi)" ] || fail "a fifth of the triangles needs no less"
"$lumi" process a -o again.lumi $options >/dev/null
same one.lumi again.lumi "going back to a parameter"

# Killed at any moment, nothing half-made is taken for whole.
kills=0
for wait in 0.05 0.1 0.2 0.3 0.4 0.6 0.8 1 1.3; do
    "$lumi" process a -o killed.lumi -w killed $options -j 2 >/dev/null 2>&1 &
    pid=$!
    sleep $wait
    if kill -9 $pid 2>/dev/null; then kills=$((kills + 1)); fi
    wait $pid 2>/dev/null
    [ ! -e killed.lumi ] || same one.lumi killed.lumi "a killed run's field"
done
[ $kills -gt 0 ] || fail "no run was killed"
"$lumi" process a -o killed.lumi -w killed $options >/dev/null || fail "process after kills"
same one.lumi killed.lumi "killed and resumed"
[ -z "$(find killed -name '*.tmp-*')" ] || fail "left behind: $(find killed -name '*.tmp-*')"

# What a run left beside the output that was killed in the last copy goes with the next one.
dead=$(sh -c 'echo $$')
touch "killed.lumi.tmp-$dead-0" "killed.lumi.tmp-$$-0" "killed.lumi.tmp-x"
"$lumi" process a -o killed.lumi -w killed $options >/dev/null || fail "process beside leftovers"
[ ! -e "killed.lumi.tmp-$dead-0" ] || fail "what a dead process left is still there"
[ -e "killed.lumi.tmp-$$-0" ] && [ -e killed.lumi.tmp-x ] || fail "more went than what dead processes left"

# What was half-written and what was cut off is made again.
depth=$(find a.work/depth -name '*.exr' | sort | head -1)
head -c 100 "$depth" >cut && mv cut "$depth"
expect 0 "depth                  1 made    15 there" "$lumi" process a -o again.lumi $options
same one.lumi again.lumi "a cut file"

# Quality is a scale from end to end, and a size that is asked for is met from below.
last=0
for quality in 0 15 40 100; do
    "$lumi" process a -o q.lumi $options --quality $quality >/dev/null || fail "quality $quality"
    [ "$(size q.lumi)" -gt $last ] || fail "quality $quality makes no larger file"
    last=$(size q.lumi)
done
target=$(($(size one.lumi) * 3 / 4))
"$lumi" process a -o t.lumi $options --target-bytes $target >/dev/null || fail "--target-bytes"
[ "$(size t.lumi)" -le $target ] || fail "--target-bytes $target gives $(size t.lumi)"
at_least "$(size t.lumi)" $((target * 9 / 10)) "--target-bytes $target"
codings=$(find a.work/compress -name 'size-*.txt' | wc -l)
[ "$codings" -le 4 ] || fail "--target-bytes coded the whole $codings times"
cp t.lumi t1.lumi
rm a.work/compress/all.*
before=$(ls -i a.work/compress/size-*.txt)
"$lumi" process a -o t.lumi $options --target-bytes $target >/dev/null || fail "--target-bytes again"
same t1.lumi t.lumi "a search that goes on"
[ "$before" = "$(ls -i a.work/compress/size-*.txt)" ] || fail "sizes that were known were searched for again"
expect 3 "the smallest field of this capture has" "$lumi" process a -o none.lumi $options --target-bytes 2000
[ ! -e none.lumi ] || fail "a field larger than asked for was left"
expect 2 "there is no folder 'none'" "$lumi" process a -o none/x.lumi -w none.work
expect 2 "is a folder" "$lumi" process a -o truth -w none.work
[ ! -e none.work/depth ] || fail "worked for a file that cannot be written"

# Files that are named for the last stages are looked at before the first one.
printf 'LUT_3D_SIZE 2\n0 0 0\n' >short.cube
for option in "--lut short.cube" "--lut none.cube" "--icc short.cube" "--response none.txt"; do
    # shellcheck disable=SC2086 # an option and its value
    expect 3 "${option#* }: " "$lumi" process a -o none.lumi -w unused $options $option
done
[ ! -e unused ] || fail "a run with a table that is none has begun"

# Pictures: near to the truth, and of the kind asked for.
"$lumi" eval one.lumi --truth truth/transforms.json --json --sheet sheet.png --difference difference >eval.json ||
    fail "eval"
sed -n '/"mean"/,$p' eval.json >mean.json
mean=$(number psnr_rgb mean.json)
at_least "${mean:-0}" 32 "mean PSNR against the truth"
[ "$(png_size sheet.png)" = "928x108" ] || fail "the sheet of two views is $(png_size sheet.png)"
[ "$(find difference -name '*.png' | wc -l)" -eq 2 ] || fail "not a difference picture a view"
"$lumi" eval one.lumi --codec a --json >codec.json || fail "eval --codec"
at_least "$(number psnr_yuv_mean codec.json)" 40 "what compression left"
[ "$(number file_bytes codec.json)" = "$(size one.lumi)" ] || fail "eval --codec counts other bytes"
"$lumi" render one.lumi -o pictures --poses truth/transforms.json >/dev/null || fail "render"
"$lumi" render gp.lumi -o gp --poses truth/transforms.json -j 1 >/dev/null || fail "render with gp 1"
"$lumi" render one.lumi -o pictures1 --poses truth/transforms.json -j 1 >/dev/null || fail "render with one thread"
same pictures/v0000.png pictures1/v0000.png "threads of the renderer"
mkdir -p poses && cp truth/transforms.json poses/ # poses alone, no pictures beside them
"$lumi" render one.lumi -o pictures2 --poses poses/transforms.json >/dev/null || fail "render without the truth's pictures"
same pictures/v0000.png pictures2/v0000.png "pictures that need not be there"
expect 3 "the image is missing" "$lumi" eval one.lumi --truth poses/transforms.json
cmp -s pictures/v0000.png gp/v0000.png && fail "geometry makes no difference"
"$lumi" render one.lumi -o stereo.png --stereo -p 0,0,0,90,0 -s 64x48 --fov 30 >/dev/null || fail "stereo"
[ "$(png_size stereo.png)" = 128x48 ] || fail "the stereo pair is $(png_size stereo.png)"
"$lumi" render one.lumi -o film.webm --path orbit --count 4 -s 64x48 >/dev/null || fail "film"
[ "$(od -An -tx1 -N4 film.webm | tr -d ' ')" = 1a45dfa3 ] || fail "the film is no WebM"
expect 0 "1 picture, 0.000 % uncovered" "$lumi" render one.lumi -o c.png --level coarse -p 0,0,0,90,0 -s 96x64 --fov 30
expect 0 "1 picture, 100.000 % uncovered" "$lumi" render one.lumi -o back.png -p 0,0,0,-90,0 -s 96x64 --fov 30

# Captures with next to nothing in them.
for rig in planar:1x1:0.1 planar:1x2:0.1; do
    "$lumi" sim shoot room --rig $rig --size 100x70 --fov 60 -o few >/dev/null || fail "$rig: no capture"
    "$lumi" process few -o few.lumi >/dev/null || fail "$rig: process"
    expect 0 "1 picture, 0.000 % uncovered" "$lumi" render few.lumi -o few.png -p 0,0,0,90,0 -s 96x64 --fov 30
    rm -r few few.work
done
echo "process_test: passed"
