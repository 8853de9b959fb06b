# The recipes of packaging/, from the archive, offline: what Conan makes, the steps of the vcpkg port, a Debian source package; the C example built
# against the first two. Sourced by run.sh (`check`, `root`, `work`, `archive`, `bundle`).
skipped=0
leave_out() {
  skipped=$((skipped + $1))
  echo "skipped: $2"
}

recipes() { python3 "$root/packaging/recipes.py" "$archive" --address "file://$(dirname "$archive")" --out "$work/recipes"; }
check recipes recipes

vcpkg_port() {
  cmake -DPORT="$work/recipes/vcpkg/libupt" -DPACKAGES="$work/vcpkg" -P "$root/tests/package/vcpkg.cmake" || return 1
  cmake -S "$root/examples/c" -B "$work/vcpkg-c" -DCMAKE_PREFIX_PATH="$work/vcpkg" && cmake --build "$work/vcpkg-c" || return 1
  "$work/vcpkg-c/minimal" "$bundle" 20
}
check vcpkg_port vcpkg_port
# Another archive than the one whose hash the port has is refused.
vcpkg_other() {
  sed -i 's/UPT_SHA512 ...../UPT_SHA512 00000/' "$work/recipes/vcpkg/libupt/archives.cmake" || return 1
  ! cmake -DPORT="$work/recipes/vcpkg/libupt" -DPACKAGES="$work/vcpkg-other" -P "$root/tests/package/vcpkg.cmake" || return 1
  [ ! -e "$work/vcpkg-other/lib" ]
}
check vcpkg_other vcpkg_other

conan="$(dirname "${UPT_PYTHON:-$root/target/venv/bin/python}")/conan"
[ -x "$conan" ] || conan="$(command -v conan || true)"
conan_package() {
  export CONAN_HOME="$work/conan-home"
  "$conan" profile detect || return 1
  UPT_TEST_BUNDLE="$bundle" "$conan" create "$work/recipes/conan" --no-remote
}
if [ -n "$conan" ]; then
  check conan_package conan_package
else
  leave_out 1 "conan_package: Conan is missing (pip install conan)"
fi

debian_source() {
  bash "$root/packaging/debian.sh" "$work/dist-crates" "$work/debian" || return 1
  # What cargo would build lies in it, but for the crates of the registry.
  (cd "$work/debian" && rm -rf built && dpkg-source --extract ./*.dsc built && cd built && cargo tree --offline --quiet --package libupt) || return 1
}
lintian_accepts() { lintian --allow-root --fail-on error,warning "$work"/debian/*.dsc; }
if command -v dpkg-source >/dev/null; then
  check debian_source debian_source
  if command -v lintian >/dev/null; then
    check lintian_accepts lintian_accepts
  else
    leave_out 1 "lintian_accepts: lintian is missing (apt-get install lintian)"
  fi
else
  leave_out 2 "debian_source, lintian_accepts: dpkg-dev is missing"
fi
