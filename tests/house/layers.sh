#!/bin/sh
# Fails when a folder includes what it may not, or its CMakeLists.txt uses what it may not (layers.txt has the table).
# usage: layers.sh ROOT TABLE
set -eu
root=$1 table=$2

cd "$root"
files=$(find proto render pipeline sim cli daemon firmware \( -name '*.[ch]' -o -name '*.cc' -o -name CMakeLists.txt \) \
    2>/dev/null | sort)
# shellcheck disable=SC2086
exec awk '
function folder_of(path,   parts, n, i, best, at) {
    # the longest folder of the table that the path lies in
    best = ""; at = ""
    n = split(path, parts, "/")
    for (i = 1; i < n; i++) {
        at = at (i > 1 ? "/" : "") parts[i]
        if (at in known)
            best = at
    }
    return best
}
function complain(text) {
    printf "%s:%d: %s\n", FILENAME, FNR, text
    bad++
}
function matches(name, pattern,   stem) {
    if (pattern ~ /\*$/) {
        stem = substr(pattern, 1, length(pattern) - 1)
        return substr(name, 1, length(stem)) == stem
    }
    return name == pattern
}
function check_ours(folder, header,   target) {
    target = folder_of(header)
    if (target == "")
        complain("\"" header "\" is not written from the root of the repository, or its folder is not in the table")
    else if (target != folder && !((folder, target) in may))
        complain(folder " may not use " target)
}
function check_theirs(folder, header,   i) {
    if (header in c_library)
        return
    for (i = 1; i <= owned[folder]; i++)
        if (matches(header, owns[folder, i]))
            return
    complain("<" header "> is not a library of " folder)
}
BEGIN {
    n = split("assert complex ctype errno fenv float inttypes limits locale math setjmp signal stdalign stdarg " \
        "stdatomic stdbool stddef stdint stdio stdlib stdnoreturn string tgmath threads time uchar wchar wctype " \
        "dirent dlfcn fcntl fnmatch ftw getopt glob langinfo libgen poll pthread regex sched semaphore spawn strings " \
        "syslog termios unistd sys/file sys/ioctl sys/mman sys/resource sys/select sys/socket sys/stat sys/statvfs " \
        "sys/random sys/sysinfo sys/time sys/types sys/uio sys/un sys/wait immintrin arm_neon emmintrin smmintrin cpuid", names, " ")
    for (i = 1; i <= n; i++)
        c_library[names[i] ".h"] = 1
}
FILENAME == table {
    sub(/#.*/, "")
    if (NF == 0)
        next
    folder = $2
    sub(/:$/, "", folder)
    known[folder] = 1
    short = folder
    sub(/.*\//, "", short)
    if ($1 == "may") # of two folders of one name, the later of these has the short one
        long_name[short] = folder
    joined = folder
    gsub(/\//, "_", joined) # firmware/core is also firmware_core
    long_name[joined] = folder
    for (i = 3; i <= NF; i++)
        if ($1 == "may")
            may[folder, $i] = 1
        else
            owns[folder, ++owned[folder]] = $i
    next
}
FNR == 1 {
    files++
    here = folder_of(FILENAME)
    in_folder = 0
    if (here == "" && FILENAME !~ /CMakeLists.txt$/)
        complain("its folder is not in the table")
}
FILENAME ~ /CMakeLists.txt$/ {
    line = $0
    sub(/#.*/, "", line)
    gsub(/[()]/, " & ", line)
    n = split(line, words, " ")
    for (i = 1; i <= n; i++) {
        if (words[i] == "lumi_folder")
            in_folder = 1
        else if (words[i] == ")")
            in_folder = in_uses = 0
        else if (words[i] == "PKG" || words[i] == "LIBS" || words[i] == "USES")
            in_uses = words[i] == "USES"
        else if (in_folder && in_uses) {
            if (!(words[i] in long_name))
                complain("no folder " words[i] " in the table")
            else if (!((here, long_name[words[i]]) in may))
                complain(here " may not use " long_name[words[i]])
        }
    }
    next
}
/^[ \t]*#[ \t]*include[ \t]*"/ {
    split($0, parts, "\"")
    check_ours(here, parts[2])
}
/^[ \t]*#[ \t]*include[ \t]*</ {
    header = $0
    sub(/^[^<]*</, "", header)
    sub(/>.*/, "", header)
    check_theirs(here, header)
}
END {
    if (files == 0) {
        print "no files found"
        bad++
    }
    if (!bad)
        printf "%d files, every include as the table has it\n", files
    exit bad > 0
}' table="$table" "$table" $files
