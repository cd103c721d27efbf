#!/bin/sh
# slurm_test.sh LUMI: a capture processed by a real Slurm: the same bytes as here; tasks, the process that hands over and
# slurmctld killed; jobs taken back; clearing.
lumi=$1
# shellcheck source=tests/scenario/expect.sh
. "$(dirname "$0")/expect.sh"
# shellcheck source=tests/scenario/slurm_cluster.sh
. "$(dirname "$0")/slurm_cluster.sh"
missing=$(cluster_missing)
if [ -n "$missing" ]; then
    echo "slurm_test: skipped: $missing"
    exit 77
fi
cd "$scratch" || exit 1
trap 'cluster_stop; chmod -R u+w "$scratch"; rm -rf "$scratch"' EXIT
cluster_start "$scratch/cluster"
same() { cmp -s "$1" "$2" || fail "$1 and $2 differ: $3"; }
number() { "$lumi" status a -w "$1" --json | tr -d '\n' | sed "s/.*\"stage\" : \"$2\"[^}]*\"$3\" : \([0-9]*\).*/\1/"; }

"$lumi" sim shoot room --rig planar:2x3:0.03 --size 100x70 --fov 60 -o a -j 2 >/dev/null || fail "no capture"
options="--cluster 4 --neighbours 4"
slurm="--engine slurm --every 1 --chunk 3"
"$lumi" process a -o here.lumi -w here $options -j 2 >/dev/null || fail "process"

# The same bytes, in shares of two images; what is there is handed over no more.
"$lumi" process a -o there.lumi -w there $options $slurm --slurm partition=p --slurm depth:nice=1 ||
    fail "process on the cluster: $(cat there/slurm/*.log)"
same here.lumi there.lumi "here and on the cluster"
expect 0 "done" "$lumi" status a -w there
[ "$(grep -c '^job ' there/run.txt)" -ge 6 ] || fail "jobs are not recorded: $(cat there/run.txt)"
"$lumi" process a -o there.lumi -w there $options $slurm || fail "process, nothing to do"
! grep -q '^job ' there/run.txt || fail "what was there was handed over again"

# A stand-in for lumi that waits before a stage for a file to go, so that something can happen in the middle of a task.
cat >slow <<SLOW
#!/bin/sh
while [ "\$2" = depth ] && [ -e "$scratch/hold" ]; do sleep 0.05; done
exec "$lumi" "\$@"
SLOW
chmod +x slow

# A share whose program is killed is tried again by its task; one whose task is killed, by the process that waits.
touch hold
"$lumi" process a -o killed.lumi -w killed $options $slurm --command "$scratch/slow" &
waiting=$!
holding() { pgrep -f "^/bin/sh $scratch/slow stage depth" >/dev/null; }
await "tasks of depth" holding
# Both names are of this test's own scratch folder.
kill -9 "$(pgrep -f "^/bin/sh $scratch/slow stage depth .* --share 1/2" | head -1)" || fail "no task to kill"
job=$(sed -n 's/^job depth \([0-9]*\) .*/\1/p' killed/run.txt)
scancel --signal=KILL --full "${job}_2"
expect 1 "another process is handing over" "$lumi" retry a -w killed
rm hold
wait $waiting || fail "not finished after kills: $(cat killed/slurm/*.log)"
same here.lumi killed.lumi "killed tasks"
grep -qi killed killed/slurm/depth-1.log || fail "nothing was killed: $(cat killed/slurm/depth-1.log)"

# The process that hands over is killed, slurmctld too, and then the jobs are taken back. Nothing of that is lost.
touch hold
"$lumi" process a -o left.lumi -w left $options $slurm --command "$scratch/slow" &
waiting=$!
await "tasks of depth" holding
kill -9 $waiting
wait $waiting 2>/dev/null
expect 1 "in Slurm's queue" "$lumi" process a -o left.lumi -w left $options $slurm
expect 1 "in Slurm's queue" "$lumi" process a -o left.lumi -w left $options
expect 1 "in Slurm's queue" "$lumi" clear a -w left --yes
expect 0 "under way" "$lumi" status a -w left
[ "$(number left equiangular done)" = 6 ] || fail "status counts $(number left equiangular done) of 6"
[ "$(number left depth tasks_running)" -ge 1 ] || fail "status sees no task run"
cluster_ctld_kill
expect 0 "squeue" "$lumi" status a -w left
cluster_ctld_start
await "slurmctld" answers
expect 0 "under way" "$lumi" status a -w left
scancel -u root
await "an empty queue" idle
rm hold
expect 0 "'lumi retry' goes on with it" "$lumi" status a -w left
[ ! -e left.lumi ] || fail "a field of a run that was taken back"
expect 0 "" "$lumi" retry a -w left --every 1 --command "$lumi"
same here.lumi left.lumi "a killed hand-over, jobs taken back"

# What cannot be done is said by the task that cannot do it, in one line.
expect_line 1 "equiangular share 1: false: no" "$lumi" process a -o no.lumi -w bad $options $slurm \
    --retries 0 --command "sh -c 'test \$1 != equiangular || { echo false: no >&2; exit 1; }; exec $lumi stage \$@' "
expect 0 "equiangular share 1: false: no" "$lumi" status a -w bad
expect_line 1 "nvalid" "$lumi" process a -o no.lumi -w none $options $slurm --slurm partition=none
expect_line 2 "NAME=VALUE" "$lumi" process a -o no.lumi -w none $options $slurm --slurm --x
expect_line 2 "is for --engine slurm" "$lumi" process a -o no.lumi -w none $options --chunk 3
[ ! -e no.lumi ] || fail "a field out of nothing"
idle || fail "left in the queue: $(squeue)"
echo "slurm_test: passed"
