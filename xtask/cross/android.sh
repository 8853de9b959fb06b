# Sourced by toolchain.sh (`triple`, `cross`, `root`): Android on arm64, as far as it links.
#
# Android's C library and the unwinder that panics need come with Google's NDK, which no package registry has. In their place are
# libraries that hold nothing: what they would give stays open in the library, and tests/cross/android.py reads what that is.
if ! has_own "$triple"; then
  echo "Rust's standard library for $triple is missing, and Debian has none: rustup target add $triple" >&2
  exit 1
fi
stubs="$cross/android"
mkdir -p "$stubs"
for name in c m dl log unwind; do
  "$UPT_LLD" -flavor gnu -m aarch64linux -shared -soname "lib$name.so" -o "$stubs/lib$name.so" /dev/null
done
export CARGO_TARGET_AARCH64_LINUX_ANDROID_LINKER="$root/xtask/cross/lld.sh"
export CARGO_TARGET_AARCH64_LINUX_ANDROID_RUSTFLAGS="-Clinker-flavor=ld.lld -Lnative=$stubs"
