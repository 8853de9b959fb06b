#!/usr/bin/env bash
# Bundles with random weights for the speed tables:  benches/random_bundles.sh OUT
# `wide` and `paper` on the brain, the second with the graphs of the paper's split beside it, and `paper-fine` on the mesh that
# UPT_FINE_MESH names. One is made again when its configuration or mesh is newer. UPT_PYTHON has the training package.
set -euo pipefail

out=${1:?usage: random_bundles.sh OUT}
cd "$(dirname "${BASH_SOURCE[0]}")/.."
brain=onnx/meshes/brain.mesh.safetensors
mkdir -p "$out"

# bundle NAME CONFIGURATION MESH LAST OPTION...: LAST is the file that is written last.
bundle() {
  local name=$1 config=training/configs/$2.toml mesh=$3 last=$out/$1/$4
  shift 4
  if [ "$last" -nt "$config" ] && [ "$last" -nt "$mesh" ]; then return; fi
  "${UPT_PYTHON:-python3}" -m upt_training.random_bundle --name "$name" --config "$config" --mesh "$mesh" --out "$out/$name" "$@"
}

bundle wide wide "$brain" bundle.json
bundle paper paper "$brain" reference.safetensors --paper-split
# The trained network of that size, split in the same way, where it has been fetched.
split=$out/brain-paper.split/paper_decoder.onnx
if [ ! -d onnx/brain-paper ]; then
  echo "left out: brain-paper; fetch it first: upt bundle get brain-paper --out onnx" >&2
elif [ ! "$split" -nt onnx/brain-paper/decoder.onnx ]; then
  "${UPT_PYTHON:-python3}" -m upt_training.paper_split onnx/brain-paper --out "$out/brain-paper.split"
fi
if [ -n "${UPT_FINE_MESH:-}" ]; then bundle paper-fine paper "$UPT_FINE_MESH" reference.safetensors --paper-split; fi
