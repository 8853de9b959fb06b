# Sourced by toolchain.sh (`triple`, `cross`, `root`): macOS from Linux.
#
# What links is LLVM's linker of Rust's own toolchain. Of macOS it needs no more than a text that lists what the system's libraries
# export. The package `ziglang` of PyPI carries one for libSystem, which is taken out of it; libc and libm are libSystem by other
# names, and of libiconv and libc++ no more than a few names are needed.
if ! has_own "$triple"; then
  echo "Rust's standard library for $triple is missing, and Debian has none: rustup target add $triple" >&2
  exit 1
fi
sdk="$cross/macos"
# stub LIBRARY SYMBOL...: the text of one of the system's libraries.
stub() {
  local library="$1" symbols
  shift
  symbols="$(printf '%s, ' "$@")"
  printf '%s\n' '--- !tapi-tbd' 'tbd-version: 4' 'targets: [ x86_64-macos, arm64-macos ]' "install-name: '/usr/lib/$library'" \
    'exports:' '  - targets: [ x86_64-macos, arm64-macos ]' "    symbols: [ ${symbols%, } ]" '...'
}
if [ ! -e "$sdk/usr/lib/libc++.tbd" ]; then
  rm -rf "$sdk"
  mkdir -p "$sdk/usr/lib" "$sdk/wheel"
  "${UPT_PYTHON:-python3}" -m pip download --quiet --disable-pip-version-check --no-deps --dest "$sdk/wheel" ziglang==0.15.2 || {
    echo "no ziglang 0.15.2, which lists what macOS' libSystem exports: pip's package index must have it (PIP_INDEX_URL)" >&2
    exit 1
  }
  "${UPT_PYTHON:-python3}" - "$sdk" <<'PYTHON'
import sys
import zipfile
from pathlib import Path

sdk = Path(sys.argv[1])
with zipfile.ZipFile(next((sdk / "wheel").glob("*.whl"))) as wheel:
    text = wheel.read("ziglang/lib/libc/darwin/libSystem.tbd")
for name in ("System", "c", "m"):
    (sdk / f"usr/lib/lib{name}.tbd").write_bytes(text)
PYTHON
  rm -r "$sdk/wheel"
  stub libiconv.2.dylib _iconv _iconv_close _iconv_open >"$sdk/usr/lib/libiconv.tbd"
  # How the threads of faer, in the command `upt`, wait for each other.
  wait=__ZNSt3__1
  stub libc++.1.dylib "${wait}20__libcpp_atomic_waitEPVKvx" "${wait}23__libcpp_atomic_monitorEPVKv" \
    "${wait}23__cxx_atomic_notify_oneEPVKv" "${wait}23__cxx_atomic_notify_allEPVKv" >"$sdk/usr/lib/libc++.tbd"
fi
export SDKROOT="$sdk"
for arch in AARCH64 X86_64; do
  export "CARGO_TARGET_${arch}_APPLE_DARWIN_LINKER=$root/xtask/cross/lld.sh"
  export "CARGO_TARGET_${arch}_APPLE_DARWIN_RUSTFLAGS=-Clinker-flavor=ld64.lld"
done
