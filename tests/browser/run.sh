#!/bin/sh
# A browser test: SPEC on a simulated rig with its lumid, all in a network of their own, from which nothing else can be
# reached. OUT keeps pictures, figures and logs.
# usage: run.sh LUMI LUMID PACKAGES OUT SPEC
set -eu
here=$(cd "$(dirname "$0")" && pwd)
[ -d "$3/node_modules/playwright-core" ] || {
    echo "Playwright is not there (browser_packages says why): skipped"
    exit 77
}
network=$(unshare -rn true 2>&1) || network=$(unshare -n true 2>&1) || {
    echo "no network namespace here ($network): skipped"
    exit 77
}
chmod -R u+w "$4" 2>/dev/null || true
rm -rf "$4"
mkdir -p "$4"
exec node "$here/run.mjs" "$@"
