#!/bin/bash
# Diagnoses a fleet of campaigns as an array of Slurm jobs, a share each. Copy it, change what is marked, and submit it:
#   sbatch slurm.sh
# What is lost is done again by submitting it once more: finished campaigns are left alone. When all jobs have ended:
#   touchdown merge answers
#SBATCH --job-name=touchdown
#SBATCH --array=1-40             # change: one number a share, from 1 to the shares below
#SBATCH --cpus-per-task=4        # change: campaigns at once in a share
#SBATCH --mem-per-cpu=500M
#SBATCH --time=12:00:00          # change
#SBATCH --requeue
set -eu
shares=40                        # change: as many as the array has, also where only some of it are submitted again
campaigns=campaigns              # change: the folder of the campaigns
answers=answers                  # change: a folder that all nodes see
touchdown=${TOUCHDOWN:-touchdown}

if [ "$SLURM_ARRAY_TASK_ID" -gt "$shares" ]; then
    echo "slurm.sh: the array goes beyond $shares; let shares and --array agree" >&2
    exit 2
fi
exec "$touchdown" diagnose "$campaigns" --out "$answers" --shard "$SLURM_ARRAY_TASK_ID/$shares" --jobs "${SLURM_CPUS_PER_TASK:-1}"
