# A Slurm cluster of two computers on this one, for tests; read in with `.` after expect.sh. Everything lies in a folder
# of the test's own; ports are free ones.

# Why there can be none here; empty: there can.
cluster_missing() {
    if [ "$(id -u)" -ne 0 ]; then
        echo "not root"
        return
    fi
    for program in munged slurmctld slurmd sbatch squeue scancel; do
        command -v $program >/dev/null || { echo "no $program (Debian: slurm-wlm, munge)" && return; }
    done
}

cluster_conf() { # DIR PORT
    host=$(hostname -s)
    cat <<CONF
ClusterName=lumitest
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$2
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$1/munge/socket
CredType=cred/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
ReturnToService=2
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
StateSaveLocation=$1/state
SlurmdSpoolDir=$1/spool_%n
SlurmctldPidFile=$1/run/slurmctld.pid
SlurmdPidFile=$1/run/%n.pid
SlurmctldLogFile=$1/slurmctld.log
SlurmdLogFile=$1/%n.log
SchedulerType=sched/backfill
SchedulerParameters=batch_sched_delay=0,sched_min_interval=0,bf_interval=1
MpiDefault=none
SlurmdParameters=config_overrides
KillWait=1
NodeName=n1 NodeHostname=$host NodeAddr=127.0.0.1 Port=$(($2 + 1)) CPUs=2 RealMemory=8000 State=UNKNOWN
NodeName=n2 NodeHostname=$host NodeAddr=127.0.0.1 Port=$(($2 + 2)) CPUs=2 RealMemory=8000 State=UNKNOWN
PartitionName=p Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
CONF
}

# Three neighbouring ports that nobody listens on: column 2 of /proc/net/tcp is ADDRESS:PORT in hexadecimal.
free_ports() {
    port=$((20000 + $$ % 20000))
    while cat /proc/net/tcp /proc/net/tcp6 2>/dev/null |
        grep -qiE ":$(printf '(%04X|%04X|%04X)' $port $((port + 1)) $((port + 2))) "; do
        port=$((port + 3))
    done
    echo $port
}

stop_by() { # PIDFILE
    [ ! -s "$1" ] || kill "$(cat "$1")" 2>/dev/null
}

cluster_ctld_start() {
    slurmctld -f "$SLURM_CONF" || fail "slurmctld does not start: $(cat "$cluster/slurmctld.log")"
}

await() { # WHAT COMMAND...: until it succeeds, a minute at most
    what=$1
    shift
    tries=0
    until "$@"; do
        tries=$((tries + 1))
        [ $tries -lt 1200 ] || fail "waited for nothing: $what; $(squeue -r 2>&1)"
        sleep 0.05
    done
}
answers() { squeue -h >/dev/null 2>&1; }
idle() { [ -z "$(squeue -h)" ]; }

# What it has not written down it forgets: job numbers would be given twice, and Slurm drains computers that see that.
# It writes some seconds after a change.
cluster_ctld_kill() {
    touch "$cluster/mark"
    scontrol update jobid="$(squeue -h -t PD -o %A | head -1)" comment=x
    tries=0
    until [ "$cluster/state/job_state" -nt "$cluster/mark" ]; do
        tries=$((tries + 1))
        [ $tries -lt 600 ] || fail "slurmctld does not write its state"
        sleep 0.05
    done
    kill -9 "$(cat "$cluster/run/slurmctld.pid")"
    rm -f "$cluster/run/slurmctld.pid"
}

cluster_stop() {
    for pid in "$cluster"/run/*.pid "$cluster"/munge/pid; do
        stop_by "$pid"
    done
}

# Sets $cluster and SLURM_CONF; the caller's trap calls cluster_stop.
cluster_start() { # DIR
    cluster=$1
    mkdir -p "$cluster/state" "$cluster/run" "$cluster/spool_n1" "$cluster/spool_n2" "$cluster/munge"
    chmod 755 "$cluster"
    chmod 700 "$cluster/munge"
    head -c 1024 /dev/urandom >"$cluster/munge/key"
    chmod 600 "$cluster/munge/key"
    munged --force --key-file="$cluster/munge/key" --socket="$cluster/munge/socket" --pid-file="$cluster/munge/pid" \
        --log-file="$cluster/munge/log" --seed-file="$cluster/munge/seed" || fail "munged does not start"
    cluster_conf "$cluster" "$(free_ports)" >"$cluster/slurm.conf"
    export SLURM_CONF="$cluster/slurm.conf"
    cluster_ctld_start
    slurmd -f "$SLURM_CONF" -N n1 && slurmd -f "$SLURM_CONF" -N n2 || fail "slurmd does not start: $(cat "$cluster"/n*.log)"
    tries=0
    until [ "$(sinfo -h -o %t%D 2>/dev/null)" = idle2 ]; do
        tries=$((tries + 1))
        [ $tries -lt 150 ] || fail "the cluster is not ready: $(sinfo 2>&1)"
        sleep 0.2
    done
}
