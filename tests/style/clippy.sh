#!/usr/bin/env bash
# cargo clippy of the workspace and of a build without features; nightly also of builds with a single feature, for WebAssembly and for Windows.
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

# other TRIPLE NAME WORDS...: for another platform, where its standard library is.
other() {
  local triple="$1" name="$2"
  shift 2
  if compgen -G "$(rustc --print target-libdir --target "$triple")/libstd-*" >/dev/null; then
    check "clippy for $name" cargo clippy --release --target "$triple" --no-default-features "$@" -- -D warnings
  else
    leave_out 1 "clippy for $name: rustup target add $triple"
  fi
}

lint --workspace
alone "libupt tissue" ""
if [ "${UPT_NIGHTLY:-0}" = 1 ]; then
  alone "libupt tissue" libupt/instruments
  alone "libupt tissue" libupt/learned,tissue/linear
  alone tissue files
  alone "upt-cli upt-study" "" # the demo's
  other wasm32-unknown-unknown WebAssembly --package libupt --lib --features instruments
  # What is built for Windows, and run there by Wine, in the nightly stage of that name.
  other x86_64-pc-windows-gnu Windows --package libupt --package upt-cli
else
  leave_out 4 "builds with a single feature: nightly; here is one with none"
  leave_out 2 "WebAssembly and Windows: nightly; the stage web compiles the module, without these lints"
fi

echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ]
