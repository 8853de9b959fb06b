#!/usr/bin/env bash
# libupt in WebAssembly: the package in Node, beside the native library, and the site in headless Chromium.
#
#   UPT_WASM=upt.wasm UPT_SITE=FOLDER UPT_NPM=FOLDER tests/web/run.sh
#
# Reads what tests/c/run.sh reads; UPT_WASM is built with the feature `fault`. UPT_NPM is what the npm package holds. The last line is `N passed, N failed, N skipped`.
set -euo pipefail
root="${UPT_ROOT:-$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)}"
build="${UPT_BUILD_DIR:-$root/target}/web/tests"
native="${UPT_LIB_DIR:-$root/target/release}"
cd "$root"
rm -rf "$build"
mkdir -p "$build"
source tests/cross/count.sh

echo "== what portable lanes compute natively, and scalar ones"
cc -O2 -I include tests/web/press.c "$native/libupt.so" -Wl,-rpath,"$build" -o "$build/press"
ln -s "$native/libupt.so" "$build/libupt.so.0"
# press BUNDLE CORRECTIONS: 0 is as many as the bundle recommends.
press() {
  local file
  file="$build/$(basename "$1").$2"
  "$build/press" "$1" 32 "$2" "$file.bin" >"$build/times"
  UPT_ISA=scalar "$build/press" "$1" 32 "$2" "$file.scalar" >"$build/times"
  check "$1, $2 corrections: scalar lanes have the bits of $(uname -m)'s" cmp "$file.bin" "$file.scalar"
}
press onnx/liver-coarse 3
press onnx/liver-coarse 0
press onnx/brain 3

# add COMMAND...: runs it and adds up its last line.
add() {
  local line
  "$@" | tee "$build/log" || true
  line="$(tail -n 1 "$build/log")"
  if [[ "$line" =~ ^([0-9]+)\ passed,\ ([0-9]+)\ failed,\ ([0-9]+)\ skipped$ ]]; then
    passed=$((passed + BASH_REMATCH[1]))
    failed=$((failed + BASH_REMATCH[2]))
    skipped=$((skipped + BASH_REMATCH[3]))
  else
    fail "$*"
  fi
}
echo "== in Node"
add node tests/web/node.mjs "$root" "$UPT_WASM" "$build"
add node tests/web/download.mjs "$root" "$UPT_WASM"
add node tests/web/unity.mjs "$root" "$UPT_WASM"
upt="${UPT_PROGRAM:-$root/target/release/upt}"
if [ -x "$upt" ]; then
  check "what the module records has the bits of $(uname -m)'s" "$upt" replay "$build/module.replay" --bundle onnx/liver-coarse --verify
else
  leave_out 1 "a recording of the module: $upt is not there"
fi
echo "== the first page, with nothing but the package"
first_page() (
  mkdir -p "$build/first" && cd "$build/first" || exit 1
  npm pack --silent --pack-destination . "$UPT_NPM" >packed || exit 1
  npm install --silent --offline --no-audit --no-fund --prefix . "./$(cat packed)" || exit 1
  sed -n '/^```js first$/,/^```$/p' node_modules/libupt/README.md | sed '/^```/d' >first.mjs
  node first.mjs | tee said
  # The block is pushed down, so it pushes up.
  grep -Eqx '448 nodes, force -?[0-9]+, -?[0-9]+, [1-9][0-9]* mN' said
)
check "README of the package runs in Node" first_page
same_words() { diff <(sed -n '/^```js first$/,/^```$/p' web/README.md) <(sed -n '/^```js first$/,/^```$/p' docs/guide/web.md); }
check "the guide begins with the same program" same_words
echo "== React three fiber: types and build, with packages of npm that stay between runs"
react="${UPT_BUILD_DIR:-$root/target}/web/react"
mkdir -p "$react"
react_packages() (
  cmp -s examples/web/react/package.json "$react/package.json" && exit 0
  cp examples/web/react/package.json "$react/wanted.json" && cd "$react" || exit 1
  cp wanted.json package.json
  # What is there in part is no better than nothing.
  timeout 120 npm install --silent --no-audit --no-fund --no-package-lock || { rm -f package.json; exit 1; }
)
react_built() (
  cp examples/web/react/*.tsx examples/web/react/*.json examples/web/react/*.html "$react" && cd "$react" || exit 1
  mkdir -p node_modules/libupt && cp -r "$UPT_NPM"/* node_modules/libupt && npm run --silent check && npm run --silent build
)
if react_packages; then
  check "the example for React three fiber has right types, and builds" react_built
  export UPT_REACT="$react"
else
  leave_out 2 "the example for React three fiber: npm has no packages here"
fi
echo "== in a browser"
add python3 tests/web/page.py "$UPT_SITE"

echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ]
