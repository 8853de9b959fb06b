#!/usr/bin/env bash
# Trains on a machine with a GPU in slices, from checkpoint to checkpoint, and exports at the end.
#
#   training/scripts/train_on_gpu.sh CONFIG DATA MESH OUT [PRIOR [VIBRATION]]
#
# Each call trains for at most SLICE_MINUTES (default 9) and leaves OUT/last.pt; call it again until it says "finished".
# Carry to the machine: the repository, DATA (or make it there: `upt dataset`), MESH, PRIOR, VIBRATION. Bring back: OUT/.
# INIT=CHECKPOINT_OR_BUNDLE starts from those weights. GPUS=N starts N processes by torchrun. DEVICE=cpu rehearses every
# line without a GPU. PYTHON names the interpreter.
set -euo pipefail

if [ $# -lt 4 ]; then
  sed -n '2,10p' "$0" >&2
  exit 2
fi
config=$1 data=$2 mesh=$3 out=$4 prior=${5:-} vibration=${6:-}
root=$(cd "$(dirname "$0")/../.." && pwd)
python=${PYTHON:-python}
device=${DEVICE:-cuda}
gpus=${GPUS:-1}
export PYTHONPATH="$root/training${PYTHONPATH:+:$PYTHONPATH}"

arguments=(train --config "$config" --data "$data" --mesh "$mesh" --out "$out" --device "$device"
  --max-minutes "${SLICE_MINUTES:-9}")
[ -n "$prior" ] && arguments+=(--prior "$prior")
[ -n "$vibration" ] && arguments+=(--vibration "$vibration")
if [ -f "$out/last.pt" ]; then
  arguments+=(--resume)
elif [ -n "${INIT:-}" ]; then
  arguments+=(--init "$INIT")
fi

mkdir -p "$out"
if [ "$gpus" -gt 1 ]; then
  "$python" -m torch.distributed.run --standalone --nproc-per-node "$gpus" -m upt_training "${arguments[@]}" \
    2>&1 | tee -a "$out/train.log"
else
  "$python" -m upt_training "${arguments[@]}" 2>&1 | tee -a "$out/train.log"
fi

if tail -n 1 "$out/train.log" | grep -qE '^(finished|stopped early)'; then
  export_arguments=(export "$out" --out "$out/bundle" --mesh "$mesh" --data "$data" --step --paper-split)
  [ -n "$prior" ] && export_arguments+=(--prior "$prior")
  [ -n "$vibration" ] && export_arguments+=(--vibration "$vibration")
  "$python" -m upt_training "${export_arguments[@]}"
  "$python" -m upt_training evaluate "$out/bundle" --data "$data" --out "$out/evaluation.json"
fi
