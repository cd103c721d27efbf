#!/bin/sh
# The most memory that each stage holds: on 1,300 images of a quarter of 1280 x 1024 each way, on 40 of that size, and on 40 whole
# ones, by bench_memory (its head says how). About three core-minutes; with IMAGES, RANGE and SHRINK only that one is run:
# 1300 24 1 are some 25 core-minutes.
# usage: memory.sh BUILD [DIR [IMAGES RANGE SHRINK]]   (DIR: kept)
set -eu
. "$(dirname "$0")/functions"
program=$1/tests/bench/bench_memory
shift
work_folder "${1:-}"
[ $# -eq 0 ] || shift
machine
[ $# -gt 0 ] || set -- 1300 24 4 40 1 4 40 2 1
while [ $# -ge 3 ]; do
    echo "$1 images of 1280 x 1024, shrunk by $3 each way:"
    mkdir -p "$dir/$1-$3"
    "$program" "$dir/$1-$3" "$1" "$2" "$3"
    shift 3
done
