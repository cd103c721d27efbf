#!/bin/sh
# The store against the disk: 16 cameras' frames of 5.5 Mpixel raw8 with checksum and commit, and `dd oflag=direct` of as
# many bytes, in turns; without and with a second copy (on the same disk where LUMI_BENCH_SECOND names no other).
# usage: store.sh BUILD [DIR]   (DIR: a folder on the disk to be measured)
set -eu
. "$(dirname "$0")/functions"
program=$1/tests/bench/bench_store
work_folder "${2:-}"
machine
"$program" "$dir" 2000
second=${LUMI_BENCH_SECOND:-$dir/second}
mkdir -p "$second"
echo "with a second copy in $second:"
"$program" "$dir" 1000 "$second"
