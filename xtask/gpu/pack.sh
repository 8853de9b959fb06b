#!/usr/bin/env bash
# Packs what a measurement on a GPU machine without a network needs, in pieces of 60 MiB:
#   xtask/gpu/pack.sh OUT [--rehearse] [TRAJECTORY...]
# the command `upt`, ONNX Runtime's GPU build (from the onnxruntime-gpu wheel; --rehearse: the CPU build), the brain bundles, and
# the trajectories to replay (none given: one of scheme 5 is simulated). There: run.sh. Needs cargo, python3 with pip, xz.
set -euo pipefail

out=${1:?usage: pack.sh OUT [--rehearse] [TRAJECTORY...]}
shift
wheel=onnxruntime-gpu==1.31.1
if [ "${1:-}" = --rehearse ]; then
  wheel=onnxruntime==1.31.1
  shift
fi
root=$(cd "$(dirname "$0")/../.." && pwd)
target=${CARGO_TARGET_DIR:-$root/target}
stage=$(mktemp -d)
trap 'rm -rf "$stage"' EXIT
mkdir -p "$out" "$stage/upt/ort" "$stage/upt/bundles" "$stage/upt/cases" "$stage/wheel"

(cd "$root" && cargo build --quiet --release -p upt-cli)
cp "$target/release/upt" "$stage/upt/"
python3 -m pip download --quiet --no-deps --only-binary=:all: --dest "$stage/wheel" "$wheel"
python3 -m zipfile -e "$stage"/wheel/*.whl "$stage/wheel/open"
cp "$stage"/wheel/open/onnxruntime/capi/libonnxruntime*.so* "$stage/upt/ort/"
cp -r "$root"/onnx/brain-fast "$root"/onnx/brain-reduced "$stage/upt/bundles/"
cp "$root/xtask/gpu/run.sh" "$stage/upt/"
if [ "$#" -eq 0 ]; then
  "$target/release/upt" simulate --mesh "$root/onnx/meshes/brain.mesh.safetensors" --scheme 5 --seed 2026 --half \
    --threads "$(nproc)" --out "$stage/upt/cases/scheme5.trajectory.safetensors"
else
  cp "$@" "$stage/upt/cases/"
fi

rm -f "$out"/upt-gpu.*
tar -C "$stage" -c upt | xz -T0 -3 | split -b 60M - "$out/upt-gpu."
(cd "$out" && sha256sum upt-gpu.* >upt-gpu.sums)
ls -l "$out"
echo "carry all of $out, then: cat upt-gpu.?? | xz -d | tar -x && upt/run.sh OUT"
