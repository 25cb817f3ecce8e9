#!/bin/bash
# A study as an array of 64 jobs: sbatch slurm-array.sh study.json parts
# To compute the result after all jobs:
#   sbatch --dependency=afterok:JOB --wrap 'toothwave study study.json --merge parts > result.json'
# To run a failed job again: sbatch --array=17 slurm-array.sh study.json parts
#SBATCH --job-name=toothwave
#SBATCH --array=0-63
#SBATCH --cpus-per-task=4
#SBATCH --time=01:00:00
set -euo pipefail

# Number of parts in total, even if only some jobs run again.
parts=64

RAYON_NUM_THREADS=$SLURM_CPUS_PER_TASK \
  exec toothwave study "$1" --part "$SLURM_ARRAY_TASK_ID/$parts" --into "$2"
