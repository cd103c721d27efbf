#!/bin/sh
# lumid(8) has every option of `lumid --help`, lumid.conf(5) every key of `lumid --print-config`; both are well-formed; the
# commented file is what the program takes.
# usage: lumid_manual.sh LUMID LUMID.8 LUMID.CONF.5
set -eu
lumid=$1 page=$2 keys=$3
fail() {
    echo "$*"
    exit 1
}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
sed 's/\\-/-/g; s/\\f.//g; s/\\&//g' "$page" >"$work/page"
sed 's/\\-/-/g; s/\\&//g' "$keys" >"$work/keys"
"$lumid" --help | grep -oE -e '--[a-z-]+' | sort -u >"$work/options"
[ -s "$work/options" ] || fail "no options"
while read -r option; do
    grep -qE -e "$option( |\$)" "$work/page" || fail "$page does not name $option"
done <"$work/options"
grep -oE -e '--[a-z-]+' "$work/page" | sort -u | while read -r option; do
    grep -qx -e "$option" "$work/options" || fail "$page names $option, which is none"
done
"$lumid" --print-config >"$work/conf"
[ "$(grep -cE '^#?[a-z_]+ = ' "$work/conf")" -gt 50 ] || fail "--print-config prints few keys"
sed -nE 's/^#?([a-z_]+) = .*/\1/p' "$work/conf" | while read -r key; do
    grep -qx -e ".B $key" "$work/keys" || fail "$keys does not name $key"
done
sed -nE 's/^#?\[([a-z]+).*/\1/p' "$work/conf" | while read -r group; do
    grep -q -e "^.SH \"\[$group" "$work/keys" || fail "$keys does not name [$group]"
done
if command -v groff >/dev/null; then
    for one in "$page" "$keys"; do
        groff -k -man -Tutf8 -ww -z "$one" 2>"$work/said"
        [ ! -s "$work/said" ] || fail "$one: $(cat "$work/said")"
    done
fi
