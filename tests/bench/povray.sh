#!/bin/sh
# A place nobody here made: POV-Ray's example scene "biscuit" (Debian's povray-examples, by Fabien Mosen), its camera
# replaced by a planar array and by an outward sphere; views between them are the truth. Prints the figures of `lumi eval`
# for the disks and for the best single plane.
#
# usage: povray.sh BUILD [DIR]   (DIR: kept, its photographs used again; a temporary folder that is removed otherwise)
# About 8 core-minutes, half of them POV-Ray's. Exits with 77 where POV-Ray or its examples are missing.
set -eu
. "$(dirname "$0")/functions"
lumi=$(realpath "$1/cli/lumi")
examples=/usr/share/doc/povray/examples/advanced
command -v povray >/dev/null || skip "povray is not installed"
[ -e $examples/biscuit.pov ] || [ -e $examples/biscuit.pov.gz ] || skip "povray-examples is not installed"
work_folder "${2:-}"

# Poses: awk prints transforms.json (metres, nerfstudio's convention) and view.inc (centimetres; POV-Ray's frame is
# left-handed with y up: ours with y and z exchanged) from lines "x y z  fx fy fz" of eye and forward, world z up.
write_poses() { # FOLDER WIDTH HEIGHT FOV_DEGREES
    awk -v folder="$1" -v w="$2" -v h="$3" -v fov="$4" '
    function norm(v,  l) { l = sqrt(v[1]^2 + v[2]^2 + v[3]^2); v[1] /= l; v[2] /= l; v[3] /= l }
    function cross(a, b, c) { c[1] = a[2]*b[3]-a[3]*b[2]; c[2] = a[3]*b[1]-a[1]*b[3]; c[3] = a[1]*b[2]-a[2]*b[1] }
    BEGIN { pi = atan2(0, -1); t = fov * pi / 360; f = w / 2 / (sin(t) / cos(t)); up[3] = 1 }
    {
        z[1] = $4; z[2] = $5; z[3] = $6; norm(z); up[1] = up[2] = 0
        cross(z, up, x); norm(x); cross(z, x, y)
        frames = frames sprintf("%s{\"file_path\":\"%04d.png\",\"transform_matrix\":[[%.12g,%.12g,%.12g,%.12g],[%.12g,%.12g,%.12g,%.12g],[%.12g,%.12g,%.12g,%.12g],[0,0,0,1]]}",
            n ? ",\n" : "", n, x[1], -y[1], -z[1], $1, x[2], -y[2], -z[2], $2, x[3], -y[3], -z[3], $3)
        eye = eye sprintf("%s<%.9g,%.9g,%.9g>", n ? "," : "", 100*$1, 100*$3, 100*$2)
        rig = rig sprintf("%s<%.12g,%.12g,%.12g>", n ? "," : "", x[1], x[3], x[2])
        ups = ups sprintf("%s<%.12g,%.12g,%.12g>", n ? "," : "", -y[1], -y[3], -y[2])
        dir = dir sprintf("%s<%.12g,%.12g,%.12g>", n ? "," : "", z[1], z[3], z[2])
        n++
    }
    END {
        printf "{\"camera_model\":\"OPENCV\",\"w\":%d,\"h\":%d,\"fl_x\":%.12g,\"fl_y\":%.12g,\"cx\":%.12g,\"cy\":%.12g,\"frames\":[\n%s\n]}\n", w, h, f, f, w/2, h/2, frames > (folder "/transforms.json")
        printf "#declare Eye=array[%d]{%s}\n#declare Right=array[%d]{%s}\n#declare Up=array[%d]{%s}\n#declare Forward=array[%d]{%s}\n", n, eye, n, rig, n, ups, n, dir > (folder "/view.inc")
        printf "camera{perspective location Eye[frame_number] direction %.12g*Forward[frame_number] right %.12g*Right[frame_number] up %.12g*Up[frame_number]}\n", f / h, w / h, 1 > (folder "/view.inc")
        print n > (folder "/count")
    }'
}

# The scene with its camera block replaced.
scene() {
    if [ -e $examples/biscuit.pov ]; then cat $examples/biscuit.pov; else zcat $examples/biscuit.pov.gz; fi |
        awk '/^camera/ { print "#include \"view.inc\""; skip = 1 } !skip { print } skip && /}/ { skip = 0 }'
}

shoot() { # FOLDER WIDTH HEIGHT
    [ ! -e "$1/0000.png" ] || return 0
    n=$(cat "$1/count")
    scene > "$1/scene.pov"
    (cd "$1" && povray +Iscene.pov +Oframe.png "+W$2" "+H$3" -D +A0.1 +AM1 +R2 -J +KFI0 "+KFF$((n - 1))" +KI0 +KF1 \
        >povray.log 2>&1) || { tail -5 "$1/povray.log"; exit 1; }
    i=0
    for f in "$1"/frame*.png; do
        mv "$f" "$1/$(printf %04d "$i").png"
        i=$((i + 1))
    done
}

field() { # NAME [OPTIONS...]
    name=$1
    shift
    [ -d "$dir/$name.capture" ] || "$lumi" import "$dir/$name-input/transforms.json" -o "$dir/$name.capture"
    "$lumi" process "$dir/$name.capture" -o "$dir/$name.lumi" -q 90 "$@"
}

for part in planar-input planar-truth outward-input outward-truth; do mkdir -p "$dir/$part"; done

# Planar: 5×5, 1.5 cm apart, where the scene's own camera stands, looking where it looks. Truth between the grid's places.
plane='BEGIN {
    e[1] = .20; e[2] = .28; e[3] = .40; z[1] = -.20; z[2] = -.28; z[3] = -.38
    l = sqrt(z[1]^2+z[2]^2+z[3]^2); for (i = 1; i <= 3; i++) z[i] /= l
    l = sqrt(z[1]^2+z[2]^2); x[1] = z[2]/l; x[2] = -z[1]/l; x[3] = 0
    y[1] = z[2]*x[3]-z[3]*x[2]; y[2] = z[3]*x[1]-z[1]*x[3]; y[3] = z[1]*x[2]-z[2]*x[1]
    for (r = -a; r <= a; r += s) for (c = -a; c <= a; c += s) {
        for (i = 1; i <= 3; i++) p[i] = e[i] + .015 * (c * x[i] + r * y[i])
        print p[1], p[2], p[3], z[1], z[2], z[3] } }'
awk -v a=2 -v s=1 "$plane" | write_poses "$dir/planar-input" 384 288 50
awk -v a=1.5 -v s=2 "$plane" | write_poses "$dir/planar-truth" 384 288 50

# Outward: a sphere of 5 cm radius between the tin and the cup, 18 columns of 5 rows from 75 degrees down to 25 up, looking
# out; truth from eyes inside it that look down, with the frames' pixel density.
awk 'BEGIN { pi = atan2(0, -1)
    for (r = 0; r < 5; r++) for (c = 0; c < 18; c++) {
        t = (-75 + 25 * r) * pi / 180; q = 2 * pi * c / 18
        x = cos(t) * cos(q); y = cos(t) * sin(q); z = sin(t)
        print .02 + .05 * x, -.02 + .05 * y, .11 + .05 * z, x, y, z } }' | write_poses "$dir/outward-input" 256 256 95
awk 'BEGIN { pi = atan2(0, -1)
    for (c = 0; c < 8; c++) { q = 2 * pi * c / 8 + .2; t = -.25 - .2 * (c % 3)
        print .02 + .02 * cos(2.4 * c), -.02 + .02 * sin(2.4 * c), .11 + .01 * (c % 3 - 1), cos(t) * cos(q), cos(t) * sin(q), sin(t) } }' |
    write_poses "$dir/outward-truth" 192 144 70

shoot "$dir/planar-input" 384 288
shoot "$dir/planar-truth" 384 288
shoot "$dir/outward-input" 256 256
shoot "$dir/outward-truth" 192 144
field planar
field outward --near 0.03 # biscuits, a hand's breadth away: nearer than is searched by default
machine
judge_heading
judge "biscuit, planar" "$dir/planar.lumi" "$dir/planar-truth/transforms.json" --sheet "$dir/planar.png"
judge "biscuit, planar, plane" "$dir/planar.lumi" "$dir/planar-truth/transforms.json" --method plane
judge "biscuit, outward" "$dir/outward.lumi" "$dir/outward-truth/transforms.json" --sheet "$dir/outward.png"
judge "biscuit, outward, plane" "$dir/outward.lumi" "$dir/outward-truth/transforms.json" --method plane
