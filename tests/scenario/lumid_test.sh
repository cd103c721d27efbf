#!/bin/sh
# lumid as a crew meets it: configurations and folders that cannot be, a board without its cameras, an emergency stop in
# the sweep, a kill -9, an end by SIGTERM; each time one clear line, and a capture that goes on.
# usage: lumid_test.sh LUMID LUMI
set -u
lumid=$1 lumi=$2
. "$(dirname "$0")/expect.sh"
. "$(dirname "$0")/lumid_alone.sh"

# ---- the configuration ----

configure() { # FILE LINES...: the rig's, then what is added
    file=$1
    shift
    {
        printf '[rig]\nlink = serial:%s/board\n[capture]\nfolder = %s/captures\nretakes = 0\n' "$scratch" "$scratch"
        printf '[http]\nlisten = localhost:0\n'
        printf '%s\n' "$@"
    } >"$file"
}
cameras() { # COUNT OPTIONAL
    camera=0
    while [ $camera -lt "$1" ]; do
        printf '[camera c%02d]\naddress = v4l2:NOBODY%d\noptional = %s\n' $camera $camera "$2"
        camera=$((camera + 1))
    done
}
mkdir captures
expect 2 "Unknown option" "$lumid" --nothing
expect_line 3 "nothing.conf: " "$lumid" --config nothing.conf
configure bad.conf '[camera a]' 'address = aravis:7' 'trigger = maybe' '[camera b]' 'address = aravis:7' '[nonsense]'
expect 3 "bad.conf:10: [camera a] trigger: \"maybe\" must be one of free, hardware, software" "$lumid" --config bad.conf
expect 3 "bad.conf:11: [camera b] address: \"aravis:7\" is camera a already" "$lumid" --check --config bad.conf
expect 3 "bad.conf:13: [nonsense]: there is no such group" "$lumid" --check --config bad.conf
configure bad.conf '[process]' "command = 'open"
expect 3 "command" "$lumid" --config bad.conf
configure bad.conf '[gpio]' 'estop = gpiochip4711:3'
expect 3 "there is no chip gpiochip4711" "$lumid" --config bad.conf
printf '[http]\nlisten = 0.0.0.0:0\ntoken_file = %s/short\n[capture]\nfolder = %s/captures\n' "$scratch" "$scratch" >bad.conf
echo secret >short
expect 3 "its first line, the token, has 6 characters" "$lumid" --config bad.conf
printf '[capture]\nfolder = /dev/null/captures\n' >bad.conf
expect 3 "/dev/null/captures" "$lumid" --config bad.conf
"$lumid" --print-config >default.conf || fail "--print-config"
configure good.conf
expect 0 "good.conf: good: 0 cameras" "$lumid" --check --config good.conf

# A folder on a disk that cannot be written: only where namespaces are to be had.
if unshare -rm mount -t tmpfs tmpfs /mnt 2>/dev/null; then
    cat >readonly.sh <<'END'
mount -t tmpfs -o size=64k tmpfs captures && mount -o remount,ro captures && exec "$@"
END
    expect 1 "captures/.lumid: making it: Read-only file system" unshare -rm sh readonly.sh "$lumid" --config good.conf
fi

# ---- a rig without its cameras ----

start() { # CONFIG: lumid, until it says its port
    : >log
    "$lumid" --config "$1" 2>>log &
    daemon=$!
    tries=0
    until port=$(sed -n 's/.*ready, port \([0-9]*\),.*/\1/p' log | tail -1) && [ -n "$port" ]; do
        kill -0 $daemon 2>/dev/null || fail "lumid has ended: $(cat log)"
        tries=$((tries + 1))
        [ $tries -lt 600 ] || fail "lumid is not ready: $(cat log)"
        sleep 0.05
    done
    export LUMID_ADDRESS=localhost:$port
}
await() { # TEXT: until lumid's status says it
    tries=0
    until "$lumi" capture status >status 2>&1 && grep -q -e "$1" status; do
        kill -0 $daemon 2>/dev/null || fail "lumid has ended: $(cat log)"
        tries=$((tries + 1))
        [ $tries -lt 600 ] || fail "no '$1': $(cat status)"
        sleep 0.2
    done
}
finish() { # lumid, by SIGTERM; its status must be 0
    kill -TERM $daemon
    wait $daemon || fail "lumid ended with $?: $(cat log)"
    daemon=
}
"$lumi" sim board --profile arc16 --pty "$scratch/board" >board.txt 2>&1 &
board=$!
"$lumi" capture plan turn --profile arc16 --print >turn.txt || fail "no plan"
"$lumi" capture plan still --profile bar2 --print >other.txt || fail "no plan"

configure needed.conf "$(cameras 16 no)"
start needed.conf
expect 1 "another lumid has this folder" "$lumid" --config needed.conf
await 'rig .*firmware'
await 'c15 .*AWAY'
expect 1 "camera c07     it is not there" "$lumi" capture start turn.txt
# A plan that names cameras of another rig.
sed 's/^cameras = .*/cameras = left/' turn.txt >other.txt
expect 1 "plan" "$lumi" capture start other.txt
# What is no plan is refused by its line; a mistyped override is told.
printf '[sweep]\nmode = continuous\nspeed = 7\n' >none.txt
expect_line 3 "the plan:3: a plan has no key 'speed'" "$lumi" capture start none.txt
expect 1 "no check is called 'nonsense'" "$lumi" capture start turn.txt --override nonsense
expect_line 1 "another program has it locked (lumid?)" "$lumi" rig status --link "serial:$scratch/board"
expect 3 "no capture is there; name one (--capture NAME)" "$lumi" capture retake
finish

# ---- who may ask ----

echo 0123456789abcdef0123456789abcdef >token
echo fedcba9876543210fedcba9876543210 >wrong
configure token.conf
sed -i "s,^listen.*,&\ntoken_file = $scratch/token," token.conf
start token.conf
out=$("$lumi" capture status --token-file wrong 2>&1) && fail "a wrong token is taken: $out"
echo "$out" | grep -qi token || fail "a wrong token: $out"
expect 0 "lumid" "$lumi" capture status --token-file token
finish

# ---- a sweep ----

configure sweep.conf "$(cameras 16 yes)"
start sweep.conf
await 'rig .*firmware'
"$lumi" capture start --name one turn.txt >/dev/null 2>said || fail "it does not begin: $(cat said)"
await 'sweeping\|shots     [1-9]'
await 'shots     [1-9]'
"$lumi" capture stop --emergency >/dev/null 2>said || fail "no emergency stop: $(cat said)"
await 'faults: estop'
await 'state     interrupted'
"$lumi" capture clear >/dev/null 2>said || fail "clear: $(cat said)"
await 'faults: none'
"$lumi" capture resume >/dev/null 2>said || fail "resume: $(cat said)"
await 'state     sweeping'

# Without a word.
kill -9 $daemon
wait $daemon 2>/dev/null
start sweep.conf
grep -q "a capture that was interrupted goes on" log || fail "nothing goes on: $(cat log)"
await 'state     sweeping'

# At its own pace.
finish
grep -q "lumid: ended" log || fail "it does not say that it has ended: $(cat log)"
[ ! -e captures/one/manifest-sha256.txt ] || fail "it is sealed already"
start sweep.conf
await 'state     sweeping'
"$lumi" capture stop >/dev/null 2>said || fail "stop: $(cat said)"
await 'state     done'
finish
capture=captures/one
"$lumi" verify "$capture" >said 2>&1 || fail "$capture: $(cat said)"

# ---- a capture that arrives ----

mkdir arriving taken
printf '[capture]\nfolder = %s/taken\n[process]\ncommand = touch %s/processed-%%n\n' "$scratch" "$scratch" >arrive.conf
cp -r "$capture" arriving/
ingest() { # until it has said what it wants to
    : >log
    "$lumid" --config arrive.conf --ingest "$scratch/arriving" 2>>log &
    daemon=$!
    tries=0
    until grep -q -e "$1" log; do
        kill -0 $daemon 2>/dev/null || fail "lumid has ended: $(cat log)"
        tries=$((tries + 1))
        [ $tries -lt 600 ] || fail "no '$1': $(cat log)"
        sleep 0.1
    done
}
ingest "processing is done"
finish
[ -e processed-one ] || fail "it is not processed: $(cat log)"
"$lumi" verify taken/one >said 2>&1 || fail "taken in: $(cat said)"
rm processed-one
mkdir arriving/nonsense
echo nothing >arriving/nonsense/file
ingest "nonsense: not taken in"
finish
[ ! -e processed-one ] || fail "it is processed again"

# ---- a capture of a newer lumid ----

# SQLite keeps a program's version of a file at its bytes 60 to 63.
chmod -R u+w "$capture"
printf '\0\0\003\347' | dd of="$capture/data/capture.db" bs=1 seek=60 conv=notrunc 2>/dev/null
start sweep.conf
expect 3 "a capture of version 999" "$lumi" capture retake --capture one
expect 0 "lumid" "$lumi" capture status
finish
exit 0
