#!/bin/sh
# The operator's page: every text that its scripts name is there in every language, with the same values to fill in, and
# is nowhere else; nothing is inline, nothing comes from elsewhere, files and functions keep their bounds, and all of it
# that a browser loads together under 300 kB.
# usage: page.sh FOLDER
set -eu
cd "$1"
command -v jq >/dev/null || { echo "skipped: jq is not here"; exit 77; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
bad=0
say() {
    printf '%s\n' "$*"
    bad=1
}

# Keys, each with the names in its braces: the same in all languages.
for file in texts.*.json; do
    jq -er 'to_entries[] | [.key, ([.value | scan("\\{[a-zA-Z]+\\}")] | unique | join(" "))] | join(" ")' "$file" |
        sort >"$work/$file"
    jq -e 'all(.[]; type == "string" and length > 0)' "$file" >/dev/null || say "$file: a text that is none, or empty"
    # jq keeps the last of two
    twice=$(grep -o '^ *"[^"]*": ' "$file" | sort | uniq -d)
    [ -z "$twice" ] || say "$file: twice: $twice"
done
for file in texts.*.json; do
    diff "$work/texts.en.json" "$work/$file" >"$work/differ" || say "$file against texts.en.json: $(cat "$work/differ")"
done
# A text with forms for one and for several is named without them.
cut -d' ' -f1 "$work/texts.en.json" | sort -u >"$work/each"
sed 's/\.\(one\|other\)$//' "$work/each" | sort -u >"$work/keys"
sort -u "$work/each" "$work/keys" >"$work/either"

# t("key") and data-t="key"; of t(`begin.${…}.end`) the beginning has to be there, whatever the middle is.
cat ./*.js index.html | grep -oE "([^a-zA-Z_.]t\(\"[^\"]+\"|data-t(-label)?=\"[^\"]+\")" | sed 's/^[^"]*"//; s/"$//' |
    sort -u >"$work/named"
missing=$(comm -23 "$work/named" "$work/either")
[ -z "$missing" ] || say "no text for: $missing"
cat ./*.js | grep -oE "[^a-zA-Z_.]t\(\`[^\`]+\`" | sed 's/^[^`]*`//; s/`$//; s/\$.*//' | sort -u | while read -r begin; do
    [ -z "$begin" ] || grep -qF "$begin" "$work/keys" || echo "$begin"
done >"$work/begins"
[ ! -s "$work/begins" ] || say "no text that begins with: $(cat "$work/begins")"

# What is named by nothing is no text of the page. Beginnings that are put together stand in the scripts as `begin.
grep -ohE "[\`\"][a-zA-Z]+(\.[a-zA-Z]+)*[.\"\`]" ./*.js index.html | tr -d "\`\"" | sort -u >"$work/words"
while read -r key; do
    grep -qxF -e "$key" -e "$key.other" "$work/words" "$work/named" && continue
    stem=$key
    while [ "$stem" != "${stem%.*}" ]; do
        stem=${stem%.*}
        grep -qxF "$stem." "$work/words" && continue 2
    done
    echo "$key"
done <"$work/keys" >"$work/idle"
[ ! -s "$work/idle" ] || say "texts that nothing names: $(cat "$work/idle")"

# The emergency stop's words are in index.html too: it has to speak where nothing else was loaded.
for name in sending sent away failed givenUp login; do
    text=$(jq -er ".\"estop.$name\"" texts.en.json)
    attribute=$(printf '%s' "$name" | sed 's/U/-u/')
    grep -qF " data-$attribute=\"$text\"" index.html || say "index.html: data-$attribute is not the text estop.$name"
done

# All scripts are asked for at once, not one behind the other as each names the next.
for file in *.js; do
    grep -qE "(src|href)=\"/page/$file\"" index.html || say "index.html: $file is not loaded ahead (modulepreload)"
done
for file in $(grep -oE '(src|href)="/page/[^"]*"' index.html | sed 's,.*/page/,,; s/"//'); do
    [ -f "$file" ] || say "index.html: there is no $file"
done

grep -nE '<script[^>]*>[^<]|<style|[ "]style=|[ "]on[a-z]+=|javascript:' index.html && say "index.html: something inline"
grep -nE 'innerHTML|outerHTML|insertAdjacentHTML|document\.write|eval\(|new Function' ./*.js && say "markup or code from text"
grep -nE 'https?://' ./*.js ./*.css index.html | grep -v 'http://www.w3.org/' && say "another host"

awk '
FNR == 1 { if (lines > 600) { print last ": over 600 lines"; bad = 1 } }
{ last = FILENAME; lines = FNR }
/^(export )?(async )?function / { name = $0; start = FNR }
/^}/ && start { if (FNR - start + 1 > 60) { print FILENAME ": " name " over 60 lines"; bad = 1 } start = 0 }
END { if (lines > 600) { print last ": over 600 lines"; bad = 1 } exit bad }' ./*.js ./*.css || bad=1

# What a browser loads: one language, the longest.
size=$(cat ./*.html ./*.js ./*.css ./*.svg | wc -c)
text=$(wc -c texts.*.json | awk '$2 ~ /json/ && $1 > most { most = $1 } END { print most }')
[ $((size + text)) -lt 300000 ] || say "the page has $((size + text)) bytes, 300000 are the bound"
exit $bad
