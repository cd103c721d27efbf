#!/bin/sh
# Builds the tree with a sanitizer in build/PRESET and runs the tests there.
# usage: sanitize.sh ROOT PRESET ctest-option...
set -eu
cd "$1"
preset=$2
shift 2
cmake --preset "$preset"
cmake --build --preset "$preset"
# One more than there are processors: rigs in real time wait more than they work.
ctest --preset "$preset" -j "$(($(nproc) + 1))" --no-tests=error "$@"
