#!/usr/bin/env bash
# Packs what a measurement on a GPU machine without a network needs, in pieces of 60 MiB:
#   xtask/gpu/pack.sh OUT [--rehearse | --small ARCH] [TRAJECTORY...]
# the commands `upt`, `upt-study` and `gpu-measure` (x86-64), ONNX Runtime's GPU build (of the onnxruntime-gpu wheel), bundles with random
# weights of the `paper`, `wide` and `plain` (`fast`) configuration with step.onnx and the paper's split, the brain bundles, the Python
# package for the PyTorch rows, and the trajectories to replay (none given: one of scheme 5 is simulated).
#   UPT_FINE_MESH=FILE   adds `paper-fine`, the `paper` configuration on that mesh (K = 151,201)
#   --small ARCH         one piece of some 40 MiB: device code of that architecture alone (90: H100, H200), random bundles
#                        made there (its python3 needs torch and onnx), the coarse bundles in place of the brain's
#   --rehearse           the CPU's ONNX Runtime (ORT_DYLIB_PATH) and the small bundles of tests/fixtures: minutes, no network
# There: unpack.sh, then run.sh. Needs cargo, xz, and python3 with pip; PYTHON names the one that has the training package.
set -euo pipefail

out=${1:?usage: pack.sh OUT [--rehearse] [TRAJECTORY...]}
shift
rehearse= small=
if [ "${1:-}" = --rehearse ]; then
  rehearse=1
  shift
elif [ "${1:-}" = --small ]; then
  small=${2:?--small ARCH, such as 90}
  shift 2
fi
root=$(cd "$(dirname "$0")/../.." && pwd)
target=${CARGO_TARGET_DIR:-$root/target}
python=${PYTHON:-python3}
stage=$(mktemp -d)
trap 'rm -rf "$stage"' EXIT
mkdir -p "$out" "$stage"/upt/{ort,bundles,cases,training} "$stage/wheel"
out=$(cd "$out" && pwd)

if [ -z "${UPT_GPU_BINARIES:-}" ]; then
  (cd "$root" && cargo build --quiet --release -p upt-cli -p upt-study && cargo build --quiet --release -p libupt --example gpu-measure)
  UPT_GPU_BINARIES="$target/release $target/release/examples"
fi
for command in upt upt-study gpu-measure; do
  for folder in $UPT_GPU_BINARIES; do
    if [ -x "$folder/$command" ]; then cp "$folder/$command" "$stage/upt/"; fi
  done
done
[ -x "$stage/upt/gpu-measure" ] || { echo "no gpu-measure in $UPT_GPU_BINARIES" >&2; exit 1; }
cp -r "$root/training/upt_training" "$stage/upt/training/"
find "$stage/upt/training" -name __pycache__ -prune -exec rm -rf {} +
cp "$root"/xtask/gpu/{run.sh,torch_rows.py} "$stage/upt/"

random() { # name, configuration, mesh
  if [ -n "$small" ]; then
    mkdir -p "$stage/upt/random"
    cp "$root/training/configs/$2.toml" "$stage/upt/random/$1.toml"
    cp "$3" "$stage/upt/random/$1.mesh.safetensors"
    return
  fi
  PYTHONPATH=$root/training "$python" -m upt_training.random_bundle --config "$root/training/configs/$2.toml" \
    --mesh "$3" --out "$stage/upt/bundles/$1" --name "$1" --step --paper-split
}
if [ -n "$rehearse" ]; then
  cp -L "${ORT_DYLIB_PATH:?set ORT_DYLIB_PATH}" "$stage/upt/ort/libonnxruntime.so"
  cp -r "$root"/tests/fixtures/tiny-upt "$root"/tests/fixtures/tiny-reduced "$stage/upt/bundles/"
else
  "$python" -m pip download --quiet --no-deps --only-binary=:all: --dest "$stage/wheel" onnxruntime-gpu==1.31.1
  "$python" -m zipfile -e "$stage"/wheel/*.whl "$stage/wheel/open"
  for library in "$stage"/wheel/open/onnxruntime/capi/libonnxruntime*.so*; do
    if [ -n "$small" ]; then
      case $library in *tensorrt*) continue ;; esac
      "$python" "$root/xtask/gpu/prune.py" "$library" "$stage/upt/ort/$(basename "$library")" "$small"
    else
      cp "$library" "$stage/upt/ort/"
    fi
  done
  brain=$root/onnx/meshes/brain.mesh.safetensors
  random paper paper "$brain"
  random wide wide "$brain"
  random fast plain "$brain"
  if [ -n "${UPT_FINE_MESH:-}" ]; then random paper-fine paper "$UPT_FINE_MESH"; fi
  if [ -n "$small" ]; then
    cp -r "$root"/onnx/brain-coarse "$root"/onnx/brain-coarse-reduced "$stage/upt/bundles/"
  else
    cp -r "$root"/onnx/brain "$root"/onnx/brain-fast "$root"/onnx/brain-reduced "$stage/upt/bundles/"
  fi
  if [ -n "$small" ]; then brain=$root/onnx/meshes/brain-coarse.mesh.safetensors; fi
  if [ "$#" -eq 0 ]; then
    "$stage/upt/upt" simulate --mesh "$brain" --scheme 5 --seed 2026 --half --threads "$(nproc)" \
      --out "$stage/upt/cases/scheme5.trajectory.safetensors"
  fi
fi
if [ "$#" -gt 0 ]; then cp "$@" "$stage/upt/cases/"; fi

rm -f "$out"/upt-gpu.*
tar -C "$stage" -c upt | xz -T0 -"${UPT_GPU_XZ:-3}" | split -b "${UPT_GPU_PIECE:-60M}" -a 3 - "$out/upt-gpu."
(cd "$out" && sha256sum upt-gpu.??? >upt-gpu.sums)
cp "$root/xtask/gpu/unpack.sh" "$out/"
ls -l "$out"
echo "carry all of $out; there: ./unpack.sh FOLDER && FOLDER/upt/run.sh OUT"
