#!/bin/sh
# bagit_check.sh BAG: is this directory a valid BagIt bag? Written from RFC 8493 alone, with nothing of ours in it, so that
# what we seal is judged by something else: coreutils do the checksums. Says what is wrong, status 1; nothing, status 0.
bag=$1
bad=0
wrong() {
    echo "$bag: $1" >&2
    bad=1
}
cd "$bag" || exit 1

# Section 2.1.1: bagit.txt consists of exactly two lines.
[ "$(wc -l <bagit.txt)" -eq 2 ] || wrong "bagit.txt does not have two lines"
sed -n 1p bagit.txt | grep -Eqx 'BagIt-Version: [0-9]+\.[0-9]+' || wrong "no BagIt-Version"
sed -n 2p bagit.txt | grep -Eqx 'Tag-File-Character-Encoding: UTF-8' || wrong "no encoding"

# Section 2.1.2: the payload directory. Section 2.1.3: one manifest or more, each listing every payload file once.
[ -d data ] || wrong "no data/"
[ -f manifest-sha256.txt ] || wrong "no manifest"
grep -Evq '^[0-9a-f]{64}  data/[^ ]' manifest-sha256.txt && wrong "a line of the manifest is malformed"
grep -q '\.\./' manifest-sha256.txt && wrong "a path of the manifest leads out of the bag"
listed=$(sed 's/^[0-9a-f]*  //' manifest-sha256.txt | LC_ALL=C sort)
present=$(find data -type f | LC_ALL=C sort)
[ "$listed" = "$present" ] || wrong "the manifest does not list the payload, each file once"
sha256sum --quiet --strict -c manifest-sha256.txt || wrong "a payload file does not match its checksum"
[ -z "$(find data ! -type f ! -type d)" ] || wrong "the payload holds more than files and directories"

# Section 2.2.1: the tag manifest lists tag files only, not itself, and all the manifests.
if [ -f tagmanifest-sha256.txt ]; then
    sha256sum --quiet --strict -c tagmanifest-sha256.txt || wrong "a tag file does not match its checksum"
    grep -Eq '  (data/|tagmanifest-)' tagmanifest-sha256.txt && wrong "the tag manifest lists what it must not"
    grep -q '  manifest-sha256.txt$' tagmanifest-sha256.txt || wrong "the tag manifest does not list the manifest"
fi

# Section 2.2.2: bag-info.txt is made of "label: value" lines; Payload-Oxum is octets.streams.
if [ -f bag-info.txt ]; then
    grep -Evq '^([^:[:space:]][^:]*: .*|[[:space:]]+.*)$' bag-info.txt && wrong "a line of bag-info.txt is malformed"
    oxum=$(sed -n 's/^Payload-Oxum: //p' bag-info.txt)
    octets=$(find data -type f -exec cat {} + | wc -c)
    streams=$(find data -type f | wc -l)
    [ "$oxum" = "$octets.$streams" ] || wrong "Payload-Oxum $oxum, found $octets.$streams"
    date=$(sed -n 's/^Bagging-Date: //p' bag-info.txt)
    [ -z "$date" ] || echo "$date" | grep -Eqx '[0-9]{4}-[0-9]{2}-[0-9]{2}' || wrong "Bagging-Date $date"
fi
exit $bad
