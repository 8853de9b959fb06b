#!/bin/bash
# Bundles for the brain of about 151,201 nodes: large_mesh.sh WORK DATASET..., or WEIGHTS=BUNDLE large_mesh.sh WORK
#
# WORK gets brain-fine-reduced (kind `reduced`, corrected by what the cases at 21,708 nodes in DATASET... teach) and brain-fine
# (kind `upt`, the weights of onnx/brain-fast). Run it in the repository's root; what WORK already holds is kept, so an
# interrupted run goes on. Without a DATASET it gets the mesh and the weights of BUNDLE, which do without a linear response, as
# brain-fine-NAME: minutes, and 3 GB of memory. UPT is the command `upt`, PYTHON a Python with upt_training. With a
# DATASET it takes about an hour on two cores; 14 GB of disk, 9 GB of memory.
set -euo pipefail
if [ $# -lt 1 ] || { [ $# -lt 2 ] && [ -z "${WEIGHTS:-}" ]; }; then
    echo "usage: $0 WORK DATASET...   (datasets of upt dataset on onnx/meshes/brain.mesh.safetensors)" >&2
    echo "       WEIGHTS=BUNDLE $0 WORK   (weights that need no linear response)" >&2
    exit 2
fi
work=$1
shift
upt=${UPT:-upt}
python=${PYTHON:-python}
middle=onnx/meshes/brain.mesh.safetensors
mesh=$work/brain-fine.mesh.safetensors
columns=$work/fine.columns.safetensors
mkdir -p "$work"

# make FILE COMMAND...: runs the command unless FILE is there. Each command writes beside it and renames.
make() {
    local file=$1
    shift
    if [ -e "$file" ]; then
        echo "$file: kept"
    else
        "$@"
    fi
}

data=()
for folder in "$@"; do
    data+=(--coarse-data "$folder")
done
make "$mesh" "$python" -m upt_training.anatomy --nodes 151201 --out "$mesh"
if [ $# -eq 0 ]; then
    fine=$work/brain-fine-$(basename "$WEIGHTS")
    make "$fine/bundle.json" "$python" -m upt_training transfer "$WEIGHTS" --mesh "$mesh" --out "$fine"
    exit
fi
make "$work/middle.columns.safetensors" "$upt" prior --mesh "$middle" --out "$work/middle.columns.safetensors"
make "$columns" "$upt" prior --mesh "$mesh" --out "$columns"
make "$work/fine.modes.safetensors" "$upt" modes --mesh "$mesh" --out "$work/fine.modes.safetensors"
make "$work/brain-fine-reduced/bundle.json" "$python" -m upt_training.reduced build --mesh "$mesh" --columns "$columns" \
    --coarse-mesh "$middle" --coarse-columns "$work/middle.columns.safetensors" "${data[@]}" --near-mm 20 \
    --work "$work/build" --out "$work/brain-fine-reduced" --name brain-fine-reduced \
    --updates 1200 --hidden 192 --weight-decay 0.1 --quadratic-modes 24 --quadratic-ridge 0.1 --refit
# The reduced bundle's response tables serve the other kind too.
prior=$work/brain-fine-reduced/prior.safetensors
make "$work/fine.vibration.safetensors" "$python" -m upt_training.vibration --mesh "$mesh" \
    --prior "$prior" --natural "$work/fine.modes.safetensors" --out "$work/fine.vibration.safetensors"
make "$work/brain-fine/bundle.json" "$python" -m upt_training transfer onnx/brain-fast --mesh "$mesh" \
    --prior "$prior" --vibration "$work/fine.vibration.safetensors" --out "$work/brain-fine"
