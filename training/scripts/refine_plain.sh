#!/bin/bash
# The paper's network without a prior at K = 21,708 and 150,140, beside the paper's figures: refine_plain.sh WORK
#
# Simulates 24 trajectories (12 of schemes 1 to 4, 12 probes of five sites) and 11 held-out ones of schemes 1 to 5 at K = 21,708,
# refines training/checkpoints/paper-gpu.pt on them (training/configs/paper-fine.toml), scores the weights before and after
# through ONNX Runtime, and after on a held-out case of scheme 1 at K = 150,140. The last lines are the command that writes
# the table of docs/results/training.md. Run it in the repository's root; what WORK already holds is kept, so an
# interrupted run goes on. UPT is the command `upt`, PYTHON a Python with upt_training. One thread, an hour and a half; 4 GB.
set -euo pipefail
if [ $# -ne 1 ]; then
    echo "usage: $0 WORK" >&2
    exit 2
fi
work=$1
upt=${UPT:-upt}
python=${PYTHON:-python}
mesh=onnx/meshes/brain.mesh.safetensors
large=$work/large
export OMP_NUM_THREADS=1
mkdir -p "$work"

# simulate FOLDER COUNT CASES OPTION...: these cases of a dataset of COUNT; those that are there are kept.
simulate() {
    local folder=$1 count=$2 cases=$3 case
    shift 3
    for case in $cases; do
        "$upt" dataset "$@" --count "$count" --shard "$case/$count" --out "$work/$folder"
    done
}

# score BUNDLE DATA NAME: $work/NAME.json
score() {
    [ -e "$work/$3.json" ] || "$python" -m upt_training evaluate "$work/$1" --data "$work/$2" --out "$work/$3.json"
}

fast=(--inner-step-ms 0.19 --mass-scaling-ms 0.2)
simulate schemes 200 "$(echo {0..11} {16..19} {36..39})" --mesh "$mesh" --schemes 1-4 --seed 1 \
    --train-inner-step-ms 0.19 --train-mass-scaling-ms 0.2
simulate probes 40 "$(echo {0..11})" --mesh "$mesh" --schemes probe --seed 21 "${fast[@]}"
simulate five 50 "4 9 14" --mesh "$mesh" --schemes 5 --seed 1

start=(--init training/checkpoints/paper-gpu.pt)
if [ -e "$work/fine-run/last.pt" ]; then
    start=(--resume)
fi
data=(--data "$work/schemes" --data "$work/probes")
"$python" -m upt_training train --config training/configs/paper-fine.toml "${data[@]}" --mesh "$mesh" \
    --out "$work/fine-run" --device cpu --checkpoint-minutes 2 "${start[@]}"
export_to() { # RUN NAME
    [ -e "$work/$2/bundle.json" ] || "$python" -m upt_training export "$1" --out "$work/$2" --mesh "$mesh" "${data[@]}"
}
export_to "$work/fine-run" paper-fine
export_to training/checkpoints/paper-gpu.pt paper-gpu
for bundle in paper-fine paper-gpu; do
    score $bundle schemes $bundle-schemes
    score $bundle five $bundle-five
done

WEIGHTS=$work/paper-fine UPT=$upt PYTHON=$python bash training/scripts/large_mesh.sh "$large"
simulate large-schemes 200 16 --mesh "$large/brain-fine.mesh.safetensors" --schemes 1-4 --seed 1
score large/brain-fine-paper-fine large-schemes large

other="paper-gpu, other mesh"
cat <<END
python tests/docs/results.py run training --measures training/upt_training -- python training/tables evaluation \\
    "$other=$work/paper-gpu-schemes.json" "$other=$work/paper-gpu-five.json" paper-fine=$work/paper-fine-schemes.json \\
    paper-fine=$work/paper-fine-five.json "paper-fine, other mesh=$work/large.json" \\
    --paper --overall --add --marks "paper figures" --page {page}
END
