#!/bin/bash
# Manual pages and completion name every command and every option that `lumi help` shows, and are well-formed.
# usage: manual.sh LUMI FOLDER_OF_PAGES
set -eu
lumi=$1 pages=$2
plain() {
    sed 's/\\f.//g; s/\\-/-/g' "$1"
}
fail() {
    echo "$*"
    exit 1
}

"$lumi" help | awk '/^commands:/ { on = 1; next } !NF { on = 0 } on' | sed 's/^  \([a-z ]*[a-z]\)  .*/\1/' >names.txt
[ -s names.txt ] || fail "no commands in lumi help"
bash -n "$pages/lumi.bash"
# shellcheck disable=SC1091
. "$pages/lumi.bash"
complete_line() { # WORD...: what bash offers for the last one
    COMP_WORDS=("$@") COMP_CWORD=$(($# - 1)) COMPREPLY=()
    _lumi
    printf '%s\n' "${COMPREPLY[@]}"
}

while read -r name; do
    page=$pages/lumi-${name// /-}.1
    [ -s "$page" ] || fail "$page is missing"
    plain "$page" >page.txt
    plain "$pages/lumi.1" >whole.txt
    grep -qF "lumi $name" page.txt || fail "$page does not name $name"
    grep -qx ".SS $name" whole.txt || fail "lumi.1 does not name $name"
    # shellcheck disable=SC2086
    set -- $name
    complete_line lumi "$1" >offered.txt
    complete_line lumi "" | grep -qx -e "$1" || fail "completion does not offer $1"
    [ $# -lt 2 ] || complete_line lumi "$1" "" | grep -qx -e "$2" || fail "completion does not offer $name"
    [ $# -lt 3 ] || complete_line lumi "$1" "$2" "" | grep -qx -e "$3" || fail "completion does not offer $name"
    complete_line lumi "$@" - >offered.txt
    # shellcheck disable=SC2086
    for option in $("$lumi" help $name | grep -oE '^  (-., )?--[a-z0-9-]+' | sed 's/.* //'); do
        grep -qx -e "$option" offered.txt || fail "completion of $name does not offer $option"
        [ "$option" = --help ] || grep -qE -e "$option(=|\$)" page.txt || fail "$page does not name $option"
        [ "$option" = --help ] || grep -qE -e "$option(=|\$)" whole.txt || fail "lumi.1 does not name $option"
    done
done <names.txt

if command -v groff >/dev/null; then
    for page in "$pages"/*.1; do
        groff -k -man -Tutf8 -ww -z "$page" 2>said.txt
        [ ! -s said.txt ] || fail "$page: $(cat said.txt)"
    done
fi
