# What the tests of `lumi rig` share, read in after expect.sh: a board at the end of a line, and its sweeps' logs.
serve_line() { # COMMAND...: starts it with the fifo `control` (descriptor 7) as its input; $board is the address it prints
    mkfifo control
    "$@" <control >terminal &
    exec 7>control
    tries=0
    until [ -s terminal ]; do
        tries=$((tries + 1))
        [ $tries -lt 600 ] || fail "no board: $*"
        sleep 0.05
    done
    board=$(cat terminal)
}
rig() { # "COMMAND WORDS" ARGUMENTS...
    what=$1
    shift
    # shellcheck disable=SC2086
    "$lumi" rig $what -l "$board" "$@"
}
each_once() { # LOG COUNT: shots 0 to COUNT - 1, each fired once
    grep -o '"shot":[0-9]*,"lost":false' "$1" | tr -dc '0-9\n' | sort -n >had
    seq 0 $(($2 - 1)) >wanted
    cmp -s had wanted || fail "$1 does not hold every shot once: $(diff had wanted | head -5)"
}
