#!/bin/sh
# slurm.sh -- one picture by many machines under Slurm: an array of jobs, each of which renders a range of the samples,
# and a job after all of them that adds them up.
#     apps/farm/slurm.sh SCENE.xml SAMPLES PARTS OUT.exr [options of render-cli]
# Environment: RENDER_CLI, the program (render-cli); SBATCH_FLAGS, more for sbatch (--partition=fog --time=60).
# The parts lie in OUT.exr.parts until somebody removes them; all machines have to see that folder. Prints the number of
# the last job. Given again after a failure, the same command renders what is missing.
set -eu
[ $# -ge 4 ] || { sed -n 's/^#     /usage: /p' "$0" >&2; exit 2; }
scene=$1 samples=$2 parts=$3 out=$4
shift 4
here=$(dirname "$0")
case $samples$parts in *[!0-9]*) echo "slurm.sh: SAMPLES and PARTS are numbers" >&2; exit 2 ;; esac
[ "$parts" -ge 1 ] && [ "$parts" -le "$samples" ] || { echo "slurm.sh: 1 to $samples parts" >&2; exit 2; }
command -v sbatch >/dev/null || { echo "slurm.sh: no sbatch; this runs where Slurm is installed" >&2; exit 1; }
mkdir -p "$out.parts"
# --open-mode: what a part said before it was queued again stays in its log.
# shellcheck disable=SC2086 # flags are words
array=$(sbatch --parsable --array="0-$((parts - 1))" --requeue --open-mode=append --job-name="$(basename "$out")" \
    --output="$out.parts/part-%a.log" ${SBATCH_FLAGS:-} "$here/slurm-part.sh" "$scene" "$samples" "$parts" \
    "$out.parts" "$@")
# shellcheck disable=SC2086
sbatch --parsable --dependency="afterok:$array" --kill-on-invalid-dep=yes --job-name="$(basename "$out")-merge" \
    --output="$out.parts/merge.log" ${SBATCH_FLAGS:-} "$here/slurm-merge.sh" "$samples" "$out.parts" "$out"
