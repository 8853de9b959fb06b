# Sourced by toolchain.sh and tests/cross/check.sh (`root`): whether the user's own Rust has the standard library of a target.

# has_own TARGET
has_own() {
  compgen -G "$(rustc --print target-libdir --target "$1")/libstd-*" >/dev/null
}

# add_own TARGET: has it from rustup where there is none; fails where rustup is missing or cannot.
add_own() {
  if has_own "$1"; then return 0; fi
  if ! command -v rustup >/dev/null; then return 1; fi
  mkdir -p "$root/target/cross"
  timeout 300 rustup target add "$1" >"$root/target/cross/rustup.log" 2>&1 && has_own "$1"
}
