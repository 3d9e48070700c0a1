#!/bin/sh
# slurm-merge.sh -- the job after slurm.sh's array: SAMPLES FOLDER OUT. Fails, and says what, if anything is missing.
exec "${RENDER_CLI:-render-cli}" merge "$2"/part-*.state --sample-range "0:$1" -o "$3"
