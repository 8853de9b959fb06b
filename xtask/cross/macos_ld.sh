#!/usr/bin/env bash
# The linker for macOS that rustc calls with the flavor `ld64.lld`: LLVM's, as Rust's own toolchain brings it (UPT_MACOS_LLD).
set -euo pipefail
words=()
for word in "$@"; do
  case "$word" in
    # Meant for a compiler, which passes it on.
    -Wl,*) IFS=, read -r -a parts <<<"${word#-Wl,}" && words+=("${parts[@]}") ;;
    *) words+=("$word") ;;
  esac
done
exec "$UPT_MACOS_LLD" "${words[@]}"
