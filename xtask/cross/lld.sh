#!/usr/bin/env bash
# LLVM's linker as Rust's own toolchain brings it (UPT_LLD), which rustc calls with a flavor of it: for macOS and Android.
set -euo pipefail
words=()
for word in "$@"; do
  case "$word" in
    # Meant for a compiler, which passes it on.
    -Wl,*) IFS=, read -r -a parts <<<"${word#-Wl,}" && words+=("${parts[@]}") ;;
    *) words+=("$word") ;;
  esac
done
exec "$UPT_LLD" "${words[@]}"
