# Builds and runs a C program with the flags of pkg-config.   pkg_config.sh PREFIX CC
set -eu
here="$(cd "$(dirname "$0")" && pwd)"
folder="$(dirname "$(find "$1" -name upt.pc | head -n 1)")"
flags="$(PKG_CONFIG_PATH="$folder" pkg-config --cflags --libs upt)"
# The flags are words.
# shellcheck disable=SC2086
"$2" "$here/version.c" -o version_pkg_config $flags
LD_LIBRARY_PATH="$(dirname "$folder")" ./version_pkg_config
