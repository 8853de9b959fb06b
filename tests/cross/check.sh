#!/usr/bin/env bash
# cargo check of the library for platforms that cannot be run here: which of them compile, nothing more.
#
#   tests/cross/check.sh [TARGET...]
#
# A target's standard library comes by `rustup target add`; one that is missing is named and counted as skipped.
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)"
cd "$root"
source "$root/tests/cross/count.sh"
targets=("$@")
if [ $# -eq 0 ]; then
  targets=(aarch64-apple-darwin aarch64-linux-android arm64ec-pc-windows-msvc)
fi
log="$root/target/cross/check.log"
mkdir -p "$root/target/cross"
for target in "${targets[@]}"; do
  if ! compgen -G "$(rustc --print target-libdir --target "$target")/libstd-*" >/dev/null; then
    leave_out 1 "$target: no standard library (rustup target add $target)"
  elif CARGO_TARGET_DIR="$root/target/cross/check" cargo check --release -q -p libupt --target "$target" >"$log" 2>&1; then
    pass "$target: the library compiles ($(grep -c '^warning: ' "$log" || true) warnings); it was never run"
  else
    tail -n 20 "$log"
    fail "$target"
  fi
done
echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ]
