#!/bin/sh
# command_line_test.sh LUMI: wrong arguments, and what a person meets who runs out of room or mistypes a place: one line,
# the exit status that the manual promises, and nothing left behind.
lumi=$1
scratch=$(mktemp -d) || exit 1
trap 'rm -rf "$scratch"' EXIT
cd "$scratch" || exit 1
fail() {
    echo "command_line_test: $1" >&2
    exit 1
}
expect() { # STATUS PART ARGUMENT...: exit status, one line on standard error, a part of it
    wanted=$1
    part=$2
    shift 2
    "$lumi" "$@" >out 2>said
    status=$?
    [ $status -eq "$wanted" ] || fail "'$*' ended with $status, not $wanted: $(cat said)"
    [ "$(wc -l <said)" -eq 1 ] || fail "'$*' did not say one line: $(cat said)"
    grep -Fq -e "$part" said || fail "'$*' did not say '$part': $(cat said)"
    rm -f out said
}

expect 2 "no command 'nosuch'" nosuch
expect 2 "'sim shoot', 'sim truth'" sim
for command in import export process render eval info verify "sim shoot" "sim truth"; do
    # shellcheck disable=SC2086
    expect 2 "usage: lumi $command" $command
    # shellcheck disable=SC2086
    expect 2 "--nosuch" $command --nosuch x
done

"$lumi" sim shoot room --rig planar:2x2:0.05 --size 64x64 -o "a ü.capture" || fail "no capture"
for command in "import x -o y" "sim shoot room -o y" "sim truth room -o y" "render x -p 0,0,0,0,0 -o y.png" \
    "eval x --truth y" "process x -o y" "stage depth x"; do
    # shellcheck disable=SC2086
    expect 2 "--threads -1" $command --threads -1
done
for number in nan inf -1; do
    expect 2 "--unit" import x -o y --unit=$number
done
expect 2 "random views: count" sim truth room -o y --random 0
expect 2 "random views: volume" sim truth room -o y --random 1 --stereo nan
for fov in nan -1 500; do
    expect 2 "field of view" sim shoot room -o y --rig planar:2x2:0.1 --fov $fov
done
for option in gp near far neighbours cluster disk-scale pixels-per-degree target-bytes; do
    expect 2 "--$option" process "a ü.capture" -o y --$option 0
done

# Where the field cannot go is said before anything is made.
mkdir folder
expect 2 "folder: is a folder" process "a ü.capture" -o folder
expect 2 "nowhere/y.lumi: there is no folder" process "a ü.capture" -o nowhere/y.lumi
[ -z "$(find "a ü.capture.work" -name '*.exr')" ] || fail "stages ran for an output that cannot be made"

# A file over the limit is a write that fails.
(
    ulimit -f 8 || exit 1
    expect 1 "b.capture.partial" sim shoot room --rig planar:2x2:0.05 --size 64x64 -o b.capture
    expect 1 "File too large" sim truth room --random 2 --size 64x64 -o truth
) || exit 1
left=$(ls -A)
[ "$left" = "a ü.capture
a ü.capture.work
folder" ] || fail "left behind: $left"

"$lumi" process "a ü.capture" -o "b é.lumi" >out || fail "no field"
"$lumi" export "b é.lumi" --view 0 --depth d.exr --mesh m.ply || fail "no depth and mesh of a field"
"$lumi" export "a ü.capture" --view r00c00 --depth e.exr --mesh n.ply || fail "no depth and mesh of a capture"
[ "$(wc -c <m.ply)" -eq "$(wc -c <n.ply)" ] || fail "the field's mesh has another size than the work directory's"
echo "command_line_test: passed"
