#!/bin/bash
# A study as an array of 64 jobs: sbatch slurm-array.sh study.json parts
# Then its result, when all are done:
#   sbatch --dependency=afterok:JOB --wrap 'toothwave study study.json --merge parts > result.json'
# A job that failed runs again with sbatch --array=17 slurm-array.sh study.json parts
#SBATCH --job-name=toothwave
#SBATCH --array=0-63
#SBATCH --cpus-per-task=4
#SBATCH --time=01:00:00
set -euo pipefail

# All 64, whichever of them run now.
parts=64

RAYON_NUM_THREADS=$SLURM_CPUS_PER_TASK \
  exec toothwave study "$1" --part "$SLURM_ARRAY_TASK_ID/$parts" --into "$2"
