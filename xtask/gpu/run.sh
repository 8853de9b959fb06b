#!/usr/bin/env bash
# Runs on the GPU machine, from the unpacked folder of pack.sh:
#   run.sh OUT [PROVIDERS]      PROVIDERS: a list for `upt report --provider`, default cpu,cuda
# Writes OUT/doctor.json (what was found, and why a provider is missing), OUT/report.json, OUT/report.html, OUT/log and
# OUT/machine. The CPU rows are the float32 path that the others' deviation is measured against.
set -euo pipefail

out=${1:?usage: run.sh OUT [PROVIDERS]}
providers=${2:-cpu,cuda}
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$out"
out=$(cd "$out" && pwd)

# CUDA's libraries: where the system has them, and where Python's nvidia packages put them.
libraries=$(python3 - <<'PY' 2>/dev/null || true
import glob, site, sys
roots = site.getsitepackages() + [site.getusersitepackages()] + sys.path
print(":".join(sorted({p for r in roots for p in glob.glob(r + "/nvidia/**/lib", recursive=True)})))
PY
)
export LD_LIBRARY_PATH=$here/ort:$libraries:${LD_LIBRARY_PATH:-}
ORT_DYLIB_PATH=$(find "$here/ort" -name 'libonnxruntime.so.*' | sort | tail -n 1)
export ORT_DYLIB_PATH ORT_DISABLE_TELEMETRY=1
{
  uname -a
  nvidia-smi 2>&1 || echo "no nvidia-smi"
} >"$out/machine"

cd "$here"
./upt doctor --json bundles/* >"$out/doctor.json" || true
cases=()
for case in cases/*.trajectory.safetensors; do cases+=(--trajectory "$case"); done
bundles=()
for bundle in bundles/*; do bundles+=(--bundle "$bundle"); done
# One process a provider: one that crashes leaves the others' rows, which are stored as they are finished.
status=0
for provider in ${providers//,/ }; do
  ./upt report "${cases[@]}" "${bundles[@]}" --provider "$provider" --threads 1,2 --region all,surface --plain none \
    --out "$out/$provider" 2>&1 | tee -a "$out/log" || status=1
done
exit "$status"
