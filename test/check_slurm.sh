# check_slurm.sh BUILD -- apps/farm/slurm.sh under a real Slurm: its controller and one node, started here for the time
# of the check, without accounts (auth/none). One part is killed with its render under way, one is queued again by the
# scheduler's command; the picture then has to be the one of a single render. Then apps/farm/parallel.sh the same way.
set -eu
build=$(cd "$1" && pwd)
root=$(pwd)
# What is missing is said before anything is made or queued.
bare=$(mktemp -d)
ln -s "$(command -v sh)" "$(command -v dirname)" "$bare/"
refuses() { # PART COMMAND...
    part=$1
    shift
    said=$(cd "$bare" && "$@" "$root/scenes/one-spot.xml" 4 2 out.exr 2>&1) && said='nothing, and exits with 0'
    case $said in *"$part"*) ;; *) echo "check-slurm: expected $part, not: $said" >&2; exit 1 ;; esac
    [ ! -e "$bare/out.exr.parts" ] || { echo "check-slurm: $part, but a folder was made" >&2; exit 1; }
}
refuses "no sbatch" env PATH="$bare" sh "$root/apps/farm/slurm.sh"
refuses "GNU parallel is not" env PATH="$bare" sh "$root/apps/farm/parallel.sh"
touch "$bare/parallel" && chmod +x "$bare/parallel"
refuses "no render-cli;" env PATH="$bare" sh "$root/apps/farm/parallel.sh"
rm -r "$bare"

for program in slurmctld slurmd sbatch parallel; do
    command -v $program >/dev/null || { echo "check-slurm: skipped: no $program"; exit 77; }
done
[ "$(id -u)" -eq 0 ] || { echo "check-slurm: skipped: a node's daemon has to be root"; exit 77; }
work=$(mktemp -d)
export SLURM_CONF="$work/slurm.conf" RENDER_CLI="$build/render-cli" BRUME_CACHE_DIR="$work/cache"
mkdir "$work/state" "$work/spool"
host=$(hostname -s)
cat >"$SLURM_CONF" <<END
ClusterName=check
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=16817
SlurmdPort=16818
AuthType=auth/none
CredType=cred/none
AuthInfo=cred_expire=3
SlurmUser=root
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
ReturnToService=2
JobRequeue=1
SchedulerType=sched/backfill
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
NodeName=$host NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=fog Nodes=$host Default=YES State=UP
END
fail() {
    echo "check-slurm: $1" >&2
    tail -n 5 "$work"/*.log "$work"/*.parts/*.log >&2 2>/dev/null || :
    exit 1
}
slurmctld -D 2>/dev/null & controller=$!
slurmd -D -N "$host" 2>/dev/null & node=$!
trap 'kill $node $controller 2>/dev/null; wait 2>/dev/null; rm -rf "$work"' EXIT
for _ in $(seq 60); do
    [ "$(sinfo -h -o %T 2>/dev/null)" = idle ] && break
    sleep 0.5
done
[ "$(sinfo -h -o %T 2>/dev/null)" = idle ] || fail "the node is not up"

scene=$root/scenes/ladder/slats.xml
cd "$work"
options="-D width=160 -D height=100 --checkpoint-interval 0.2"
"$RENDER_CLI" "$scene" -D width=160 -D height=100 --spp 4096 -o whole.png -o whole.exr
# shellcheck disable=SC2086
last=$("$root/apps/farm/slurm.sh" "$scene" 4096 3 "$work/farm.exr" $options)

# The first part's render is killed once it has a checkpoint; the second part is queued again by a command.
kill_part() {
    for _ in $(seq 400); do
        pid=$(pgrep -f "part-$1.state" | while read -r p; do
            [ "$(cat "/proc/$p/comm" 2>/dev/null)" = render-cli ] && echo "$p"; done | head -n 1)
        if [ -n "$pid" ] && [ -e "farm.exr.parts/part-$1.state" ]; then
            case $2 in
            kill) kill -9 "$pid" ;;
            requeue) scontrol requeue "$((last - 1))_$1" ;;
            esac
            return 0
        fi
        sleep 0.1
    done
    fail "part $1 was over before it could be stopped"
}
kill_part 0 kill
kill_part 1 requeue
for _ in $(seq 600); do
    [ -z "$(squeue -h)" ] && break
    sleep 0.5
done
[ -e farm.exr ] || fail "no picture"
grep -q 'queued again' farm.exr.parts/part-0.log || fail "the killed part was not queued again"
restarts=$(scontrol show job "$((last - 1))" | grep -o 'Restarts=[1-9]' | wc -l)
[ "$restarts" -eq 2 ] || fail "$restarts parts were started twice, instead of 2"
"$RENDER_CLI" merge farm.exr.parts/part-*.state -o farm.png
cmp whole.png farm.png || fail "the picture is another one"
echo "check-slurm: three parts, one killed and one queued again: the picture is the same"

# shellcheck disable=SC2086
"$root/apps/farm/parallel.sh" "$scene" 96 3 "$work/parallel.exr" $options -q
"$RENDER_CLI" merge parallel.exr.parts/part-*.state -o parallel.png
"$RENDER_CLI" "$scene" -D width=160 -D height=100 --spp 96 -o whole.png
cmp whole.png parallel.png || fail "the picture of parallel.sh is another one"
echo "check-slurm: GNU parallel: the picture is the same"
