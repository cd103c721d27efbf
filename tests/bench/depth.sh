#!/bin/sh
# Depth by the pictures it makes on the shop light field, and its cost; the matching kernels against plain C.
# usage: depth.sh BUILD_FOLDER [VIEWS]
set -eu
shop=$(dirname "$0")/../../../shared/data/shop
"$1/tests/kernels/test_depth_kernels" --bench
if [ ! -d "$shop" ]; then
    echo "skipped: no $shop"
    exit 77
fi
"$1/tests/bench/bench_depth" "$shop" ${2:+"$2"}
