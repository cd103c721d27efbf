#!/bin/sh
# Users of a rig as a crew meets them: added while lumid runs, phones' codes, lumi on the rig's own computer, the rig's
# certificate, the last one removed; what is wrong is one clear line.
# usage: access_test.sh LUMID LUMI
set -u
lumid=$1 lumi=$2
. "$(dirname "$0")/expect.sh"
cd "$scratch" || exit 1
daemon=
stop_all() {
    [ -z "$daemon" ] || kill -9 "$daemon" 2>/dev/null
    rm -rf "$scratch"
}
trap stop_all EXIT
unset NOTIFY_SOCKET WATCHDOG_USEC JOURNAL_STREAM LUMID_TOKEN LUMID_CA
mkdir captures
printf '[rig]\nlink = serial:%s/board\n[capture]\nfolder = %s/captures\n[http]\nlisten = localhost:0\nsecure = 127.0.0.1:0\naccess = %s/access\n' \
    "$scratch" "$scratch" "$scratch" >lumid.conf
users=access/users
start() {
    : >log
    "$lumid" --config lumid.conf 2>>log &
    daemon=$!
    tries=0
    until port=$(sed -n 's/.*ready, port \([0-9]*\),.*/\1/p' log) && [ -n "$port" ]; do
        kill -0 $daemon 2>/dev/null || fail "lumid has ended: $(cat log)"
        tries=$((tries + 1))
        [ $tries -lt 600 ] || fail "lumid is not ready: $(cat log)"
        sleep 0.05
    done
    export LUMID_ADDRESS=localhost:$port
}
await() { # TEXT in the log
    tries=0
    until grep -q -e "$1" log; do
        tries=$((tries + 1))
        [ $tries -lt 200 ] || fail "no '$1': $(cat log)"
        sleep 0.1
    done
}
finish() {
    kill -TERM $daemon
    wait $daemon || fail "lumid ended with $?: $(cat log)"
    daemon=
}

# ---- the command line ----

echo "a good password" >password
echo short >short
expect_line 2 "the password is too short" "$lumi" user add anna --users "$users" --password-file short
expect_line 2 "no colon" "$lumi" user add an:na --users "$users" --password-file password
expect_line 2 "watch or operate wanted" "$lumi" user add anna --role root --users "$users" --password-file password
expect_line 3 "nothing: opening it" "$lumi" user add anna --users "$users" --password-file nothing
[ ! -e "$users" ] || fail "there is a file of users"
start
expect_line 1 "there is no user yet: lumi user add NAME" "$lumi" pair

# A file that says nothing clear lets nobody in, and is told before lumid is started.
mkdir -p other
sed "s|^access *=.*|access = $scratch/other|" lumid.conf >other.conf
printf 'anna:root:x\n' >other/users
chmod 600 other/users
expect_line 3 "other/users" "$lumid" --config other.conf --check

# ---- the first user ----

expect 0 "the first user" "$lumi" user add anna --users "$users" --password-file password
await "others are answered on port"
[ "$(stat -c %a "$users" access/rig.pem access/local.token | tr '\n' ' ')" = "600 600 640 " ] || fail "$(ls -l access)"
secure=$(sed -n 's/.*answered on port \([0-9]*\),.*/\1/p' log)
expect_line 2 "a token is needed: --token-file" "$lumi" capture status
expect 0 "state" "$lumi" capture status --token-file access/local.token
expect 0 "state" "$lumi" capture status --lumid "https://localhost:$secure" --ca access/rig.crt --token-file access/local.token
expect_line 1 "ertificate" "$lumi" capture status --lumid "https://localhost:$secure" --token-file access/local.token
expect 0 "https://127.0.0.1:$secure/" "$lumi" pair --token-file access/local.token
expect 0 "role watch" "$lumi" pair --role watch --token-file access/local.token
expect 0 '"qr":"<svg' "$lumi" pair --json --token-file access/local.token
expect_line 3 "watch or operate wanted" "$lumi" pair --role root --token-file access/local.token

# ---- others ----

expect 0 "willi may watch" "$lumi" user add willi --role watch --users "$users" --password-file password
expect_line 2 "there is a user of that name" "$lumi" user add willi --users "$users" --password-file password
expect 0 "operate  anna" "$lumi" user list --users "$users"
expect 0 '{"users":[{"name":"anna","role":"operate"},{"name":"willi","role":"watch"}]}' "$lumi" user list --json --users "$users"
expect_line 2 "otto: there is no such user" "$lumi" user password otto --users "$users" --password-file password
expect 0 "another password" "$lumi" user password willi --users "$users" --password-file password
expect_line 2 "otto: there is no such user" "$lumi" user remove otto --users "$users"

# ---- a lumid that starts again, and files that are not as they should be ----

fingerprint=$(openssl x509 -in access/rig.crt -noout -fingerprint -sha256 2>/dev/null | cut -d= -f2)
finish
[ ! -e access/local.token ] || fail "the token of a lumid that has ended is there"
start
await "others are answered on port"
[ -z "$fingerprint" ] || grep -q "$fingerprint" log || fail "another certificate: $(cat log)"
printf 'otto\n' >>"$users"
await "users:4: NAME:ROLE:HASH wanted"
expect 0 "state" "$lumi" capture status --token-file access/local.token
expect_line 3 "users:4: NAME:ROLE:HASH wanted" "$lumi" user list --users "$users"
finish
expect_line 3 "users:4: NAME:ROLE:HASH wanted" "$lumid" --config lumid.conf
sed -i 4d "$users"
chmod 644 "$users"
expect_line 3 "chmod 640" "$lumid" --config lumid.conf
chmod 600 "$users"

# ---- the last one ----

start
await "others are answered on port"
expect 0 "is no user any more" "$lumi" user remove willi --users "$users"
expect 0 "was the last user" "$lumi" user remove anna --users "$users"
await "this computer alone is answered"
expect 0 "state" "$lumi" capture status
finish
