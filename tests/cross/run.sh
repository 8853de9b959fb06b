#!/usr/bin/env bash
# Builds libupt for another platform and runs its tests here, under Wine or qemu:
#
#   tests/cross/run.sh windows|arm64
#
# Reads what tests/c/run.sh reads, and UPT_CROSS_ORT: the folder with that platform's ONNX Runtime. UPT_NIGHTLY=1 runs all
# of the crate's tests and longer rollouts. What is left out is named and counted as skipped; the last line is
# `N passed, N failed, N skipped`.
set -euo pipefail
root="${UPT_ROOT:-$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)}"
name="$1"
build="${UPT_BUILD_DIR:-$root/target}/cross/$name"
native="${UPT_LIB_DIR:-$root/target/release}"
nightly="${UPT_NIGHTLY:-0}"
cd "$root"
mkdir -p "$build"
source "$root/tests/cross/count.sh"
source "$root/tests/cross/wheel.sh"
source "$root/tests/cross/$name.sh"

cargo_cross() {
  "$root/xtask/cross/cargo.sh" "$UPT_CROSS_TRIPLE" "$@"
}

# The library and the command, without mesh files and sparse factorisation: half of the compiling.
packages=(-p upt -p tissue -p elements -p contact -p exchange)
echo "== build"
cargo_cross build --release -q -p upt -p upt-cli --no-default-features
out="$root/target/cross/build/$UPT_CROSS_TRIPLE/release"
prepare "$out"

echo "== unit tests"
tests=(--lib --test same_bits --test reference_rollouts --test scene_states --test step_path --test snapshot_rollback)
if [ "$nightly" = 1 ]; then
  tests=(--lib --tests)
else
  leave_out "$(find tests -maxdepth 1 -name '*.rs' | wc -l | awk '{print $1 - 5}')" "integration tests of the crate, but for five: nightly"
fi
export ORT_DYLIB_PATH="$UPT_CROSS_ORT/$UPT_CROSS_ORT_NAME"
UPT_FUZZ_SECONDS=0 cargo_cross test --release --no-fail-fast -q "${packages[@]}" --no-default-features --features upt/default "${tests[@]}" \
  >"$build/unit.log" 2>&1 || true
count_cargo "$build/unit.log"

echo "== equilibria, by the sparse factorisation"
if [ "$nightly" = 1 ]; then
  cargo_cross test --release --no-fail-fast -q -p tissue --lib >"$build/statics.log" 2>&1 || true
  count_cargo "$build/statics.log"
else
  leave_out "$(grep -c '#\[test\]' crates/tissue/src/statics/tests.rs)" "unit tests of equilibria, whose factorisation takes minutes to build: nightly"
fi

echo "== C and C++"
prefix="$build/prefix"
rm -rf "$prefix"
cmake -S cmake -B "$build/install" -DCMAKE_TOOLCHAIN_FILE="$root/xtask/cross/toolchain.cmake" -DUPT_LIB_DIR="$out" \
  -DCMAKE_INSTALL_PREFIX="$prefix" >"$build/install.log"
cmake --install "$build/install" >>"$build/install.log"
installed "$prefix"
cmake -S tests/c -B "$build/tests" -DCMAKE_TOOLCHAIN_FILE="$root/xtask/cross/toolchain.cmake" \
  -DCMAKE_BUILD_TYPE=Release -Dupt_DIR="$prefix/lib/cmake/upt" -DUPT_ROOT="$root" -DUPT_PREFIX="$prefix" \
  -DUPT_FIXTURE="$root/tests/fixtures/tiny-upt" -DUPT_REDUCED="$root/tests/fixtures/tiny-reduced" \
  -DUPT_CORRECTED="$root/tests/fixtures/tiny-corrected" >"$build/configure.log"
cmake --build "$build/tests" --parallel 2 >"$build/build.log" 2>&1 || cat "$build/build.log"
(cd "$build/tests" && ctest --output-on-failure --no-tests=error >"$build/ctest.log" 2>&1) || true
count_ctest "$build/ctest.log"
leave_out 8 "of the C tests: a panicking library, AddressSanitizer, valgrind, symbols, three outside projects, the simulator"

echo "== one rollout a bundle, beside this machine's own"
steps=12
if [ "$nightly" = 1 ]; then
  steps=120
fi
cc -O2 -I include tests/c/rollout.c tests/c/expect.c "$native/libupt.so" -o "$build/rollout"
ln -sf "$native/libupt.so" "$build/libupt.so.0"
for bundle in tests/fixtures/tiny-upt tests/fixtures/tiny-upt-prior tests/fixtures/tiny-reduced onnx/brain-*; do
  [ -e "$bundle/bundle.json" ] || continue
  short="$(basename "$bundle")"
  LD_LIBRARY_PATH="$build" ORT_DYLIB_PATH="$UPT_CROSS_HOST_ORT" \
    "$build/rollout" "$bundle" "$steps" "$build/$short.here" >"$build/$short.log" 2>&1 || cat "$build/$short.log"
  run "$build/tests/$UPT_CROSS_ROLLOUT" "$bundle" "$steps" "$build/$short.there" \
    >"$build/$short.log" 2>&1 || cat "$build/$short.log"
  compare "$short" "$build/$short.here" "$build/$short.there"
done

echo "== the command and the reference solver"
simulate=(simulate --mesh tests/fixtures/box.mesh.safetensors --scheme 5 --seed 3)
"${UPT_COMMAND:-$native/upt}" "${simulate[@]}" --out "$build/solver.here" >"$build/solver.log" 2>&1
run "$out/$UPT_CROSS_COMMAND" "${simulate[@]}" --out "$build/solver.there" >"$build/solver.log" 2>&1 ||
  cat "$build/solver.log"
compare_trajectories "$build/solver.here" "$build/solver.there"
more "$out"

echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ]
