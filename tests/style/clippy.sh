#!/usr/bin/env bash
# cargo clippy of the workspace, and of builds with a single feature or none, each of which must compile, tests included.
# Warnings are errors. The last line: N passed, N failed, N skipped.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.." || exit 1
source tests/cross/count.sh

lint() { check "clippy $*" cargo clippy --release --all-targets "$@" -- -D warnings; }

# alone PACKAGE FEATURE...: one build for each; "" is none.
alone() {
  local package="$1" feature
  shift
  for feature in "$@"; do lint --package "$package" --no-default-features --features="$feature"; done
}

lint --workspace
alone libupt "" instruments learned
alone tissue "" files linear
alone upt-cli "" # the demo's
alone upt-study ""
if compgen -G "$(rustc --print target-libdir --target wasm32-unknown-unknown)/libstd-*" >/dev/null; then
  check "clippy for WebAssembly" cargo clippy --release --package libupt --lib --target wasm32-unknown-unknown --no-default-features \
    --features instruments -- -D warnings
else
  leave_out 1 "clippy for WebAssembly: rustup target add wasm32-unknown-unknown"
fi

echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ]
