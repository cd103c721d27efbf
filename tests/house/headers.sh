#!/bin/sh
# Compiles every header alone, twice included, as C17; the installed ones also as C++.
# usage: headers.sh ROOT CC CXX INSTALLED_LIST FLAG...
set -eu
root=$1 cc=$2 cxx=$3 installed=$4
shift 4

cd "$root"
count=0 bad=0
for header in $(find proto daemon render pipeline sim cli -name '*.h' | sort); do
    count=$((count + 1))
    printf '#include "%s"\n#include "%s"\nextern int lumi_header_alone;\n' "$header" "$header" |
        "$cc" -std=c17 -fsyntax-only -Wall -Wextra -Werror -x c "$@" - || { echo "$header: not alone in C"; bad=1; }
done
while read -r header; do
    printf '#include "%s"\n#include "%s"\nextern int lumi_header_alone;\n' "$header" "$header" |
        "$cxx" -std=c++17 -fsyntax-only -Wall -Wextra -Werror -x c++ -I. - || { echo "$header: not alone in C++"; bad=1; }
done <"$installed"
echo "$count headers"
[ "$count" -gt 0 ] || exit 1
exit $bad
