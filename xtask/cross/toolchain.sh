# Sourced with a target triple in $1: a Rust toolchain that can build for it, in the environment.
#
# The user's own toolchain where it has the target's standard library, or where rustup can add it. Else Debian's `rustc-web`
# with the standard library of the same version, unpacked below target/cross/rust and never installed: Debian builds the library for
# arm64, and for Windows cargo builds it from `rust-web-src`.
#
# Sets RUSTC, LD_LIBRARY_PATH, RUSTC_BOOTSTRAP where they are needed, CARGO_TARGET_DIR, the linker, and the array
# `build_std` of arguments for cargo.
triple="$1"
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)"
cross="$root/target/cross"
build_std=()

# Debian's packages $1... into target/cross/rust, from lists of their own that know arm64 too.
unpack_debian() {
  local apt="$cross/apt"
  mkdir -p "$apt/lists/partial" "$apt/cache/archives/partial" "$apt/state" "$cross/debs" "$cross/rust"
  cat >"$apt/apt.conf" <<CONF
APT::Architecture "amd64";
APT::Architectures { "amd64"; "arm64"; };
APT::Sandbox::User "";
Dir::State "$apt/state";
Dir::State::Lists "$apt/lists";
Dir::State::status "/var/lib/dpkg/status";
Dir::Cache "$apt/cache";
CONF
  export APT_CONFIG="$apt/apt.conf"
  apt-get update -q >"$cross/apt.log" 2>&1
  local version short llvm
  version="$(apt-cache show rustc-web | sed -n 's/^Version: //p' | sort -V | tail -n 1)"
  short="$(echo "$version" | cut -d. -f1,2)"
  llvm="$(apt-cache depends "libstd-rust-web-$short" | sed -n 's/^ *Depends: \(libllvm[0-9]*\)$/\1/p' | head -n 1)"
  rm -rf "$cross/debs" "$cross/rust"
  mkdir -p "$cross/debs" "$cross/rust"
  (
    cd "$cross/debs"
    apt-get download -q "rustc-web=$version" "libstd-rust-web-dev=$version" "libstd-rust-web-$short=$version" \
      "rust-web-src=$version" "libstd-rust-web-dev:arm64=$version" "$llvm" >>"$cross/apt.log" 2>&1
  )
  unset APT_CONFIG
  for deb in "$cross"/debs/*.deb; do
    dpkg-deb -x "$deb" "$cross/rust"
  done
  rm -r "$cross/debs"
  # The start and end of a program for MinGW; the rest of the library is built by cargo.
  local sysroot="$cross/rust/usr" objects
  objects="$sysroot/lib/rustlib/x86_64-pc-windows-gnu/lib"
  mkdir -p "$objects"
  for object in rsbegin rsend; do
    RUSTC_BOOTSTRAP=1 LD_LIBRARY_PATH="$sysroot/lib/x86_64-linux-gnu" "$sysroot/bin/rustc" \
      --target x86_64-pc-windows-gnu --emit=obj -o "$objects/$object.o" \
      "$sysroot/lib/rustlib/src/rust/library/rtstartup/$object.rs"
  done
  echo "$version" >"$cross/rust/version"
}

source "$root/xtask/cross/target.sh"
if ! has_own "$triple" && [ ! -e "$cross/rust/version" ] && ! add_own "$triple"; then
  echo "rustup gives no standard library for $triple: taking Debian's" >&2
fi
host="$(rustc -vV | sed -n 's/^host: //p')"
UPT_LLD="$(rustc --print sysroot)/lib/rustlib/$host/bin/rust-lld"
export UPT_LLD
case "$triple" in
  *-apple-darwin) source "$root/xtask/cross/macos.sh" ;;
  aarch64-linux-android) source "$root/xtask/cross/android.sh" ;;
  x86_64-pc-windows-msvc) source "$root/xtask/cross/msvc.sh" ;;
esac
if ! has_own "$triple"; then
  if [ ! -e "$cross/rust/version" ]; then
    unpack_debian
  fi
  export RUSTC="$cross/rust/usr/bin/rustc"
  export LD_LIBRARY_PATH="$cross/rust/usr/lib/x86_64-linux-gnu${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}"
  if [ "$triple" = x86_64-pc-windows-gnu ]; then
    export RUSTC_BOOTSTRAP=1
    build_std=("-Zbuild-std=std,panic_unwind,test")
  fi
fi
export CARGO_TARGET_DIR="$cross/build"
export CARGO_TARGET_X86_64_PC_WINDOWS_GNU_LINKER=x86_64-w64-mingw32-gcc
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc
