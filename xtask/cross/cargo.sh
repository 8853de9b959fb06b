#!/usr/bin/env bash
# cargo for another platform:
#
#   xtask/cross/cargo.sh x86_64-pc-windows-gnu build --release -p libupt
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/toolchain.sh" "$1"
command="$2"
shift 2
exec cargo "$command" --target "$triple" "${build_std[@]}" "$@"
