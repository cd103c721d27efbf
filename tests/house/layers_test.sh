#!/bin/sh
# The check of the layers must see what it is for: a tree that keeps to the table passes, every planted breach fails.
# usage: layers_test.sh FOLDER_OF_THIS_FILE
set -eu
here=$1
tree=$(mktemp -d)
trap 'rm -rf "$tree"' EXIT

clean() {
    rm -rf "${tree:?}"/*
    mkdir -p "$tree/proto/base" "$tree/proto/image" "$tree/pipeline/run"
    printf '#include "proto/base/a.h"\n#include <stdio.h>\n#include <png.h>\n' >"$tree/proto/image/b.c"
    printf '#include <stdint.h>\n' >"$tree/proto/base/a.h"
    printf 'lumi_folder(run USES base\n  image PKG glib-2.0)\n' >"$tree/pipeline/run/CMakeLists.txt"
}
must_pass() {
    sh "$here/layers.sh" "$tree" "$here/layers.txt" || { echo "a clean tree was refused"; exit 1; }
}
must_fail() {
    if sh "$here/layers.sh" "$tree" "$here/layers.txt"; then
        echo "not seen: $1"
        exit 1
    fi
}

clean
must_pass
echo '#include "proto/image/c.h"' >>"$tree/proto/base/a.h"
must_fail "a contract that includes what stands above it"
clean
echo '#  include <glib.h>' >>"$tree/proto/base/a.h"
must_fail "GLib in proto"
clean
echo '#include <vpx/vpx_encoder.h>' >>"$tree/proto/image/b.c"
must_fail "a library in a second folder"
clean
echo '#include "a.h"' >>"$tree/proto/image/b.c"
must_fail "an include not written from the root"
clean
mkdir "$tree/proto/new" && echo '' >"$tree/proto/new/c.c"
must_fail "a folder that the table does not know"
clean
printf 'lumi_folder(run USES base viewset)\n' >"$tree/pipeline/run/CMakeLists.txt"
must_fail "a USES that the table does not allow"
