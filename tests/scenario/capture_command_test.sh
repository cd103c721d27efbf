#!/bin/sh
# lumi capture against a server whose engine follows a script: what a person sees, and exit statuses.
# usage: capture_command_test.sh LUMI SERVE_API
lumi=$1 serve=$2
. "$(dirname "$0")/expect.sh"
unset LUMID_ADDRESS LUMID_TOKEN LUMID_CA
XDG_CONFIG_HOME=$scratch/config
export XDG_CONFIG_HOME
server=
trap '[ -z "$server" ] || kill $server; chmod -R u+w "$scratch"; rm -rf "$scratch"' EXIT
start_server() { # ENDING [TOKEN [CERTIFICATE]]
    [ -z "$server" ] || { kill "$server" && wait "$server"; } 2>/dev/null
    rm -f "$scratch/port"
    "$serve" "$1" "$scratch/port" ${2+"$2"} ${3+"$3"} &
    server=$!
    for _ in $(seq 200); do
        [ -s "$scratch/port" ] && break
        sleep 0.05
    done
    LUMID_ADDRESS=localhost:$(cat "$scratch/port")
    export LUMID_ADDRESS
}
plan=$scratch/plan
"$lumi" capture plan turn --profile arc16 --print >"$plan" || fail "no plan"

# Plans need nobody.
expect 0 "72    1152   0:30 min" "$lumi" capture plan "$plan" --profile arc16
expect 0 '"bytes_per_second":' "$lumi" capture plan hdr --profile bar2 --json
expect_line 2 "--profile PROFILE is missing" "$lumi" capture plan turn
expect_line 3 "none: cannot open" "$lumi" capture plan none --profile arc16

# Nobody is there.
expect_line 1 "no lumid at http://localhost:1" "$lumi" capture status --lumid localhost:1
expect_line 2 "HOST:PORT" "$lumi" capture status --lumid ftp://localhost

# A whole capture.
start_server complete
expect 0 "state     idle: ready" "$lumi" capture status
expect 0 "cameras   1 of 1 there, 0 armed" "$lumi" capture status
expect 0 "nothing is being captured" "$lumi" capture watch
expect 0 "/captures/first" "$lumi" capture start "$plan" --name first --watch
"$lumi" capture watch --json >"$scratch/events" || fail "watching what is complete"
[ "$(wc -l <"$scratch/events")" -ge 1 ] || fail "no event"
expect 0 "8 accepted, 0 rejected, 0 missing" "$lumi" capture status
expect 0 '"complete":true' "$lumi" capture status --json
expect 0 "no frame is missing" "$lumi" capture retake --list
expect 0 "lumid stops at the next safe place" "$lumi" capture pause
expect 0 "lumid goes on" "$lumi" capture resume
expect 0 "closes the capture" "$lumi" capture stop
expect 0 "emergency stop" "$lumi" capture stop --emergency
expect 0 "clears" "$lumi" capture clear
expect 0 "looks for the index mark" "$lumi" capture home --turn 3
expect 0 "looks for the index mark" "$lumi" capture home --wind-up
expect_line 2 "--turn: 0 or more" "$lumi" capture home --turn -1
expect 0 "the rig turns" "$lumi" capture jog -- -22.5
expect_line 2 "DEGREES: up to 360" "$lumi" capture jog 400
expect_line 3 "there are no captures here" "$lumi" capture verify nothing.capture
expect_line 2 "--emergency goes with neither" "$lumi" capture stop --emergency --now
expect_line 3 "none: cannot open" "$lumi" capture start "$scratch/none"

# Events one by one, while they happen, for a program.
start_server complete
"$lumi" capture watch --json --follow >"$scratch/events" &
watcher=$!
expect 0 "" "$lumi" capture start "$plan" --name second
for _ in $(seq 200); do
    grep -q '"event":"sealed"' "$scratch/events" && break
    sleep 0.05
done
kill $watcher
wait $watcher 2>/dev/null
[ "$(grep -c '"event":"shot"' "$scratch/events")" -eq 8 ] || fail "not every shot was told: $(cat "$scratch/events")"
grep -q '"event":"incident".*"camera":"c00".*a frame came late' "$scratch/events" || fail "no incident"
grep -q '"event":"state".*"id":"[0-9a-f]*-[0-9]*","data":{' "$scratch/events" || fail "no state"

# What is red is not begun, and says why; overridden it is.
start_server red
expect 1 "red       link           the board does not answer" "$lumi" capture start "$plan" --name third
expect_line 1 "link: the board does not answer" "$lumi" capture start "$plan" --name third
expect 0 "" "$lumi" capture start "$plan" --name third --override link

# Frames that stay missing are no success.
start_server missing
expect_line 1 "1 frames are missing" "$lumi" capture start "$plan" --name fourth --watch
expect 0 "c00-t00-p007" "$lumi" capture retake --list
expect 0 "takes them again" "$lumi" capture retake c00-t00-p007

# The token.
start_server complete secret
expect_line 2 "a token is needed" "$lumi" capture status
LUMID_TOKEN=wrong expect_line 2 "the token is wrong" "$lumi" capture status
LUMID_TOKEN=secret expect 0 "idle" "$lumi" capture status
echo secret >"$scratch/token"
expect 0 "idle" "$lumi" capture status --token-file "$scratch/token"
address=$LUMID_ADDRESS
unset LUMID_ADDRESS
mkdir -p "$scratch/config/lumisphere"
printf '[lumid]\naddress=%s\ntoken_file=%s\n' "$address" "$scratch/token" >"$scratch/config/lumisphere/lumi.conf"
expect 0 "idle" "$lumi" capture status

# TLS: a certificate that is trusted because it is named, and only then.
command -v openssl >/dev/null || exit 0
openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=localhost -addext subjectAltName=DNS:localhost \
    -keyout "$scratch/key.pem" -out "$scratch/certificate.pem" 2>/dev/null || fail "openssl made no certificate"
cat "$scratch/certificate.pem" "$scratch/key.pem" >"$scratch/both.pem"
rm -r "$scratch/config"
start_server complete secret "$scratch/both.pem"
[ -s "$scratch/port" ] || exit 0 # no TLS in GLib here (glib-networking)
LUMID_TOKEN=secret
export LUMID_TOKEN
expect 0 "idle" "$lumi" capture status --lumid "https://$LUMID_ADDRESS" --ca "$scratch/certificate.pem"
expect_line 1 "--ca names the certificate to trust" "$lumi" capture status --lumid "https://$LUMID_ADDRESS"
expect_line 1 "no answer from lumid" "$lumi" capture status
expect 0 "/captures/fifth" "$lumi" capture start "$plan" --name fifth --watch --lumid "https://$LUMID_ADDRESS" \
    --ca "$scratch/certificate.pem"
