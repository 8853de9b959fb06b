#!/usr/bin/env bash
# Puts a Godot 4 beside the project without installing it: Debian sid's packages and all that they depend on, down to libc,
# extracted into a folder. Prints the path of a `godot` command.
#   fetch_godot.sh FOLDER        GODOT=/path/to/godot in the environment is taken instead, when set
set -euo pipefail

folder=${1:?usage: fetch_godot.sh FOLDER}
if [ -n "${GODOT:-}" ]; then
  echo "$GODOT"
  exit 0
fi
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)
if [ -x "$folder/godot" ]; then
  echo "$folder/godot"
  exit 0
fi
command -v apt-get >/dev/null || { echo "no apt-get here: install Godot 4.3 or newer and set GODOT to its path" >&2; exit 3; }

# The mirror and its key are the ones that this system's own sources name.
mirror=$(grep -rhoE 'https?://[^ ]+/debian/?( |$)' /etc/apt/sources.list /etc/apt/sources.list.d 2>/dev/null | head -n 1 | tr -d " " || true)
mirror=${mirror:-http://deb.debian.org/debian}
keyring=/usr/share/keyrings/debian-archive-keyring.gpg
[ -f "$keyring" ] || { echo "no $keyring: install debian-archive-keyring, or set GODOT" >&2; exit 3; }
apt=$folder/apt
mkdir -p "$apt/lists/partial" "$apt/cache/archives/partial"
: >"$apt/status"
echo "deb [signed-by=$keyring] $mirror sid main" >"$apt/sources.list"
cat >"$apt/apt.conf" <<CONF
Dir::Etc::sourcelist "$apt/sources.list";
Dir::Etc::sourceparts "-";
Dir::State::Lists "$apt/lists";
Dir::State::status "$apt/status";
Dir::Cache "$apt/cache";
APT::Architecture "amd64";
APT::Architectures { "amd64"; };
APT::Install-Recommends "false";
APT::Sandbox::User "root";
CONF
export APT_CONFIG=$apt/apt.conf
apt-get -qq update >&2
apt-get -qq install --yes --download-only godot xvfb mesa-vulkan-drivers libgl1-mesa-dri libegl1 libgl1 >&2
root=$folder/root
rm -rf "$root"
mkdir -p "$root"
# Debian's merged /usr: packages may still ship /lib and /bin.
mkdir -p "$root/usr/lib" "$root/usr/bin" "$root/usr/lib64" "$root/usr/sbin"
ln -s usr/lib "$root/lib"
ln -s usr/lib64 "$root/lib64"
ln -s usr/bin "$root/bin"
ln -s usr/sbin "$root/sbin"
for package in "$apt"/cache/archives/*.deb; do
  dpkg-deb --fsys-tarfile "$package" | tar -x -C "$root" --keep-directory-symlink --no-same-owner
done
loader=$(find "$root/usr/lib" "$root/usr/lib64" -name 'ld-linux-x86-64.so.2' | head -n 1)
binary=$(find "$root/usr/bin" -name 'godot*' -type f | sort | head -n 1)
[ -n "$loader" ] && [ -n "$binary" ] || { echo "the packages hold no godot or no loader" >&2; exit 1; }
libraries=$root/usr/lib/x86_64-linux-gnu
cat >"$folder/godot" <<RUN
#!/bin/sh
export LIBGL_DRIVERS_PATH="$libraries/dri"
export __EGL_VENDOR_LIBRARY_DIRS="$root/usr/share/glvnd/egl_vendor.d"
export GBM_BACKENDS_PATH="$libraries/gbm"
exec "$loader" --library-path "$libraries:$libraries/pulseaudio" "$binary" "\$@"
RUN
chmod +x "$folder/godot"
rm -rf "$apt/cache/archives" "$apt/lists"
echo "$folder/godot"
