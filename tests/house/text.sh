#!/bin/sh
# What every file of the tree is held to: no path of the machine it was written on, no file over 600 lines and no
# function over 60 (exceptions with their reasons: bounds.txt), no two source files of one name (exceptions there too).
# usage: text.sh ROOT BOUNDS
set -eu
root=$1 bounds=$2
cd "$root"
bad=0
all=$(find . \( -path ./.git -o -path ./build -o -path ./demo -o -path '*/corpus' -o -name '*.work' \) -prune -o -type f -print)
sources=$(printf '%s\n' "$all" | grep -E '\.(c|h|cc)$' | sed 's,^\./,,')

# shellcheck disable=SC2086
if grep -nEI '(^|[^a-zA-Z0-9_.}-])/(work|farm|root|home)/' $all; then
    echo "^ a path of one machine"
    bad=1
fi

# shellcheck disable=SC2086
awk -v bounds="$bounds" '
function over(place, what, lines, limit) {
    if (lines <= limit || place in excepted)
        return
    printf "%s: %s of %d lines, %d are the bound\n", place, what, lines, limit
    bad = 1
}
FILENAME == bounds {
    sub(/#.*/, "")
    for (i = 1; i <= NF; i++)
        excepted[$i] = 1
    next
}
FNR == 1 {
    over(last, "a file", length_of_last, 600)
    last = FILENAME
}
{ length_of_last = FNR }
/^[a-zA-Z_].*\(/ { name = $0; sub(/\(.*/, "", name); sub(/.*[ *]/, "", name) }
/^\{/ { start = FNR }
/^\}/ && start { over(FILENAME ":" name, "a function", FNR - start + 1, 60); start = 0 }
END { over(last, "a file", length_of_last, 600); exit bad }' "$bounds" $sources || bad=1

same=$(printf '%s\n' "$sources" | grep -v /x86/ | sed 's,.*/,,' | sort | uniq -d |
    while read -r name; do
        sed 's/#.*//' "$bounds" | tr ' ' '\n' | grep -qxF "$name" || echo "$name"
    done)
if [ -n "$same" ]; then
    echo "two files named $same"
    bad=1
fi
exit $bad
