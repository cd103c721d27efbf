#!/bin/sh
# kill_resume_test.sh LUMI KILL_RESUME [long]: a run that is killed inside every stage, twice and more, and resumed each
# time ends with the same bytes as one that was left alone. `long`: three kills, a rig's capture with brackets, which has
# all the stages there are.
lumi=$1
kill_resume=$2
# shellcheck source=tests/scenario/expect.sh
. "$(dirname "$0")/expect.sh"
cd "$scratch" || exit 1

check() { # NAME SEED KILLS DELIVERIES CAPTURE OPTIONS...
    name=$1
    seed=$2
    kills=$3
    deliveries=$4
    capture=$5
    shift 5
    "$kill_resume" "$seed" "$kills" "$deliveries" "$name.killed" "$lumi" process "$capture" -w "$name.killed" \
        -o "$name.lumi" -j 2 "$@" >"$name.kills" || fail "$name: killed and resumed: $(cat "$name.kills")"
    cat "$name.kills"
    cmp -s "$name.lumi.whole" "$name.lumi" || fail "$name: another field than that of a run left alone"
    [ -z "$(find "$name.killed" -name '*.tmp-*')" ] || fail "$name: left: $(find "$name.killed" -name '*.tmp-*')"
    [ -z "$(find . -name '*.lumi.tmp-*')" ] || fail "$name: left beside the field: $(find . -name '*.lumi.tmp-*')"
}

if [ "${3:-}" = long ]; then
    "$lumi" sim shoot room --rig arc:4x9:0.2 --size 160x128 --pose-error 2,0.2 --brackets -2,0,2 -o rig -j 2 >/dev/null ||
        fail "no capture"
    check rig 7 3 3 rig --response estimate --calibrate yes --equalize yes --synthesize yes --subsample yes --prefilter 8
    "$lumi" stage | while read -r stage; do
        grep -q "^$stage " rig.kills || fail "a stage that was not run: $stage"
    done || exit 1
else
    "$lumi" sim shoot room --rig planar:2x2:0.03 --size 60x44 --fov 60 -o tiny -j 2 >/dev/null || fail "no capture"
    check tiny 1 2 0 tiny --neighbours 3 --prefilter 4 --subsample yes
fi
echo "kill_resume_test: passed"
