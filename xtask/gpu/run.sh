#!/usr/bin/env bash
# Runs on the GPU machine, in the unpacked folder:  run.sh OUT [--rehearse] [PROVIDERS]
#   PROVIDERS   a list like cpu,cuda,tensorrt,tensorrt-rtx; default cpu,cuda
#   STEPS, SCENES and TORCH (default 1000, 1,2,4,8 and eager,compiled) say how many steps are timed, how many scenes at once,
#   and how PyTorch runs
#   --rehearse  a few steps on the CPU alone: all parts run, and OUT/missing says what was not measured
# Writes OUT/rows.jsonl (a row a line, also of what a provider refused), OUT/rows-torch.json (PyTorch's, and the card's rates),
# OUT/missing (what else was not measured: why), OUT/doctor.json, OUT/errors-P/ (`cargo xtask study report`: errors of rollouts against
# the reference solver), OUT/log and OUT/machine. Bring back all of OUT. One process a provider and a rival: one that
# crashes leaves the others' rows. Needs nothing but the folder; PyTorch rows need python3 with torch.
set -euo pipefail

out=${1:?usage: run.sh OUT [--rehearse] [PROVIDERS]}
shift
providers=cpu,cuda
steps=${STEPS:-1000}
scenes=${SCENES:-1,2,4,8}
rehearse=
if [ "${1:-}" = --rehearse ]; then
  shift
  rehearse=1 providers=cpu steps=8 scenes=1,2
fi
providers=${1:-$providers}
python=${PYTHON:-python3}
here=$(cd "$(dirname "$0")" && pwd)
rm -rf "$out"/rows* "$out/missing" "$out/log"
mkdir -p "$out"
out=$(cd "$out" && pwd)

# CUDA's libraries: where the system has them, and where Python's nvidia packages put them.
libraries=$("$python" - <<'PY' 2>/dev/null || true
import glob, site, sys
roots = site.getsitepackages() + [site.getusersitepackages()] + sys.path
print(":".join(sorted({p for r in roots for p in glob.glob(r + "/nvidia/**/lib", recursive=True)})))
PY
)
export LD_LIBRARY_PATH=$here/ort:$libraries:${LD_LIBRARY_PATH:-}
ORT_DYLIB_PATH=$(find "$here/ort" -name 'libonnxruntime.so*' | sort | tail -n 1)
export ORT_DYLIB_PATH ORT_DISABLE_TELEMETRY=1
{
  uname -a
  nvidia-smi 2>&1 || echo "no nvidia-smi"
} >"$out/machine"

cd "$here"
missing() { printf '%s: %s\n' "$1" "$2" | tee -a "$out/log" >>"$out/missing"; }
: >"$out/missing"
for config in random/*.toml; do
  name=$(basename "$config" .toml)
  if [ -e "$config" ] && [ ! -e "bundles/$name" ]; then
    PYTHONPATH=$here/training "$python" -m upt_training.random_bundle --config "$config" --mesh "random/$name.mesh.safetensors" \
      --out "bundles/$name" --name "$name" --step --paper-split >>"$out/log" 2>&1 ||
      missing "rows of $name" "random_bundle ended with status $?; see log"
  fi
done
if [ -x upt ]; then ./upt doctor --json bundles/* >"$out/doctor.json" 2>>"$out/log" || true; fi
for provider in ${providers//,/ }; do
  echo "provider $provider" | tee -a "$out/log"
  ./gpu-measure "$provider" "$steps" "$scenes" bundles/* >>"$out/rows.jsonl" 2>>"$out/log" ||
    missing "rows of $provider" "gpu-measure ended with status $?; see log"
done
random=()
for bundle in bundles/*; do
  if grep -q '"random_weights": *true' "$bundle/bundle.json"; then random+=("$bundle"); fi
done
echo PyTorch | tee -a "$out/log"
PYTHONPATH=$here/training timeout 1200 "$python" torch_rows.py "$out/rows-torch.json" "$steps" "${TORCH:-eager,compiled}" "${random[@]}" >>"$out/log" 2>&1 ||
  missing PyTorch "torch_rows.py ended with status $?; see log"
cases=()
for case in cases/*.trajectory.safetensors; do
  if [ -e "$case" ]; then cases+=(--trajectory "$case"); fi
done
if [ "${#cases[@]}" -eq 0 ] || [ ! -x upt ]; then
  missing "errors of rollouts against the reference solver" "no trajectory or no command upt was packed"
else
  bundles=()
  for bundle in bundles/brain-*; do bundles+=(--bundle "$bundle"); done
  for provider in ${providers//,/ }; do
    ./upt-study report "${cases[@]}" "${bundles[@]}" --provider "$provider" --threads 1,2 --region all,surface --plain none \
      --out "$out/errors-$provider" >>"$out/log" 2>&1 || missing "errors on $provider" "cargo xtask study report ended with status $?; see log"
  done
fi
for card in cuda tensorrt tensorrt-rtx; do
  case ",$providers," in
    *",$card,"*) ;;
    *) missing "all rows of $card" "${rehearse:+a rehearsal on the CPU; }it was not asked for" ;;
  esac
done
missing "TLED step on the card" "there is no CUDA port of the reference solver"
echo "rows: $out/rows.jsonl, what was not measured: $out/missing"
