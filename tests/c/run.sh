#!/usr/bin/env bash
# Installs libupt into a prefix and runs the C and C++ tests against it.
#
#   tests/c/run.sh [BUILD_DIR]
#
# Reads UPT_ROOT, UPT_LIB_DIR (libupt.so, libupt.a; default target/release), UPT_BUNDLES (default onnx/),
# UPT_BUILD_DIR (default target/), ORT_DYLIB_PATH. The last line is `N passed, N failed, N skipped`.
set -euo pipefail
root="${UPT_ROOT:-$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)}"
build="${1:-${UPT_BUILD_DIR:-$root/target}}/c-tests"
libraries="${UPT_LIB_DIR:-$root/target/release}"
bundles="${UPT_BUNDLES:-$root/onnx}"
mkdir -p "$build"
build="$(cd "$build" && pwd)"
prefix="$build/prefix"

if [ ! -e "$libraries/libupt.so" ]; then
  echo "no libupt.so in $libraries; run: cargo build --release -p libupt"
  echo "0 passed, 1 failed, 0 skipped"
  exit 1
fi

# A library that can be made to panic and has no instruments, in a folder of its own so that it is never packaged. No optimiser runs, and
# arithmetic that overflows panics; the stage `abi` has built most of it.
cargo build --profile layout --quiet --manifest-path "$root/Cargo.toml" -p libupt --no-default-features --features fault,learned
mkdir -p "$build/fault"
cp "${CARGO_TARGET_DIR:-$root/target}/layout/libupt.so" "$build/fault/libupt.so.0"

rm -rf "$prefix"
cmake -S "$root/cmake" -B "$build/install" -DUPT_LIB_DIR="$libraries" \
  -DCMAKE_INSTALL_PREFIX="$prefix" >"$build/install.log"
cmake --install "$build/install" >>"$build/install.log"

brain=""
for name in brain-reduced brain-fast brain-coarse brain; do
  if [ -e "$bundles/$name/bundle.json" ]; then
    brain="$bundles/$name"
    break
  fi
done
if [ -z "$brain" ]; then
  brain="$(find "$bundles" -mindepth 2 -maxdepth 2 -name bundle.json -printf '%h\n' 2>/dev/null | sort | head -n 1)"
fi

cmake -S "$root/tests/c" -B "$build/tests" -DCMAKE_BUILD_TYPE=RelWithDebInfo \
  -DCMAKE_PREFIX_PATH="$prefix" -DUPT_ROOT="$root" -DUPT_PREFIX="$prefix" \
  -DUPT_FIXTURE="$root/tests/fixtures/tiny-upt" \
  -DUPT_REDUCED="$root/tests/fixtures/tiny-reduced" -DUPT_CORRECTED="$root/tests/fixtures/tiny-corrected" -DUPT_BRAIN="$brain" \
  -DUPT_LIVER="$bundles/liver-coarse" \
  -DUPT_FAULT_DIR="$build/fault" >"$build/configure.log"
cmake --build "$build/tests" --parallel 2 >"$build/build.log" || {
  cat "$build/build.log"
  echo "0 passed, 1 failed, 0 skipped"
  exit 1
}

log="$build/ctest.log"
(cd "$build/tests" && ctest --output-on-failure --no-tests=error) | tee "$log" || true
grep -h '^skipped: ' "$build/tests/Testing/Temporary/LastTest.log" || true
passed="$(grep -cE '^ *[0-9]+/[0-9]+ Test .* Passed ' "$log" || true)"
skipped="$(grep -cE '^ *[0-9]+/[0-9]+ Test .*\*\*\*Skipped' "$log" || true)"
total="$(grep -cE '^ *[0-9]+/[0-9]+ Test ' "$log" || true)"
failed=$((total - passed - skipped))
echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ] && [ "$total" -gt 0 ]
