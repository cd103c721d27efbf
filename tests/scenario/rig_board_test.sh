#!/bin/sh
# lumi sim board: a simulated rig behind a pseudo-terminal, on which the rig's commands work; and what it refuses.
# usage: rig_board_test.sh LUMI
set -eu
lumi=$1
dir=$(mktemp -d)
board=
trap 'if [ -n "$board" ]; then kill "$board" 2>/dev/null || true; fi; rm -rf "$dir"' EXIT INT TERM

fail() {
    echo "$*" >&2
    exit 1
}

# Refused, with its exit status and one line that holds a word.
refuses() {
    status=$1 word=$2
    shift 2
    if "$@" >"$dir/out" 2>"$dir/err"; then fail "taken: $*"; else got=$?; fi
    [ "$got" -eq "$status" ] || fail "status $got, not $status: $*"
    grep -q "$word" "$dir/err" || fail "no '$word' in: $(cat "$dir/err")"
}

printf 'at 1s string snag\nat 2s gremlins\n' >"$dir/bad.faults"
refuses 3 'bad.faults: line 2: no such fault' "$lumi" sim board --faults "$dir/bad.faults"
refuses 2 'speed' "$lumi" sim board --speed 0
refuses 3 'arc17' "$lumi" sim board --profile arc17
: >"$dir/file"
refuses 3 'no symbolic link' "$lumi" sim board --pty "$dir/file"

ln -s "$dir/nowhere" "$dir/rig" # left behind by one that was killed
"$lumi" sim board --profile arc16 --pty "$dir/rig" --speed 8 --seconds 4000 >"$dir/path" 2>"$dir/log" &
board=$!
for i in 1 2 3 4 5 6 7 8 9 10; do
    [ -e "$dir/rig" ] && break
    sleep 1
done
[ -e "$dir/rig" ] || fail "no pseudo-terminal: $(cat "$dir/log")"
refuses 3 "another's" "$lumi" sim board --pty "$dir/rig"
link="serial:$dir/rig"
"$lumi" rig status --link "$link" >"$dir/status"
grep -q '^state *lost' "$dir/status" || fail "not lost at its start: $(cat "$dir/status")"
"$lumi" rig home --link "$link" >/dev/null
"$lumi" rig status --link "$link" >"$dir/status"
grep -q '^state *idle' "$dir/status" || fail "not homed: $(cat "$dir/status")"

kill "$board"
wait "$board" || fail "status $? when told to end"
board=
[ ! -L "$dir/rig" ] || fail "the link is left behind"

# One that has become another's is not its to remove.
"$lumi" sim board --pty "$dir/rig" --speed 100 >"$dir/second" 2>"$dir/log" &
board=$!
for i in 1 2 3 4 5 6 7 8 9 10; do
    [ -s "$dir/second" ] && break
    sleep 1
done
ln -sf "$dir/file" "$dir/rig"
kill "$board"
wait "$board" || fail "status $? when told to end"
board=
[ -L "$dir/rig" ] || fail "another's link is gone"
echo good
