# Sourced by run.sh: Windows x86-64, built by MinGW, run by Wine.
export UPT_CROSS_TRIPLE=x86_64-pc-windows-gnu
export UPT_CROSS_SYSTEM=Windows UPT_CROSS_PROCESSOR=x86_64 UPT_CROSS_PREFIX=x86_64-w64-mingw32-
export UPT_CROSS_ORT_NAME=onnxruntime.dll UPT_CROSS_ROLLOUT=rollout.exe UPT_CROSS_COMMAND=upt.exe

# Debian keeps it off the PATH, in its package's own folder.
wine=""
for candidate in "$(command -v wine64 || true)" /usr/lib/wine/wine64 /usr/lib/wine-development/wine64; do
  if [ -z "$wine" ] && [ -x "$candidate" ]; then wine="$candidate"; fi
done
if [ -z "$wine" ]; then
  echo "skipped: wine64 is not installed"
  echo "0 passed, 0 failed, 1 skipped"
  exit 0
fi
export WINEPREFIX="$build/wine" WINEDEBUG=-all WINEDLLOVERRIDES="mscoree,mshtml="
unset DISPLAY
export CARGO_TARGET_X86_64_PC_WINDOWS_GNU_RUNNER="$wine" UPT_CROSS_RUN="$wine"

run() {
  "$wine" "$@"
}

prepare() {
  local system="$WINEPREFIX/drive_c/windows/system32"
  if [ ! -e "$system/bcryptprimitives.dll" ]; then
    # On a busy machine Wine's server now and then ends before the prefix is there.
    local left=3
    until "$wine" wineboot -i >"$build/wineboot.log" 2>&1; do
      left=$((left - 1))
      if [ "$left" = 0 ]; then
        cat "$build/wineboot.log"
        echo "Wine makes no prefix in $WINEPREFIX"
        return 1
      fi
      sleep 5
    done
    # Wine 8 has no bcryptprimitives.dll, which Rust's std takes random numbers from; in the test's prefix only.
    x86_64-w64-mingw32-gcc -O2 -shared -o "$system/bcryptprimitives.dll" "$root/tests/cross/process_prng.c" -ladvapi32
  fi
  # Beside the programs, as in a package.
  cp "$UPT_CROSS_ORT/onnxruntime.dll" "$1/onnxruntime.dll"
}

# Where the loader finds upt.dll and ONNX Runtime.
installed() {
  cp "$UPT_CROSS_ORT/onnxruntime.dll" "$1/bin/onnxruntime.dll"
  WINEPATH="$(printf 'Z:%s' "$1/bin" | tr / '\\')"
  export WINEPATH
}

# The processor's lanes are those of Linux: what every run tests is the platform.
quick_tests() {
  leave_out "$(tests_in src tests crates/tissue crates/elements crates/contact crates/exchange crates/field crates/kernels crates/bundle crates/prior crates/implicit crates/lanes)" "tests of the crates: nightly"
}

quick_bundles() {
  :
}

# compare BUNDLE NAME: the same bytes.
compare() {
  roll "$@"
  check "$2: displacements equal to Linux to the bit" cmp "$build/$2.here" "$build/$2.there"
}

# The C library's sine and logarithm are another's: what is left of them is far below a float's digits at 1 mm.
compare_trajectories() {
  check "reference solver: displacements of Linux within 1e-9 mm" python3 tests/cross/difference.py "$1" "$2" 1e-9
}

# What only Windows has.
more() {
  local text
  text="$(run "$1/upt.exe" doctor onnx/brain-coarse-reduced 2>/dev/null | tr -d '\r')"
  check "upt doctor opens a bundle" grep -q '^ok  bundle .*brain-coarse-reduced' <<<"$text"
  lanes "$text"
  # ONNX Runtime without Microsoft's C++ runtime, of which Wine has its own.
  text="$(WINEDLLOVERRIDES="$WINEDLLOVERRIDES;msvcp140=" run "$1/upt.exe" doctor onnx/brain-coarse-reduced 2>/dev/null || true)"
  check "upt doctor names the Visual C++ redistributable where it is missing" grep -q 'Visual C++ redistributable' <<<"$text"
  # A reader that goes away: the command ends without a panic.
  (run "$1/upt.exe" completions bash 2>"$build/pipe.log" || true) | head -c 1 >/dev/null || true
  check "a closed pipe ends the command quietly" bash -c '! grep -qi panicked "$1"' _ "$build/pipe.log"
  # A host that is built by Microsoft's linker: an import library of its own kind, and a program linked by lld-link.
  bash "$root/xtask/cross/import_library.sh" "$1" "$build"
  x86_64-w64-mingw32-gcc -c -O2 -I include -o "$build/msvc.obj" tests/cross/msvc_host.c
  check "lld-link links a host against upt.lib" bash tests/cross/lld_link.sh "$build"
  check "and the host runs" run "$build/msvc.exe"
  leave_out 1 "the Unity package's C# under Mono for Windows: Debian has no Mono for Windows; the dll's exports are compared instead"
  wheel "$1"
  check "upt.dll exports what upt.h declares" bash tests/cross/exports.sh "$1/upt.dll" include/upt.h
}

# Neither Debian nor PyPI has a Python for Windows: a C program loads the wheel's library in its place.
wheel() {
  make_wheel "$1/upt.dll" win_amd64
  local inside="$build/wheel/upt/lib/upt.dll"
  check "the wheel is tagged win_amd64, and what it says of itself is so" \
    python3 tests/cross/wheel_file.py "$build"/wheels/*-win_amd64.whl
  x86_64-w64-mingw32-objdump -p "$inside" | sed -n 's/^.*\[ *[0-9]*\].* \(upt_[a-z_]*\)$/\1/p' >"$build/wheel.exports"
  check "its dll exports what the package calls" python3 tests/cross/wheel_calls.py "$build/wheel" "$build/wheel.exports"
  local path
  path="$(printf 'Z:%s;Z:%s' "${inside%/*}" "$UPT_CROSS_ORT" | tr / '\\')"
  WINEPATH="$path" run "$build/tests/$UPT_CROSS_ROLLOUT" tests/fixtures/tiny-reduced "$steps" "$build/wheel.there" \
    >"$build/wheel.log" 2>&1 || cat "$build/wheel.log"
  check "and steps as on Linux, to the bit" cmp "$build/tiny-reduced.here" "$build/wheel.there"
  leave_out 1 "the wheel in a Python for Windows: neither Debian nor PyPI has one"
}
