#!/bin/sh
# verify_test.sh LUMI MAKE_CAPTURE: `lumi verify` as a person uses it, and our bags under an independent checker.
lumi=$1
make=$2
here=$(dirname "$0")
# shellcheck source=tests/scenario/expect.sh
. "$(dirname "$0")/expect.sh"

"$make" "$scratch/a" || fail "no capture"
"$here/bagit_check.sh" "$scratch/a" || fail "the sealed capture is no BagIt bag"
if python3 -c "import bagit" 2>/dev/null; then
    python3 -c "import bagit, sys; bagit.Bag(sys.argv[1]).validate()" "$scratch/a" || fail "bagit.py finds no valid bag"
fi
expect 0 "a: whole, sealed: 16 files" "$lumi" verify "$scratch/a"
expect 0 '"whole":true' "$lumi" verify --json "$scratch/a"
seal=$(sha256sum <"$scratch/a/tagmanifest-sha256.txt" | cut -d ' ' -f 1)
expect 0 "seal: $seal" "$lumi" verify "$scratch/a"
expect 0 "\"seal\":\"$seal\"" "$lumi" verify --json "$scratch/a"
cp -r "$scratch/a" "$scratch/b"
"$here/bagit_check.sh" "$scratch/b" || fail "a copy is no BagIt bag"

printf x >>"$scratch/b/data/frames/c01-0002.jpg"
rm "$scratch/b/data/frames/c02-0003.jpg"
"$here/bagit_check.sh" "$scratch/b" 2>/dev/null && fail "the checker takes a damaged bag for a good one"
expect 3 "data/frames/c01-0002.jpg: has " "$lumi" verify "$scratch/b"
expect 3 "data/frames/c02-0003.jpg: is missing" "$lumi" verify "$scratch/b"
expect 3 '"problem":"is missing"' "$lumi" verify --json "$scratch/b"
expect 3 "$scratch/none: open capture: No such file" "$lumi" verify "$scratch/none"
expect 3 "no capture" "$lumi" verify "$scratch"
expect 2 "usage" "$lumi" verify
echo "verify_test: passed"
