#!/bin/sh
# parallel.sh -- one picture by several machines, with GNU parallel over ssh and a folder that all of them see.
#     apps/farm/parallel.sh SCENE.xml SAMPLES PARTS OUT.exr [options of render-cli]
# Environment: RENDER_CLI, the program (render-cli); NODES, a file of machines as for --sshloginfile (none: this one).
# One part at a time for each machine, whose cores all work on it. A part that fails is tried again, three times in all,
# where there is room, and goes on from its checkpoint; so does the whole command, given again.
# Exit codes: 0 done, 1 a part failed or a program is missing, 2 wrong usage, 7 the parts don't add up.
set -eu
[ $# -ge 4 ] || { sed -n 's/^#     /usage: /p' "$0" >&2; exit 2; }
scene=$1 samples=$2 parts=$3 out=$4
shift 4
case $samples$parts in *[!0-9]*) echo "parallel.sh: SAMPLES and PARTS are numbers" >&2; exit 2 ;; esac
[ "$parts" -ge 1 ] && [ "$parts" -le "$samples" ] || { echo "parallel.sh: 1 to $samples parts" >&2; exit 2; }
program=${RENDER_CLI:-render-cli}
command -v parallel >/dev/null || { echo "parallel.sh: GNU parallel is not installed" >&2; exit 1; }
command -v "$program" >/dev/null || { echo "parallel.sh: no $program; RENDER_CLI names it" >&2; exit 1; }
mkdir -p "$out.parts"
part=0
while [ "$part" -lt "$parts" ]; do
    echo "$part $((samples * part / parts)):$((samples * (part + 1) / parts))"
    part=$((part + 1))
done | parallel --quote ${NODES:+--sshloginfile "$NODES" --workdir .} --jobs 1 --retries 3 --colsep ' ' \
    "$program" "$scene" --sample-range '{2}' --checkpoint "$out.parts/part-{1}.state" --resume \
    -o "$out.parts/part-{1}.exr" "$@" ||
    { echo "parallel.sh: parts failed; given again, the same command renders what is missing" >&2; exit 1; }
"$program" merge "$out.parts"/part-*.state --sample-range "0:$samples" -o "$out"
