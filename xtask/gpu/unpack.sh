#!/usr/bin/env bash
# Joins the pieces of pack.sh that lie beside this script, checks their sums, and unpacks them:  unpack.sh FOLDER
set -euo pipefail

folder=${1:?usage: unpack.sh FOLDER}
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)
cd "$(dirname "$0")"
sha256sum --quiet --check upt-gpu.sums || {
  echo "a piece is missing or altered: carry it again" >&2
  exit 1
}
awk '{ print $2 }' upt-gpu.sums | xargs cat | xz -d | tar -C "$folder" -x
echo "unpacked in $folder/upt"
