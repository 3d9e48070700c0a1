#!/bin/sh
# slurm-part.sh -- one task of slurm.sh's array: SCENE SAMPLES PARTS FOLDER [options of render-cli]. With its machine
# gone Slurm queues it again by itself; killed, it asks for that; either way it goes on from its checkpoint.
scene=$1 samples=$2 parts=$3 folder=$4
shift 4
part=${SLURM_ARRAY_TASK_ID:?}
"${RENDER_CLI:-render-cli}" "$scene" --sample-range "$((samples * part / parts)):$((samples * (part + 1) / parts))" \
    --checkpoint "$folder/part-$part.state" --resume -o "$folder/part-$part.exr" "$@"
code=$?
# By a signal: more memory than it was given, a neighbour, a person. Not for ever.
if [ $code -ge 128 ] && [ "${SLURM_RESTART_COUNT:-0}" -lt 5 ]; then
    echo "slurm-part.sh: killed (exit code $code); queued again"
    scontrol requeue "${SLURM_ARRAY_JOB_ID}_$part" && sleep 60
fi
exit $code
