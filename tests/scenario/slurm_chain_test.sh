#!/bin/sh
# slurm_chain_test.sh LUMI: all stages, both phases, on a real Slurm: a rig's capture with brackets, whose second phase has
# views that nobody knows of when the jobs are handed over. slurmctld, the process that hands over, tasks and their
# programs killed in either phase, jobs taken back, calibration thrown away and made again: the same bytes as here.
lumi=$1
# shellcheck source=tests/scenario/expect.sh
. "$(dirname "$0")/expect.sh"
# shellcheck source=tests/scenario/slurm_cluster.sh
. "$(dirname "$0")/slurm_cluster.sh"
missing=$(cluster_missing)
if [ -n "$missing" ]; then
    echo "slurm_chain_test: skipped: $missing"
    exit 77
fi
cd "$scratch" || exit 1
trap 'cluster_stop; chmod -R u+w "$scratch"; rm -rf "$scratch"' EXIT
cluster_start "$scratch/cluster"
same() { cmp -s "$1" "$2" || fail "$1 and $2 differ: $3"; }
state() { # STAGE: its line of status, without the spaces between
    "$lumi" status a -w w | sed -n "s/^$1 \{1,\}//p" | tr -s ' '
}
holding() { pgrep -f "^/bin/sh $scratch/slow stage $1 " >/dev/null; }

"$lumi" sim shoot room --rig arc:4x9:0.2 --size 160x128 --pose-error 2,0.2 --brackets -2,0,2 -o a -j 2 >/dev/null ||
    fail "no capture"
options="--response estimate --calibrate yes --equalize yes --synthesize yes --subsample yes --prefilter 4 --cluster 8"
"$lumi" process a -o here.lumi -w here $options -j 2 >/dev/null || fail "process"

# A stand-in for lumi that waits before a stage for a file to go, and notes what it was given.
cat >slow <<SLOW
#!/bin/sh
echo "\$SLURM_CPUS_PER_TASK \$*" >>"$scratch/given"
while [ -e "$scratch/hold-\$2" ]; do sleep 0.05; done
exec "$lumi" "\$@"
SLOW
chmod +x slow

# In the first phase: the process that hands over is killed, then slurmctld; then the jobs are taken back.
touch hold-pairs hold-geometry
"$lumi" process a -o there.lumi -w w $options --engine slurm --every 1 --chunk 6 --command "$scratch/slow" \
    --slurm match:cpus-per-task=2 &
waiting=$!
await "tasks of pairs" holding pairs
kill -9 $waiting
wait $waiting 2>/dev/null
expect 0 "under way" "$lumi" status a -w w
case $(state features) in "36 36 36 "*) ;; *) fail "features: $(state features)" ;; esac
case $(state geometry) in "? 0 0 "*) ;; *) fail "geometry, before anybody can know: $(state geometry)" ;; esac
expect 1 "in Slurm's queue" "$lumi" process a -o there.lumi -w w $options
cluster_ctld_kill
cluster_ctld_start
await "slurmctld" answers
expect 0 "under way" "$lumi" status a -w w
scancel -u root
await "an empty queue" idle
rm hold-pairs
expect 0 "'lumi retry' goes on with it" "$lumi" status a -w w

# In the second one: a task's program, a task, slurmctld, and the process that hands over.
"$lumi" retry a -w w --every 1 &
waiting=$!
await "tasks of geometry" holding geometry
case $(state depth) in "3"[0-9]" 3"[0-9]" "*) ;; *) fail "depth: $(state depth)" ;; esac
# Both names are of this test's own scratch folder.
kill -9 "$(pgrep -f "^/bin/sh $scratch/slow stage geometry .* --share 1/" | head -1)" || fail "no task to kill"
job=$(sed -n 's/^job geometry \([0-9]*\) .*/\1/p' w/run.txt)
scancel --signal=KILL --full "${job}_2"
cluster_ctld_kill
kill -9 $waiting
wait $waiting 2>/dev/null
cluster_ctld_start
await "slurmctld" answers
rm hold-geometry
# Where it had not written down the newest tasks it has drained a computer; those tasks are held for good.
for node in n1 n2; do
    scontrol update nodename=$node state=resume 2>/dev/null
done
expect 0 "" "$lumi" retry a -w w --every 1
same here.lumi there.lumi "both phases, killed and taken back"
expect 0 "done" "$lumi" status a -w w
[ -z "$(find w -name '*.tmp-*')" ] || fail "left: $(find w -name '*.tmp-*')"

# Several images a task, as many threads as Slurm gives, once each.
grep -q "^1 stage features .* --share 6/6$" given || fail "no six shares of features: $(cat given)"
grep -q "^2 stage match " given || fail "match was not given two processors: $(grep match given)"
! grep -q -e "--threads" given || fail "threads are not left to the allocation"
[ "$(grep -c "^1 stage calibrate " given)" -eq 1 ] || fail "calibrated twice: $(grep calibrate given)"

# What calibration made is thrown away: with all that rests on it, and nothing else; it comes back, to the same bytes.
expect 0 "thrown away" "$lumi" clear a calibrate -w w --yes
case $(state pairs) in "36 36 36 "*) ;; *) fail "pairs, after clearing: $(state pairs)" ;; esac
[ ! -e w/equiangular ] && [ ! -e w/compress ] || fail "clear calibrate: $(ls w)"
rm there.lumi given
expect 0 "" "$lumi" retry a -w w --every 1
same here.lumi there.lumi "calibrated again"
! grep -q "stage pairs" given || fail "what was there was handed over again"
idle || fail "left in the queue: $(squeue)"
echo "slurm_chain_test: passed"
