# shellcheck shell=sh
# How to talk with the lumid of the virtual machine; lumi() runs our program.

# The value of one member of what lumid says it is doing, by our own program's JSON.
status_of() {
    lumi capture status --json | tr ',{' '\n\n' | sed -n "s/^ *\"$1\" *: *\"\{0,1\}\([^\"}]*\).*/\1/p" | head -1
}

# Until a command is good; at most so many seconds, of a machine that has time.
wait_until() { # SECONDS WORDS COMMAND...
    seconds=$1 awaited=$2
    shift 2
    for _ in $(seq $((seconds * 4))); do
        "$@" && return 0
        sleep 0.25
    done
    echo "not within $seconds s: $awaited"
    lumi capture status || true
    tell_log | tail -20
    return 1
}

state_is() {
    state=$(status_of state)
    for wanted; do
        [ "$state" != "$wanted" ] || return 0
    done
    return 1
}

at_least() { # MEMBER NUMBER
    number=$(status_of "$1")
    [ "${number:-0}" -ge "$2" ]
}

# Until lumid's state is one of these; at most so many seconds.
wait_state() {
    seconds=$1
    shift
    wait_until "$seconds" "state $*" state_is "$@"
}

# The log has so many lines with these words.
logged() { # COUNT WORDS
    [ "$(tell_log | grep -c "$2")" -ge "$1" ]
}
