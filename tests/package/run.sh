#!/usr/bin/env bash
# Makes the archive and the Unity package, unpacks them in an empty folder, and uses the archive as an outsider would:
# the C example by find_package and by pkg-config, the command, all with nothing of this repository on any path.
# Environment: UPT_ROOT, UPT_BUILD_DIR (cargo xtask test sets them). Last line: "N passed, N failed, N skipped".
set -uo pipefail
root="${UPT_ROOT:-$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)}"
work="${UPT_BUILD_DIR:-$root/target}/package-test"
passed=0
failed=0

check() {
  local name="$1"
  shift
  if "$@" >"$work/$name.log" 2>&1; then
    passed=$((passed + 1))
    echo "ok $name"
  else
    failed=$((failed + 1))
    echo "FAILED $name; the end of $work/$name.log:"
    tail -n 20 "$work/$name.log"
  fi
}

rm -rf "$work"
mkdir -p "$work/elsewhere"
cd "$root" || exit 1
check archive cargo xtask package --out "$work/dist"
check unity_package cargo xtask package --unity --out "$work/dist"
archive="$(find "$work/dist" -name 'libupt-*.tar.gz' | head -n 1)"
# The same commit gives the same bytes.
check archive_again cargo xtask package --out "$work/again"
same_bytes() {
  local ending name
  name="$(basename "${archive:-none}")"
  for ending in "" .cdx.json .spdx.json; do
    cmp "$work/dist/$name$ending" "$work/again/$name$ending" || return 1
  done
}
check same_bytes same_bytes
checksums() { (cd "$work/dist" && sha256sum --check --strict SHA256SUMS); }
check checksums checksums
check unpack tar -xzf "${archive:-none}" -C "$work/elsewhere"
# Nothing may depend on where the archive was made.
rm -rf "$work"/dist/libupt-*/ "$work/again"
prefix="$(find "$work/elsewhere" -mindepth 1 -maxdepth 1 -type d | head -n 1)"
check bill_of_materials python3 tests/package/sbom.py "${archive:-none}" "$prefix"
# Packages that this run does not build have bills, too.
check bills_of_others "${UPT_PYTHON:-$root/target/venv/bin/python}" tests/package/bills.py "$work/bills"
unset ORT_DYLIB_PATH LD_LIBRARY_PATH UPT_LIB_DIR UPT_INCLUDE_DIR UPT_BUNDLES
cd "$work/elsewhere" || exit 1

complete() {
  local file
  for file in lib/libupt.so lib/libonnxruntime.so lib/libupt.a lib/pkgconfig/upt.pc include/upt.h include/upt.hpp bin/upt \
    share/doc/upt/LICENSE-APACHE share/doc/upt/LICENSE-MIT share/doc/upt/NOTICE share/doc/upt/THIRD-PARTY.txt \
    share/doc/upt/onnxruntime/LICENSE share/doc/upt/docs/guide/instruments.md share/doc/upt/docs/guide/scene.md; do
    [ -e "$prefix/$file" ] || { echo "$file is missing"; return 1; }
  done
  grep -q '^ort v' "$prefix/share/doc/upt/THIRD-PARTY.txt"
  # MIT asks for its text, not only for its name.
  grep -q 'Permission is hereby granted' "$prefix/share/doc/upt/THIRD-PARTY.txt"
}
check complete complete

no_build_paths() {
  ! grep -rlF "$root" "$prefix/lib/cmake" "$prefix/lib/pkgconfig" "$prefix/share/doc"
}
check no_build_paths no_build_paths
# What two builds in two folders differ in: local symbols and the number of the build.
stripped() {
  local file
  for file in lib/libupt.so bin/upt; do
    ! readelf --sections --wide "$prefix/$file" | grep -E 'symtab|build-id' || return 1
  done
}
check stripped stripped
check documents "${UPT_PYTHON:-$root/target/venv/bin/python}" "$root/tests/docs/links.py" "$prefix/share/doc/upt"

bundle="$(find "$prefix/share/upt/bundles" -mindepth 1 -maxdepth 1 -type d 2>/dev/null | sort | head -n 1)"
check cmake_configure cmake -S "$prefix/share/upt/examples/c" -B "$work/c" -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_BUILD_TYPE=Release
check cmake_build cmake --build "$work/c"
check c_example "$work/c/minimal" "$bundle" 20
# The archive as a project fetches it, by its hash.
fetch_content() {
  local hash
  hash="$(sha256sum "$archive" | cut -d ' ' -f 1)"
  mkdir -p "$work/fetch" && cp "$prefix/share/upt/examples/c/minimal.c" "$work/fetch/" || return 1
  {
    echo 'cmake_minimum_required(VERSION 3.16)'
    echo 'project(fetch C)'
    sed -n '/^include(FetchContent)/,/^```/p' "$root/docs/guide/c.md" | sed '/^```/d' \
      | sed "s#URL /[^ ]*#URL \"$archive\"#; s#SHA256=[^)]*#SHA256=$hash#"
    echo 'add_executable(minimal minimal.c)'
    echo 'target_link_libraries(minimal PRIVATE upt::upt m)'
  } >"$work/fetch/CMakeLists.txt"
  cmake -S "$work/fetch" -B "$work/fetch/build" && cmake --build "$work/fetch/build" && "$work/fetch/build/minimal" "$bundle" 20
}
check fetch_content fetch_content
pkg_config_build() {
  # shellcheck disable=SC2046 # the flags are words
  PKG_CONFIG_PATH="$prefix/lib/pkgconfig" cc "$prefix/share/upt/examples/c/minimal.c" -o "$work/minimal-pc" \
    $(PKG_CONFIG_PATH="$prefix/lib/pkgconfig" pkg-config --cflags --libs upt) -lm "-Wl,-rpath,$prefix/lib"
}
check pkg_config_build pkg_config_build
check pkg_config_example "$work/minimal-pc" "$bundle" 20
# The first page for C as the archive has it, word for word, with nothing but the archive.
page="$prefix/share/doc/upt/docs/guide/c.md"
block() { awk -v begin='```'"$1" '/^```/ { inside = $0 == begin && !seen++; next } inside' "$page"; }
first_page() {
  mkdir -p "$work/first" && cd "$work/first" || return 1
  block cmake >CMakeLists.txt
  block 'c complete' >first.c
  cmake -S . -B build -DCMAKE_PREFIX_PATH="$prefix" && cmake --build build || return 1
  build/first "$prefix/share/upt/bundles/brain" | grep 'force  *-*[1-9]' || return 1
  block sh >first.sh
  PREFIX="$prefix" bash -euo pipefail first.sh | grep 'force  *-*[1-9]'
}
check first_page first_page
check doctor "$prefix/bin/upt" doctor "$bundle"

unity_complete() {
  local listing
  listing="$(tar -tzf "$(find "$work/dist" -name 'org.libupt.*.tgz' | head -n 1)")" || return 1
  local name
  for name in package/package.json package/Runtime/Interop/Native.g.cs libupt.so libupt.so.meta libonnxruntime.so; do
    grep -q "$name\$" <<<"$listing" || { echo "$name is missing"; return 1; }
  done
  # Nothing of other platforms, whose libraries are not there: Unity would warn about each .meta without its file.
  ! grep -E 'Plugins/(Windows|macOS)' <<<"$listing"
}
check unity_complete unity_complete
# shellcheck source=tests/package/crates.sh
source "$root/tests/package/crates.sh"
# shellcheck source=tests/package/recipes.sh
source "$root/tests/package/recipes.sh"

# The first page for Unity with nothing but its package.
if command -v mcs >/dev/null && command -v mono >/dev/null; then
  check unity_first_page "$root/tests/csharp/first_page.sh" "$(find "$work/dist" -name 'org.libupt.*.tgz' | head -n 1)" "$work/unity"
else
  leave_out 1 "the first page for Unity: mcs or mono is missing (Debian: apt-get install mono-mcs mono-runtime)"
fi

echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ]
