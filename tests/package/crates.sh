# The packages for Rust's registry, as a user of Rust has them: unpacked in an empty folder, where nothing of the repository is, and
# a program of the user's that takes the library by its version. Offline: what it needs from the registry is here from the build.
# Sourced by run.sh (`check`, `root`, `work`).
crates="$work/crates"
mkdir -p "$crates/user/src/bin" "$crates/user/.cargo"
check crates bash -c "cd '$root' && cargo xtask package --platform crates --out '$work/dist-crates'"

crate_bills() {
  local file
  for file in "$work"/dist-crates/*.crate; do
    [ -s "$file.cdx.json" ] && [ -s "$file.spdx.json" ] || { echo "$file has no bill"; return 1; }
  done
  # What a build of the library links; the lanes alone know nothing of it.
  grep -q '"name": "ort"' "$work"/dist-crates/libupt-[0-9]*.cdx.json && ! grep -q '"name": "ort"' "$work"/dist-crates/libupt-lanes-*.cdx.json
}
check crate_bills crate_bills

unpack_crates() {
  local file
  for file in "$work"/dist-crates/*.crate; do tar -xzf "$file" -C "$crates" || return 1; done
  # In place of the registry, which has none of them yet.
  echo '[patch.crates-io]' >"$crates/user/.cargo/config.toml"
  for file in "$crates"/libupt*; do
    echo "$(basename "$file" | sed 's/-[0-9.]*$//') = { path = '$file' }" >>"$crates/user/.cargo/config.toml"
  done
}
check unpack_crates unpack_crates
library="$(find "$crates" -maxdepth 1 -name 'libupt-[0-9]*')"

# Two programs: the crate's front page, and the guide's.
user_project() {
  cp "$library/Cargo.lock" "$crates/user/" || return 1
  cat >"$crates/user/Cargo.toml" <<'TOML'
[package]
name = "user"
version = "0.0.0"
edition = "2024"
default-run = "user"

[workspace]

[dependencies]
upt = { package = "libupt", version = "0.1" }

[profile.layout]
inherits = "dev"
opt-level = 0
debug = false
incremental = false
TOML
  sed -n '/^\/\/! use std/,/^\/\/! ```$/s/^\/\/! \{0,1\}//p' "$library/src/lib.rs" | sed 's/^# //; /^```/d' >"$crates/user/src/main.rs"
  sed -n '/^```rust/,/^```$/p' "$library/docs/guide/rust.md" | sed '/^```/d' >"$crates/user/src/bin/guide.rs"
}
check user_project user_project
# In the workspace's profile of that name and beside it: what the registry has is built there already (stages `abi` and `c`).
target="$(cd "$root" && realpath -m "${CARGO_TARGET_DIR:-target}")"
check user_build env -C "$crates/user" CARGO_TARGET_DIR="$target" cargo build --offline --profile layout
check front_page env -C "$library" "$target/layout/user"
guide() {
  "$target/layout/guide" "$library/examples/block" >"$crates/guide.txt" && [ "$(grep -c 'force' "$crates/guide.txt")" -eq 20 ]
}
check guide guide
# The files of two libraries of one name are the same there: neither is taken for the other.
rm -rf "$target"/layout/{user,guide} "$target"/layout/.fingerprint/libupt-*
