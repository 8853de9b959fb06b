#!/usr/bin/env bash
# The library for platforms that cannot be run here, as far as it can be built for them:
#
#   tests/cross/check.sh [TARGET...]
#
# macOS and Android: linked, and the file read (macho.py, android.py). MSVC: linked, its exports read, and run where Wine is. Others:
# cargo check. A target's standard library comes by `rustup target add`; one that cannot be had is named and counted as skipped.
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)"
cd "$root"
source "$root/tests/cross/count.sh"
source "$root/xtask/cross/target.sh"
source "$root/tests/cross/wheel.sh"
targets=("$@")
if [ $# -eq 0 ]; then
  targets=(aarch64-apple-darwin x86_64-apple-darwin aarch64-linux-android x86_64-pc-windows-msvc arm64ec-pc-windows-msvc)
fi
log="$root/target/cross/check.log"
mkdir -p "$root/target/cross"

# wheel_of TARGET LIBRARY: the wheel for a Mac, and what it says of itself.
wheel_of() {
  local build="$root/target/cross/$1" tag=macosx_11_0_arm64
  if [ "$1" = x86_64-apple-darwin ]; then tag=macosx_10_12_x86_64; fi
  mkdir -p "$build"
  make_wheel "$2" "$tag" && python3 tests/cross/wheel_file.py "$build"/wheels/*-"$tag".whl
}

built() {
  local target="$1" folder="$root/target/cross/build/$1/release"
  case "$target" in
    *-apple-darwin)
      xtask/cross/cargo.sh "$target" build --release -q -p libupt && python3 tests/cross/macho.py "$folder/libupt.dylib" include/upt.h \
        && made="$(tail -n 1 "$log")" && wheel_of "$target" "$folder/libupt.dylib" && echo "$made; $(tail -n 1 "$log"); it never ran"
      ;;
    aarch64-linux-android)
      xtask/cross/cargo.sh "$target" build --release -q -p libupt && python3 tests/cross/android.py "$folder/libupt.so" include/upt.h \
        && echo "$(tail -n 1 "$log"); it never ran"
      ;;
    x86_64-pc-windows-msvc)
      xtask/cross/cargo.sh "$target" build --release -q -p libupt && bash tests/cross/exports.sh "$folder/upt.dll" include/upt.h \
        && bash tests/cross/msvc.sh "$folder/upt.dll"
      ;;
    *) CARGO_TARGET_DIR="$root/target/cross/check" cargo check --release -q -p libupt --target "$target" && echo "it compiles; it never ran" ;;
  esac
}

for target in "${targets[@]}"; do
  if ! add_own "$target"; then
    leave_out 1 "$target: no standard library, and rustup gives none (rustup target add $target)"
  elif built "$target" >"$log" 2>&1; then
    pass "$target: $(tail -n 1 "$log")"
  else
    tail -n 20 "$log"
    fail "$target"
  fi
done
echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ]
