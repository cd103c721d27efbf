#!/bin/sh
# What previews cost a capture: the store with four previews open over HTTP and with none, in turns, at full speed and at
# the pace of a sweep.
# usage: preview.sh BUILD [DIR]   (DIR: a folder on the disk that captures go to)
set -eu
. "$(dirname "$0")/functions"
program=$1/tests/bench/bench_preview
work_folder "${2:-}"
machine
"$program" "$dir" "${LUMI_PREVIEW_MB:-700}" "${LUMI_PREVIEW_ROUNDS:-24}"
