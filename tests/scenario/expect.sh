# What the scenario tests share; they read it in with `.`. A scratch folder ($scratch) that goes with the test, and how a
# test says what it expects of a program.
scratch=$(mktemp -d) || exit 1
trap 'chmod -R u+w "$scratch"; rm -rf "$scratch"' EXIT
fail() {
    echo "$(basename "$0" .sh): $1" >&2
    exit 1
}
expect() { # STATUS PART COMMAND...: exit status and a part of what is printed
    wanted=$1
    part=$2
    shift 2
    out=$("$@" 2>&1)
    status=$?
    [ $status -eq "$wanted" ] || fail "'$*' ended with $status, not $wanted: $out"
    echo "$out" | grep -Fq -e "$part" || fail "'$*' did not say '$part': $out"
}
expect_line() { # STATUS PART COMMAND...: exit status, one line on standard error, a part of it
    wanted=$1
    part=$2
    shift 2
    out=$("$@" 2>&1 >/dev/null)
    status=$?
    [ $status -eq "$wanted" ] || fail "'$*' ended with $status, not $wanted: $out"
    [ "$(echo "$out" | wc -l)" -eq 1 ] || fail "'$*' did not say one line: $out"
    echo "$out" | grep -Fq -e "$part" || fail "'$*' did not say '$part': $out"
}
frames() { # CAPTURE: how many frames there are in it
    find "$1/data/frames" -type f | wc -l
}
said() { # PART...: what `expect` ran last did
    for part in "$@"; do
        echo "$out" | grep -Fq -e "$part" || fail "not said: '$part' in: $out"
    done
}
