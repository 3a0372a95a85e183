#!/usr/bin/env bash
# The page docs/src/reference/cluster.md on a real Slurm of one node: its code blocks as they stand, one task killed and one put back into the
# queue while they run, and the tables compared with those of one machine, byte for byte.
#
#   sudo docs/trials/slurm.sh PATH/TO/hoid [REPLICATIONS]
#
# For Debian, in a container or a virtual machine that can be thrown away: it installs slurm-wlm and writes /etc/slurm/slurm.conf.
set -euo pipefail
hoid="$(realpath "$1")"
replications="${2:-20}"
page="$(cd "$(dirname "$0")/.." && pwd)/src/reference/cluster.md"
work="$(mktemp -d)"
PATH="$(dirname "$hoid"):$PATH"
export PATH

command -v slurmctld >/dev/null || { apt-get update -q; apt-get install -y -q slurm-wlm munge; }
host="$(hostname -s)"
cat >/etc/slurm/slurm.conf <<CONF
ClusterName=trial
SlurmctldHost=$host
AuthType=auth/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
ReturnToService=2
SlurmdSpoolDir=/var/spool/slurmd
StateSaveLocation=/var/spool/slurmctld
SlurmUser=root
JobRequeue=1
MinJobAge=3600
NodeName=$host CPUs=$(nproc) State=UNKNOWN
PartitionName=trial Nodes=$host Default=YES MaxTime=INFINITE State=UP
CONF
mkdir -p /var/spool/slurmd /var/spool/slurmctld /run/munge
chown munge: /run/munge
pgrep -x munged >/dev/null || setpriv --reuid munge --regid munge --clear-groups munged
pgrep -x slurmctld >/dev/null || slurmctld
pgrep -x slurmd >/dev/null || slurmd
for _ in $(seq 30); do sinfo -h -o %T 2>/dev/null | grep -qE "idle|mixed" && break; sleep 1; done
sinfo

# The blocks of the section on Slurm: the plan, the script, the submission, the merge.
cd "$work"
awk '/^## /{on=/^## Slurm/} on && /^```sh$/{n++; f="block" n ".sh"; printf "" > f; next} /^```$/{f=""} f{print > f}' "$page"
mv block2.sh study.sh
bash block1.sh
sed -i "s/^replications = .*/replications = $replications/" plan.toml

bash block3.sh & waiting=$!
state() { scontrol show job "$1" 2>/dev/null | grep -o 'JobState=[A-Z]*' | head -1; }
for _ in $(seq 100); do job="$(squeue -h -o %A | sort -n | head -1)"; [ -n "$job" ] && break; sleep 0.2; done
job="$(squeue -h -r -o %F | head -1)"
until [ "$(state "${job}_1")" = JobState=RUNNING ]; do sleep 0.2; done
sleep 1
echo "task 1 is killed: $(scancel --signal=KILL --full "${job}_1" && echo "done")"
until [ "$(state "${job}_3")" = JobState=RUNNING ]; do sleep 0.2; done
sleep 1
echo "task 3 goes back into the queue: $(scontrol requeue "${job}_3" && echo "done")"
# A task that waits after a requeue may have a start time in the future; it is started at once.
sleep 2
scontrol update jobid="${job}_3" StartTime=now 2>/dev/null || true
wait "$waiting" || echo "sbatch --wait says that a task failed, as it did"
for k in 1 3; do echo "task $k: $(state "${job}_$k")"; done

echo "the merge before the failed task was sent again:"
if bash block4.sh; then echo "it must not have worked" >&2; exit 1; fi
rm -rf results
sbatch --wait --array=1 study.sh
bash block4.sh

hoid study run plan.toml --out alone >/dev/null
for table in fits summary cells; do cmp "alone/$table.parquet" "results/$table.parquet"; done
echo "the tables are those of one machine, byte for byte: $(find results -maxdepth 1 -name "*.parquet" | wc -l) files, $replications replications"
