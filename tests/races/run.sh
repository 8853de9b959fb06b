#!/usr/bin/env bash
# What threads share without a lock: every interleaving (loom), undefined behaviour (Miri), races in the whole library (ThreadSanitizer).
#
#     tests/races/run.sh loom      # seconds, with the stable toolchain
#     tests/races/run.sh nightly   # Miri and ThreadSanitizer
#
# Miri and ThreadSanitizer need a nightly toolchain, which is never installed from here:
# `rustup toolchain install nightly --component miri,rust-src`. What is left out is named and counted as skipped; the last line is
# `N passed, N failed, N skipped`.
set -euo pipefail
root="${UPT_ROOT:-$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)}"
build="${UPT_BUILD_DIR:-$root/target}"
logs="$build/races-logs"
cd "$root"
mkdir -p "$logs"
source "$root/tests/cross/count.sh"

# tests NAME COMMAND...: counts what cargo ran.
tests() {
  local name="$1"
  shift
  "$@" >"$logs/$name.log" 2>&1 || true
  count_cargo "$logs/$name.log"
}

# count_tests FILE...: how many there are to leave out.
count_tests() {
  grep -hc '#\[test\]' "$@" | awk '{s += $1} END {print s}'
}

loom() {
  echo "== loom: the exchange between the steps and a hand"
  RUSTFLAGS="--cfg loom" tests loom cargo test --release -p libupt-exchange --tests --target-dir "$build/loom"
}

miri() {
  local file=crates/exchange/tests/exchange.rs
  echo "== Miri: the exchange"
  if grep -q '^miri' <<<"$components" && grep -q '^rust-src' <<<"$components"; then
    tests miri cargo +nightly miri test -p libupt-exchange --tests --target-dir "$build/miri"
  else
    leave_out "$(count_tests "$file")" "tests under Miri: no nightly toolchain with miri and rust-src"
  fi
}

thread_sanitizer() {
  local suites=(haptics present scene_states)
  echo "== ThreadSanitizer: the exchange, hands and frames beside steps, one scene used by several threads"
  if [ "$(uname -sm)" = "Linux x86_64" ] && grep -q '^rust-src' <<<"$components"; then
    export TSAN_OPTIONS="suppressions=$root/tests/races/suppressions.txt"
    sanitized() {
      RUSTFLAGS=-Zsanitizer=thread cargo +nightly test --release -Zbuild-std --target x86_64-unknown-linux-gnu \
        --no-fail-fast --target-dir "$build/tsan" "$@"
    }
    tests tsan-exchange sanitized -p libupt-exchange --tests
    # A program that reported a race ends with an error, which counts as a failure.
    tests tsan-upt sanitized -p libupt "${suites[@]/#/--test=}"
    grep -h -A 12 'WARNING: ThreadSanitizer' "$logs"/tsan-*.log | cut -c1-200 || true
  else
    local files
    files="$(for suite in "${suites[@]}"; do find tests -path "tests/$suite.rs" -or -path "tests/$suite/*.rs"; done)"
    # shellcheck disable=SC2086 # the files are words
    leave_out "$(count_tests crates/exchange/tests/exchange.rs $files)" \
      "tests under ThreadSanitizer: no nightly toolchain with rust-src on Linux x86-64"
  fi
}

components="$(rustup component list --toolchain nightly --installed 2>/dev/null || true)"
case "${1:-}" in
loom) loom ;;
nightly)
  miri
  thread_sanitizer
  ;;
*)
  echo "loom or nightly?" >&2
  exit 2
  ;;
esac

echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ]
