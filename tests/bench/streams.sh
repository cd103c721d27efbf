#!/bin/sh
# What 200 event streams over TLS cost a sweep of a simulated rig: time and processor time of lumid with and without, both
# ways round.
# usage: streams.sh BUILD [DIR]   (DIR: where it works)
set -eu
. "$(dirname "$0")/functions"
build=$(realpath "$1")
test=$(realpath "$(dirname "$0")/../scenario/idle_streams_test.sh")
work_folder "${2:-}"
machine
for first in no yes; do
    (cd "$dir" && LUMI_STREAMS_FIRST=$first "$test" "$build/cli/lumi" "$build/daemon/lumid/lumid" \
        "$build/tests/scenario/hold_streams") >"$dir/said" || {
        status=$?
        cat "$dir/said"
        exit $status
    }
    grep -E "^(nobody|200)" "$dir/said"
done
