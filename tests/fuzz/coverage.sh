#!/bin/bash
# coverage.sh [FOLDER]: builds the fuzz targets with clang's source-based coverage, replays their corpora (those of the
# tree, or FOLDER/fuzz_X), and prints how many lines of each reader they run. Writers that share a file with a reader, and
# what opens a file by its path, are left out by name; everything else counts, also what only a failing library reaches.
# Checksums of fields are not compared, as in fuzzing builds.
set -e
top=$(cd "$(dirname "$0")/../.." && pwd)
corpora=${1:-$top/tests/fuzz/corpus}
build=$top/build/coverage
tool() { command -v "$1" || command -v "$1-14" || command -v "$1-19" || { echo "coverage.sh: no $1" >&2 && exit 1; }; }
profdata=$(tool llvm-profdata)
cov=$(tool llvm-cov)
targets="wire_frame wire_server wire_client wire_profile field tile mesh capture rig plan profile_store drive_map board_image image transforms colmap stanford features pairs masks places gains response grade cube icc film run_record api lumid_answer"

cmake -S "$top" -B "$build" -G Ninja -DCMAKE_C_COMPILER=clang -DCMAKE_BUILD_TYPE=Debug -DCMAKE_C_FLAGS="\
-fprofile-instr-generate -fcoverage-mapping -DFUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION=1" >"$build.log" 2>&1 ||
    { mkdir -p "$top/build" && cat "$build.log" >&2 && exit 1; }
# shellcheck disable=SC2046
cmake --build "$build" -t $(printf 'fuzz_%s ' $targets) >"$build.log"

objects=
for target in $targets; do
    LLVM_PROFILE_FILE="$build/fuzz_$target.profraw" "$build/tests/fuzz/fuzz_$target" "$corpora/fuzz_$target" >&2
    objects="$objects -object $build/tests/fuzz/fuzz_$target"
done
"$profdata" merge -o "$build/fuzz.profdata" "$build"/fuzz_*.profraw

printf '%-12s %-42s %6s %6s %7s\n' reader file lines run share
while read -r reader file leave_out; do
    case $reader in '' | '#'*) continue ;; esac
    # shellcheck disable=SC2086
    "$cov" report ${objects# -object } -instr-profile "$build/fuzz.profdata" -show-functions "$top/$file" |
        awk -v reader="$reader" -v file="$file" -v out="^($leave_out)\$" '
            /^TOTAL|^Name|^---|^File|^$/ { next }
            { sub(/^.*:/, "", $1) }
            $1 !~ out { lines += $5; missed += $6 }
            END { print reader, file, lines, lines - missed }'
done <"$top/tests/fuzz/readers.txt" | awk '
    function show(a, b, n, r) { printf "%-12s %-42s %6d %6d %6.1f%%\n", a, b, n, r, 100 * r / n }
    $1 != last { if (last != "") show(last, "(all)", n, r); last = $1; n = r = 0 }
    { show($1, $2, $3, $4); n += $3; r += $4 }
    END { show(last, "(all)", n, r) }'
