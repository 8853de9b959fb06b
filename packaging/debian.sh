#!/usr/bin/env bash
# debian.sh CRATES OUT: a Debian source package in OUT (libupt_VERSION.orig.tar.gz, .debian.tar.xz, .dsc), from the packages for crates.io
# in CRATES (`cargo xtask package --platform crates --out CRATES`). `apt-get install dpkg-dev` has what it needs.
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
crates="$(realpath "$1")"
mkdir -p "$2"
out="$(realpath "$2")"
library="$(find "$crates" -maxdepth 1 -name 'libupt-[0-9]*.crate')"
version="$(basename "$library" .crate)"
version="${version#libupt-}"
tree="$out/libupt-$version"
rm -rf "$tree"
mkdir -p "$tree/crates"
for file in "$crates"/*.crate; do
  tar -xzf "$file" -C "$tree/crates"
  name="$(basename "$file" ".crate")"
  mv "$tree/crates/$name" "$tree/crates/${name%-*}"
done
# One workspace, in which a layer is the one that lies beside it.
{
  printf '[workspace]\nresolver = "2"\nmembers = ["crates/*"]\n\n[workspace.package]\nversion = "%s"\n\n[patch.crates-io]\n' "$version"
  for folder in "$tree"/crates/*; do
    name="$(basename "$folder")"
    printf '%s = { path = "crates/%s" }\n' "$name" "$name"
  done
} >"$tree/Cargo.toml"
mv "$tree/crates/libupt/Cargo.lock" "$tree/"
rm -f "$tree"/crates/*/Cargo.lock "$tree"/crates/*/.cargo_vcs_info.json "$tree"/crates/*/Cargo.toml.orig
for name in cmake include LICENSE-APACHE LICENSE-MIT NOTICE README.md; do cp -r "$root/$name" "$tree/"; done
time="$(git -C "$root" log -1 --format=%ct)"
tar --sort=name --mtime="@$time" --owner=0 --group=0 --numeric-owner -C "$out" -c "libupt-$version" | gzip -n9 >"$out/libupt_$version.orig.tar.gz"
cp -r "$root/packaging/debian" "$tree/debian"
cat >"$tree/debian/changelog" <<TEXT
libupt ($version-1) UNRELEASED; urgency=medium

  * New upstream release.

 -- The libupt developers <libupt@git.example.org>  $(LC_ALL=C date -u -d "@$time" '+%a, %d %b %Y %H:%M:%S +0000')
TEXT
cd "$out" && dpkg-source --build "libupt-$version"
