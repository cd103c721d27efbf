#!/bin/sh
# engine_chain_test.sh LUMI: all stages on this computer with what goes wrong there: a disk that fills in the middle of
# stage after stage, little memory, Ctrl-C. Each time one line, and the same bytes when it goes on.
lumi=$1
# shellcheck source=tests/scenario/expect.sh
. "$(dirname "$0")/expect.sh"
cd "$scratch" || exit 1
mounted=
trap '[ -z "$mounted" ] || umount "$mounted"; chmod -R u+w "$scratch"; rm -rf "$scratch"' EXIT
same() { cmp -s "$1" "$2" || fail "$1 and $2 differ: $3"; }

"$lumi" sim shoot room --rig arc:4x9:0.2 --size 160x128 --pose-error 2,0.2 --brackets -2,0,2 -o a -j 2 >/dev/null ||
    fail "no capture"
options="--response estimate --calibrate yes --equalize yes --synthesize yes --subsample yes --prefilter 4 --cluster 8"
"$lumi" process a -o here.lumi -w here $options -j 2 >/dev/null || fail "process"

# Little memory: Slurm's allocation stands for it. Fewer images at once, said once a stage; the same bytes.
SLURM_JOB_ID=1 SLURM_MEM_PER_NODE=2 SLURM_CPUS_PER_TASK=2 "$lumi" process a -o little.lumi -w little $options -j 2 \
    >little.log 2>little.said || fail "little memory: $(cat little.said)"
for stage in merge features equiangular; do
    [ "$(grep -c "^lumi: $stage: 1 images at once instead of 2: .*(Slurm)" little.said)" -eq 1 ] ||
        fail "$stage does not say that memory is short: $(cat little.said)"
done
same here.lumi little.lumi "little memory"
rm -r little

# Ctrl-C, in the middle of a stage of either phase.
for stage in pairs depth; do
    "$lumi" process a -o stopped.lumi -w stopped $options -j 2 >stopped.log 2>&1 &
    running=$!
    until [ -n "$(find stopped/$stage -name '*.key' 2>/dev/null | head -1)" ]; do
        kill -0 $running 2>/dev/null || fail "over before $stage: $(cat stopped.log)"
        sleep 0.02
    done
    # A shell starts what is in the background deaf to SIGINT; SIGTERM is as good, and sent likewise.
    kill -TERM $running
    wait $running && fail "not stopped"
    [ ! -e stopped.lumi ] || fail "a field of a run that was stopped"
done
expect 0 "" "$lumi" process a -o stopped.lumi -w stopped $options -j 2
same here.lumi stopped.lumi "stopped and gone on with"
[ -z "$(find stopped -name '*.tmp-*')" ] || fail "left: $(find stopped -name '*.tmp-*')"
rm -r stopped

# A disk with room for ever more of it: one line that names the file, nothing begun left; with more room it goes on.
needed=$(du -sk here | cut -f1)
mkdir small
if [ "$(id -u)" -ne 0 ] || ! mount -t tmpfs -o size=16k none small 2>/dev/null; then
    echo "engine_chain_test: no full disk: this test may not mount"
else
    mounted=$scratch/small
    full=0
    for percent in 5 20 35 50 65 80 95; do
        mount -o remount,size=$((needed * percent / 100))k "$mounted" || fail "remount"
        expect_line 1 "small/w/" "$lumi" process a -o small.lumi -w small/w $options -j 2
        echo "$out" | grep -q "No space left" || fail "full at $percent %: $out"
        echo "room for $percent %: $out"
        [ -z "$(find small -name '*.tmp-*')" ] || fail "left on a full disk: $(find small -name '*.tmp-*')"
        full=$((full + 1))
    done
    mount -o remount,size=$((needed * 2))k "$mounted" || fail "remount"
    expect 0 "" "$lumi" process a -o small.lumi -w small/w $options -j 2
    same here.lumi small.lumi "a disk that was full $full times"
    umount "$mounted" && mounted=
fi
echo "engine_chain_test: passed"
