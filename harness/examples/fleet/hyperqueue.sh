#!/bin/bash
# Diagnoses a fleet of campaigns by HyperQueue, a share a task. Copy it, change what is marked, and submit it:
#   hq submit hyperqueue.sh
# What is lost is done again by submitting it once more: finished campaigns are left alone. When all tasks have ended:
#   touchdown merge answers
#HQ --name touchdown
#HQ --array 1-400
#HQ --cpus 1
set -eu
shares=400                       # change, and the array above with it: many small ones keep all workers busy to the end
campaigns=campaigns              # change: the folder of the campaigns
answers=answers                  # change: a folder that all workers see
touchdown=${TOUCHDOWN:-touchdown}

if [ "$HQ_TASK_ID" -gt "$shares" ]; then
    echo "hyperqueue.sh: the array goes beyond $shares; let shares and --array agree" >&2
    exit 2
fi
exec "$touchdown" diagnose "$campaigns" --out "$answers" --shard "$HQ_TASK_ID/$shares" --jobs 1
