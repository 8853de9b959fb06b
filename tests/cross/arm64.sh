# Sourced by run.sh: Linux arm64, run by qemu's user mode.
export UPT_CROSS_TRIPLE=aarch64-unknown-linux-gnu
export UPT_CROSS_SYSTEM=Linux UPT_CROSS_PROCESSOR=aarch64 UPT_CROSS_PREFIX=aarch64-linux-gnu-
export UPT_CROSS_ORT_NAME=libonnxruntime.so UPT_CROSS_ROLLOUT=rollout UPT_CROSS_COMMAND=upt
# mm: other vector lanes add up in another order, and ONNX Runtime is another build (2e-6 was seen).
rollout_tolerance=1e-5
# Corrections carry such a rounding on, whatever their number: x86-64 differs from itself in the same way, by 5e-4 at most between its lanes
# and UPT_ISA=scalar, with a fixed number (1 to 30) as with a target. Without corrections the same bundle keeps to the first tolerance.
corrected_tolerance=1e-3
# The solver adds up thousands of steps.
solver_tolerance=1e-3

source "$root/tests/cross/python_arm64.sh"
qemu="$(command -v qemu-aarch64-static || command -v qemu-aarch64 || true)"
if [ -z "$qemu" ]; then
  echo "skipped: qemu-user-static is not installed"
  echo "0 passed, 0 failed, 1 skipped"
  exit 0
fi
# ONNX Runtime reads /proc/cpuinfo and crashes on that of another processor: under qemu's root lies an ARM one.
system="$build/system"
mkdir -p "$system/proc"
cat >"$system/proc/cpuinfo" <<'CPU'
processor	: 0
BogoMIPS	: 243.75
Features	: fp asimd evtstrm aes pmull sha1 sha2 crc32 atomics fphp asimdhp cpuid asimdrdm lrcpc dcpop asimddp
CPU implementer	: 0x41
CPU architecture: 8
CPU variant	: 0x3
CPU part	: 0xd0c
CPU revision	: 1
CPU
ln -sfn /usr/aarch64-linux-gnu/lib "$system/lib"
cat >"$build/run" <<RUN
#!/bin/sh
exec env LD_LIBRARY_PATH="\$UPT_CROSS_LIBRARIES" "$qemu" -cpu neoverse-n1 -L "$system" "\$@"
RUN
chmod +x "$build/run"
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER="$build/run" UPT_CROSS_RUN="$build/run"
export UPT_CROSS_LIBRARIES="$build/prefix/lib:/usr/aarch64-linux-gnu/lib"

run() {
  "$build/run" "$@"
}

prepare() {
  :
}

installed() {
  cp "$UPT_CROSS_ORT/libonnxruntime.so" "$1/lib/libonnxruntime.so"
}

# The lanes: kernels of elements, contact and the library.
quick_tests() {
  unit_tests -p libupt-elements -p libupt-contact -p libupt-exchange -p libupt-field -p libupt-kernels -p libupt-bundle -p libupt-prior -p libupt-implicit -p libupt-lanes --lib --tests
  unit_tests -p libupt --lib
  leave_out "$(tests_in tests crates/tissue)" "tests of the library's calls and of the reference solver: nightly"
}

# One of each kind; that of the brain corrects.
quick_bundles() {
  local all="${#bundles[@]}"
  bundles=(tests/fixtures/tiny-upt-prior onnx/brain-coarse-reduced)
  leave_out "$((all - ${#bundles[@]}))" "bundles: nightly"
}

# within NAME TOLERANCE WHAT
within() {
  check "$1: displacements of x86-64 within $2 mm$3" \
    python3 tests/cross/difference.py "$build/$1.here" "$build/$1.there" "$2"
}

# compare BUNDLE NAME
compare() {
  roll "$@"
  if ! grep -q '"corrections"' "$1/bundle.json"; then
    within "$2" "$rollout_tolerance" ""
    return
  fi
  within "$2" "$corrected_tolerance" ""
  roll "$1" "$2-plain" 0
  within "$2-plain" "$rollout_tolerance" ", without corrections"
}

compare_trajectories() {
  check "reference solver: displacements of x86-64 within $solver_tolerance mm" \
    python3 tests/cross/difference.py "$1" "$2" "$solver_tolerance"
}

# The lanes that ran, from the command itself.
more() {
  local text
  text="$(run "$1/upt" doctor onnx/brain-coarse-reduced 2>/dev/null)"
  check "upt doctor opens a bundle with NEON kernels" grep -q 'kernels neon' <<<"$text"
  lanes "$text"
  portable "$1"
  make_wheel "$1/libupt.so" linux_aarch64
  check "the wheel is tagged manylinux for aarch64, and what it says of itself is so" \
    python3 tests/cross/wheel_file.py "$build"/wheels/*-manylinux_*_aarch64.whl
  if [ "$nightly" = 1 ]; then
    wheel
  else
    leave_out "$(grep -h '^def test_' python/tests/test_*.py | wc -l)" "tests of the Python wheel in Debian's Python for arm64: nightly"
  fi
}

# A tool that presses a portable model: to the bit what it does here.
portable() {
  cc -O2 -I include tests/web/press.c "$native/libupt.so" -o "$build/press.x86-64"
  "${UPT_CROSS_PREFIX}gcc" -O2 -I include tests/web/press.c "$1/libupt.so" -o "$build/press"
  ln -sf "$1/libupt.so" "$build/prefix/lib/libupt.so.0"
  LD_LIBRARY_PATH="$build" "$build/press.x86-64" onnx/liver-coarse 32 3 "$build/press.here" >"$build/press.log"
  run "$build/press" onnx/liver-coarse 32 3 "$build/press.there" >"$build/press.log" || true
  check "a portable model has the bits of x86-64 with NEON" cmp "$build/press.here" "$build/press.there"
}

# The wheel in Debian's Python for arm64: it finds its own libupt, and ONNX Runtime in the package onnxruntime.
wheel() {
  local python="$root/target/cross/python-arm64"
  if ! debian_python "$python"; then
    fail "Debian's Python for arm64 was not unpacked"
    return
  fi
  local libraries="$python/root/usr/lib/aarch64-linux-gnu:$python/root/lib/aarch64-linux-gnu:/usr/aarch64-linux-gnu/lib"
  (
    cd "$build"
    unset ORT_DYLIB_PATH UPT_LIBRARY
    UPT_CROSS_LIBRARIES="$libraries" PYTHONHOME="$python/root/usr" PYTHONPATH="$build/wheel:$python/packages" \
      run "$python/root/usr/bin/python3" -m pytest -q -p no:cacheprovider "$root"/python/tests/test_scene.py \
      "$root"/python/tests/test_instruments.py "$root"/python/tests/test_batch.py >"$build/pytest.log" 2>&1
  ) || true
  count_pytest "$build/pytest.log"
  leave_out 3 "files of the wheel's tests, which need more packages or time: examples, errors, haptics"
}
