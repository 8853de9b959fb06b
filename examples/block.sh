#!/usr/bin/env bash
# Makes examples/block, the organ that the crate carries: a block of 80 x 80 x 40 mm that its bottom holds. Needs `upt` (cargo build --release -p upt-cli).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
printf '%s\n' 'v -40 -40 0' 'v 40 -40 0' 'v 40 40 0' 'v -40 40 0' 'v -40 -40 40' 'v 40 -40 40' 'v 40 40 40' 'v -40 40 40' \
  'f 1 3 2' 'f 1 4 3' 'f 5 6 7' 'f 5 7 8' 'f 1 2 6' 'f 1 6 5' 'f 2 3 7' 'f 2 7 6' 'f 3 4 8' 'f 3 8 7' 'f 4 1 5' 'f 4 5 8' >"$work/block.obj"
target/release/upt make "$work/block.obj" --out "$work/block" --fixed plane:0,0,-1,0.5 --domain ball:0,0,40,30 --nodes 420 \
  --patches 24 --natural 16 --material liver --license "Apache-2.0 OR MIT" --name block --minutes 2 --cases 2
rm -rf examples/block "$work/block/certificate.html"
mv "$work/block" examples/block
