#!/usr/bin/env bash
# cargo clippy of the workspace, and of builds with a single feature or none, each of which must compile, tests included.
# Warnings are errors. The last line: N passed, N failed, N skipped.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.." || exit 1
source tests/cross/count.sh

lint() { check "clippy $*" cargo clippy --release --all-targets "$@" -- -D warnings; }

# alone PACKAGES FEATURES: those packages with nothing but these features. What is checked together shares its dependencies, which differ in
# their features from one build to the next and are most of the work.
alone() {
  local package packages=()
  for package in $1; do packages+=(--package "$package"); done
  lint "${packages[@]}" --no-default-features --features="$2"
}

lint --workspace
alone "libupt tissue" ""
alone "libupt tissue" libupt/instruments
alone "libupt tissue" libupt/learned,tissue/linear
alone tissue files
alone "upt-cli upt-study" "" # the demo's
if compgen -G "$(rustc --print target-libdir --target wasm32-unknown-unknown)/libstd-*" >/dev/null; then
  check "clippy for WebAssembly" cargo clippy --release --package libupt --lib --target wasm32-unknown-unknown --no-default-features \
    --features instruments -- -D warnings
else
  leave_out 1 "clippy for WebAssembly: rustup target add wasm32-unknown-unknown"
fi

echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ]
