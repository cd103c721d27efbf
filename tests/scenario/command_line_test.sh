#!/bin/sh
# command_line_test.sh LUMI: wrong arguments, and what a person meets who runs out of room or mistypes a place: one line,
# the exit status that the manual promises, and nothing left behind.
lumi=$1
# shellcheck source=tests/scenario/expect.sh
. "$(dirname "$0")/expect.sh"
cd "$scratch" || exit 1

expect_line 2 "no command 'nosuch'" "$lumi" nosuch
expect_line 2 "'sim shoot', 'sim truth'" "$lumi" sim
expect_line 2 "'sim shoot', 'sim truth'" "$lumi" help sim
for command in export process render info verify "sim shoot" "sim truth"; do
    # shellcheck disable=SC2086
    expect_line 2 "usage: lumi $command" "$lumi" $command
    # shellcheck disable=SC2086
    expect_line 2 "--nosuch" "$lumi" $command --nosuch x
done

expect_line 2 "-o CAPTURE is needed" "$lumi" import
expect_line 2 "FILE is wanted" "$lumi" eval
expect_line 2 "--nosuch" "$lumi" eval --nosuch x
expect_line 2 "--nosuch" "$lumi" import --nosuch x

"$lumi" sim shoot room --rig planar:2x2:0.05 --size 64x64 -o "a ü.capture" || fail "no capture"
for command in "import x -o y" "sim shoot room -o y" "sim truth room -o y" "render x -p 0,0,0,0,0 -o y.png" \
    "eval x --truth y" "process x -o y" "stage depth x"; do
    # shellcheck disable=SC2086
    expect_line 2 "--threads -1" "$lumi" $command --threads -1
done
for number in nan inf -1; do
    expect_line 2 "--unit" "$lumi" import x -o y --unit=$number
done
expect_line 2 "random views: count" "$lumi" sim truth room -o y --random 0
expect_line 2 "random views: volume" "$lumi" sim truth room -o y --random 1 --stereo nan
for fov in nan -1 500; do
    expect_line 2 "field of view" "$lumi" sim shoot room -o y --rig planar:2x2:0.1 --fov $fov
done
for option in gp near far neighbours cluster disk-scale pixels-per-degree target-bytes; do
    expect_line 2 "--$option" "$lumi" process "a ü.capture" -o y --$option 0
done

# Where the field cannot go is said before anything is made.
mkdir folder
expect_line 2 "folder: is a folder" "$lumi" process "a ü.capture" -o folder
expect_line 2 "nowhere/y.lumi: there is no folder" "$lumi" process "a ü.capture" -o nowhere/y.lumi
[ ! -e "a ü.capture.work" ] || fail "stages ran for an output that cannot be made"

# Nor is there anything to put it in, or it would take the place of what is read.
expect_line 2 "no folder to make it in" "$lumi" sim shoot room --rig planar:1x1:0.05 --size 64x64 -o nowhere/y.capture
expect_line 2 "there is no folder 'nowhere'" "$lumi" export "a ü.capture" --transforms nowhere/y.json
expect_line 2 "which is the input" "$lumi" process "a ü.capture" -o "a ü.capture/data/capture.db"
expect_line 2 "which is the input" "$lumi" process "a ü.capture" -w "a ü.capture/work" -o y
expect_line 2 "which is the input" "$lumi" export "a ü.capture" --transforms "folder/../a ü.capture/y.json"
"$lumi" verify "a ü.capture" >verified || fail "the capture is no longer whole"
rm verified

# A file over the limit is a write that fails.
(
    ulimit -f 8 || exit 1
    expect_line 1 "b.capture.partial" "$lumi" sim shoot room --rig planar:2x2:0.05 --size 64x64 -o b.capture
    expect_line 1 "File too large" "$lumi" sim truth room --random 2 --size 64x64 -o truth
) || exit 1
left=$(ls -A)
[ "$left" = "a ü.capture
folder" ] || fail "left behind: $left"

"$lumi" process "a ü.capture" -o "b é.lumi" >out || fail "no field"
"$lumi" export "b é.lumi" --view 0 --depth d.exr --mesh m.ply || fail "no depth and mesh of a field"
"$lumi" export "a ü.capture" --view r00c00 --depth e.exr --mesh n.ply || fail "no depth and mesh of a capture"
cp "b é.lumi" copy.lumi
for option in depth mesh; do
    expect_line 2 "copy.lumi: is the input" "$lumi" export copy.lumi --view 0 --$option ./copy.lumi
done
expect_line 2 "depth is written as .exr" "$lumi" render copy.lumi -p 0,0,0,90,0 -s 32x32 -o y.png --depth copy.lumi
expect_line 2 "need two places" "$lumi" render copy.lumi -p 0,0,0,90,0 -s 32x32 -o y.exr --depth y.exr
expect_line 2 "2 to 16384 pixels a side" "$lumi" render copy.lumi -p 0,0,0,90,0 -s 1x1 -o y.webm
expect_line 2 "2 pictures want a folder" "$lumi" render copy.lumi -p 0,0,0,90,0 -p 0,0,0,80,0 -s 32x32 -o y.png
expect_line 2 "there is no folder 'nowhere'" "$lumi" render copy.lumi -p 0,0,0,90,0 -s 32x32 -o nowhere/y.png
expect_line 2 "--stretch x: a number wanted" "$lumi" render copy.lumi -p 0,0,0,90,0 --stretch x -o y.png
"$lumi" export "a ü.capture" --transforms truth.json || fail "no transforms"
expect_line 2 "there is no folder 'nowhere'" "$lumi" eval copy.lumi --truth truth.json --difference late \
    --sheet nowhere/y.png
[ ! -e late ] || fail "compared views for a sheet that cannot be made"
expect_line 2 "--size 1e30x1" "$lumi" render copy.lumi -p 0,0,0,90,0 -s 1e30x1 -o y.png
cmp copy.lumi "b é.lumi" || fail "an export replaced what it read"
[ "$(wc -c <m.ply)" -eq "$(wc -c <n.ply)" ] || fail "the field's mesh has another size than the work directory's"
# A capture and its work in a place where nothing can be written can still be exported from.
mkdir place elsewhere && mv "a ü.capture" "a ü.capture.work" place || exit 1
chmod -R a+rX,a-w place && chmod 755 . && chmod 777 elsewhere || exit 1
other= # root may write anywhere
[ "$(id -u)" -ne 0 ] || other="setpriv --reuid=65534 --regid=65534 --clear-groups"
if $other "$lumi" --version >/dev/null 2>&1; then
    $other "$lumi" export "place/a ü.capture" --view r00c00 --depth elsewhere/e.exr --mesh elsewhere/n.ply ||
        fail "no depth and mesh of a capture that cannot be written"
    cmp elsewhere/n.ply n.ply || fail "another mesh from a capture that cannot be written"
    expect_line 1 "a ü.capture.work" $other "$lumi" process "place/a ü.capture" -o elsewhere/y.lumi
    chmod u+w "place/a ü.capture.work" && rm "place/a ü.capture.work/.lock" && chmod a-w "place/a ü.capture.work" || exit 1
    $other "$lumi" export "place/a ü.capture" --view r00c00 --mesh elsewhere/o.ply || fail "no mesh without a lock"
else
    echo "command_line_test: not as root and not as another: places that cannot be written are not tested"
fi

echo "command_line_test: passed"
