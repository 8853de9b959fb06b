#!/usr/bin/env bash
# Builds libupt for another platform and tests it here, under Wine or qemu:
#
#   tests/cross/run.sh windows|arm64
#
# Reads what tests/c/run.sh reads, UPT_CROSS_ORT: the folder with that platform's ONNX Runtime, and UPT_CROSS_HOST_ORT: this
# machine's library. Every run has minutes; UPT_NIGHTLY=1 runs all of the crates' tests, longer rollouts of all bundles and
# the Python package too. What is left out is named and counted as skipped; the last line is `N passed, N failed, N skipped`.
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
echo "== build"
cargo_cross build --release -q -p libupt -p upt-cli --no-default-features
out="$root/target/cross/build/$UPT_CROSS_TRIPLE/release"
prepare "$out"

export ORT_DYLIB_PATH="$UPT_CROSS_ORT/$UPT_CROSS_ORT_NAME"

# unit_tests PACKAGE... WHAT: cargo's tests there.
unit_tests() {
  UPT_FUZZ_SECONDS=0 cargo_cross test --release --no-fail-fast -q "$@" >"$build/unit.log" 2>&1 || true
  count_cargo "$build/unit.log"
}
# Their number in these folders.
tests_in() {
  { grep -rh --include='*.rs' -E '^ *#\[test\]' "$@" || true; } | wc -l
}

echo "== unit tests"
if [ "$nightly" = 1 ]; then
  unit_tests -p libupt -p tissue -p libupt-elements -p libupt-contact -p libupt-exchange -p libupt-field -p libupt-kernels -p libupt-bundle -p libupt-prior -p libupt-implicit -p libupt-lanes --no-default-features --features libupt/default --lib --tests
  echo "== equilibria, by the sparse factorisation"
  unit_tests -p tissue --lib
else
  quick_tests
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
  -DUPT_CORRECTED="$root/tests/fixtures/tiny-corrected" -DUPT_LIVER="$root/onnx/liver-coarse" >"$build/configure.log"
cmake --build "$build/tests" --parallel 2 >"$build/build.log" 2>&1 || cat "$build/build.log"
(cd "$build/tests" && ctest --output-on-failure --no-tests=error >"$build/ctest.log" 2>&1) || true
count_ctest "$build/ctest.log"
leave_out 8 "of the C tests: a panicking library, AddressSanitizer, valgrind, symbols, three outside projects, the simulator"

echo "== one rollout a bundle, beside this machine's own"
steps=12
bundles=(tests/fixtures/tiny-upt tests/fixtures/tiny-upt-prior tests/fixtures/tiny-reduced onnx/brain-*)
if [ "$nightly" = 1 ]; then
  steps=120
else
  quick_bundles
fi
cc -O2 -I include tests/c/rollout.c tests/c/expect.c "$native/libupt.so" -o "$build/rollout"
ln -sf "$native/libupt.so" "$build/libupt.so.0"

# roll BUNDLE NAME [CORRECTIONS]: $build/NAME.here and $build/NAME.there
roll() {
  local bundle="$1" to="$build/$2"
  shift 2
  LD_LIBRARY_PATH="$build" ORT_DYLIB_PATH="$UPT_CROSS_HOST_ORT" \
    "$build/rollout" "$bundle" "$steps" "$to.here" "$@" >"$to.log" 2>&1 || cat "$to.log"
  run "$build/tests/$UPT_CROSS_ROLLOUT" "$bundle" "$steps" "$to.there" "$@" >"$to.log" 2>&1 || cat "$to.log"
}
for bundle in "${bundles[@]}"; do
  if [ -e "$bundle/bundle.json" ]; then compare "$bundle" "$(basename "$bundle")"; fi
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
