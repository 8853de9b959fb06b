#!/usr/bin/env bash
# The extension as Godot's Asset Library takes it, made from a built libupt:
#   addon.sh OUT        OUT/addons/libupt, OUT/libupt-godot-VERSION-linux-x64.zip, and the icon for the Library's page, OUT/libupt-godot-icon.png
# The engine writes out the interface that the extension is compiled with: GODOT in the environment, else it is fetched beside.
# Environment: UPT_ROOT, UPT_LIB_DIR, UPT_INCLUDE_DIR, UPT_BUNDLES, UPT_BUILD_DIR, UPT_PYTHON as for run.sh.
set -euo pipefail
root=${UPT_ROOT:-$(cd "$(dirname "$0")/../.." && pwd)}
libraries=${UPT_LIB_DIR:-$root/target/release}
include=${UPT_INCLUDE_DIR:-$root/include}
bundles=${UPT_BUNDLES:-$root/onnx}
build=${UPT_BUILD_DIR:-$root/target}/godot
python=${UPT_PYTHON:-python3}
here=$root/examples/godot
out=${1:?usage: addon.sh OUT}
mkdir -p "$build/lib"
godot=$("$here/fetch_godot.sh" "$build/engine")

addon=$out/addons/libupt
rm -rf "$out/addons"
mkdir -p "$addon/bin/linux-x64" "$addon/bundles"
# The library under its soname, as an installed prefix has it.
cp "$libraries/libupt.so" "$addon/bin/linux-x64/libupt.so.0"
strip "$addon/bin/linux-x64/libupt.so.0"
ln -sf "$addon/bin/linux-x64/libupt.so.0" "$build/lib/libupt.so"

(cd "$build" && "$godot" --headless --dump-gdextension-interface >/dev/null 2>&1)
flags=(-O2 -Wall -Wextra -Werror -fPIC -fvisibility=hidden -I"$build" -I"$include")
cc -std=c11 "${flags[@]}" -c "$here/godot_api.c" -o "$build/godot_api.o"
c++ -std=c++17 "${flags[@]}" -I"$root/examples/cpp" -shared "$here"/*.cpp \
  "$root/examples/cpp/surgery.cpp" "$build/godot_api.o" \
  -o "$addon/bin/linux-x64/libupt_godot.so" -L"$build/lib" -lupt -Wl,-rpath,'$ORIGIN' -s

cp "$here"/addon/* "$root"/LICENSE-APACHE "$root"/LICENSE-MIT "$root"/NOTICE "$addon/"
cp -r "$bundles/liver-coarse" "$addon/bundles/"
(cd "$root" && "$python" tests/style/licences.py --write "$addon/THIRD-PARTY.txt" >/dev/null)
# Godot imports nothing of the organ.
touch "$addon/bundles/.gdignore"
(cd "$build" && "$godot" --headless --script "$here/icon.gd" -- "$here/addon/icon.svg" "$out/libupt-godot-icon.png") >/dev/null

version=$(sed -n 's/^version = "\(.*\)"/\1/p' "$root/Cargo.toml" | head -n 1)
"$python" - "$out" "$out/libupt-godot-$version-linux-x64.zip" <<'END'
import os
import sys
import time
import zipfile
from pathlib import Path

out, file = Path(sys.argv[1]), Path(sys.argv[2])
when = time.gmtime(max(int(os.environ.get("SOURCE_DATE_EPOCH", "0")), 315532800))[:6]
with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
    for path in sorted(one for one in (out / "addons").rglob("*") if one.is_file()):
        entry = zipfile.ZipInfo(path.relative_to(out).as_posix(), when)
        entry.external_attr = 0o644 << 16
        archive.writestr(entry, path.read_bytes(), zipfile.ZIP_DEFLATED)
print(file)
END
