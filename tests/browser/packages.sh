#!/bin/sh
# Playwright and axe-core, as package-lock.json has them, into the build folder: once, with the network. Without npm,
# Debian's Chromium or a network that leads to the registry the browser tests are skipped.
# usage: packages.sh FOLDER
set -eu
here=$(cd "$(dirname "$0")" && pwd)
folder=$1
for program in node npm chromium; do
    command -v $program >/dev/null || {
        echo "no $program here (script/bootstrap installs it): skipped"
        exit 77
    }
done
mkdir -p "$folder"
cd "$folder"
if [ -d node_modules/playwright-core ] && cmp -s "$here/package-lock.json" package-lock.json; then
    exit 0
fi
cp "$here/package.json" "$here/package-lock.json" .
PLAYWRIGHT_SKIP_BROWSER_DOWNLOAD=1 npm ci --ignore-scripts --no-audit --no-fund >npm.log 2>&1 || {
    rm -rf node_modules
    tail -3 npm.log
    echo "npm cannot get them (offline?): skipped"
    exit 77
}
