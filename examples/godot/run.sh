#!/usr/bin/env bash
# Makes the addon (addon.sh), installs it into an empty project as a user does, and runs the brain in Godot 4: headless with
# assertions, then in a window under Xvfb for a screenshot.
# Godot: GODOT in the environment, else fetched beside (fetch_godot.sh).
# Environment (cargo xtask test sets it): UPT_ROOT, UPT_LIB_DIR, UPT_INCLUDE_DIR, UPT_BUNDLES, UPT_BUILD_DIR, ORT_DYLIB_PATH.
# Last line: "N passed, N failed, N skipped".
set -euo pipefail

root=${UPT_ROOT:-$(cd "$(dirname "$0")/../.." && pwd)}
bundles=${UPT_BUNDLES:-$root/onnx}
build=${UPT_BUILD_DIR:-$root/target}/godot
export ORT_DYLIB_PATH=${ORT_DYLIB_PATH:-$root/target/ort/libonnxruntime.so}
here=$root/examples/godot

bundle=
for name in "${UPT_BUNDLE:-}" "$bundles/brain" "$bundles/brain-fast" "$bundles/brain-coarse"; do
  if [ -n "$name" ] && [ -f "$name/bundle.json" ]; then bundle=$name; break; fi
done
[ -n "$bundle" ] || { echo "no bundle in $bundles" >&2; exit 1; }

mkdir -p "$build"
if ! godot=$("$here/fetch_godot.sh" "$build/engine"); then
  if [ "${CI:-}" = true ]; then
    echo "Godot could not be fetched, and CI does not skip it"
    echo "0 passed, 1 failed, 0 skipped"
    exit 1
  fi
  echo "skipped: no Godot 4 (set GODOT to the path of 4.3 or newer)"
  echo "0 passed, 0 failed, 1 skipped"
  exit 0
fi
echo "Godot $("$godot" --version | tail -n 1), bundle $(basename "$bundle")"

export GODOT=$godot
"$here/addon.sh" "$build/addon"
project=$build/project
rm -rf "$project" "$build/supported"
mkdir -p "$project/.godot"
cp "$here"/project.godot "$here"/main.tscn "$here"/pushed_brain.gd "$project/"
cp -r "$build/addon/addons" "$project/"
# The editor's first scan writes the list of extensions.
echo "res://addons/libupt/libupt.gdextension" >"$project/.godot/extension_list.cfg"

passed=0
failed=0
check() { # name command...
  local name=$1
  shift
  if timeout 300 "$@" >"$build/$name.log" 2>&1 && grep -q '^OK ' "$build/$name.log"; then
    passed=$((passed + 1))
    echo "$name: $(grep '^OK ' "$build/$name.log")"
  else
    failed=$((failed + 1))
    echo "$name FAILED:"
    tail -n 30 "$build/$name.log"
  fi
}
# The archive in an empty project, with nothing else of ours: the editor's scan finds it, and the README's first program runs.
installed() {
  local empty=$build/empty
  rm -rf "$empty"
  mkdir -p "$empty"
  touch "$empty/project.godot"
  python3 -m zipfile -e "$build"/addon/libupt-godot-*.zip "$empty"
  # As the Asset Library takes it: one folder, with licence, README and icon, and beside it the icon as a PNG of 128 pixels or more.
  [ "$(cd "$empty" && ls -A && ls -A addons)" = $'addons\nproject.godot\nlibupt' ]
  (cd "$empty/addons/libupt" && ls libupt.gdextension README.md icon.svg LICENSE-MIT LICENSE-APACHE NOTICE THIRD-PARTY.txt bin/linux-x64/libupt{_godot.so,.so.0})
  python3 -c 'import struct, sys; print(*struct.unpack(">8x4x4sII", open(sys.argv[1], "rb").read(24)))' "$build/addon/libupt-godot-icon.png" | grep -qx "b'IHDR' 256 256"
  sed -n '/^```gdscript$/,/^```$/p' "$empty/addons/libupt/README.md" | sed '/^```/d' >"$empty/first.gd"
  (
    cd "$empty"
    unset ORT_DYLIB_PATH LD_LIBRARY_PATH
    # Without a window the engine crashes at the end of the scan that finds an extension (godotengine/godot issue 123511): what the scan
    # wrote counts.
    "$godot" --headless --import || true
    grep -qx 'res://addons/libupt/libupt.gdextension' .godot/extension_list.cfg
    "$godot" --headless --script first.gd | tee said
    [ "$(sed -n 's/^force on the ball: \([0-9]*\) mN upward$/\1/p' said)" -gt 100 ] && echo "OK the addon in an empty project: $(tail -n 1 said)"
  )
}
export -f installed
export build godot
check addon bash -ec installed
cp "$here/shapes.gd" "$project/"
check shapes "$godot" --headless --path "$project" --script shapes.gd -- "$bundles/liver-coarse"
# A frame waits for the step that runs beside it, so that every machine shows the same.
check headless "$godot" --headless --path "$project" --fixed-fps 60 -- --bundle="$bundle" --seconds=2.5 --wait --check

# The properties of the inspector reach the steps; what cannot be is a message.
if grep -q '"corrections"' "$bundle/bundle.json"; then
  check corrections "$godot" --headless --path "$project" --fixed-fps 60 -- --bundle="$bundle" --corrections=3 --seconds=1.1 --wait --check
  check target "$godot" --headless --path "$project" --fixed-fps 60 -- --bundle="$bundle" --corrections=20 --target=0.05 --substeps=1 --seconds=1.1 --wait --check
fi
check breathing "$godot" --headless --path "$project" --fixed-fps 60 -- --bundle="$bundle" --breathe=8 --seconds=2.5 --wait --check
check bed "$godot" --headless --path "$project" --fixed-fps 60 -- --bundle="$bundles/liver-coarse" --site=-18,130,17 --bed --breathe=8 --seconds=4 --wait --check
# A small body, its first held nodes a support group.
cp -r "$root/tests/fixtures/tiny-corrected" "$build/supported"
python3 - "$build/supported/bundle.json" <<'END'
import json
import sys

with open(sys.argv[1]) as file:
    manifest = json.load(file)
del manifest["manifest_sha256"]
manifest["supports"] = [{"name": "ligament", "nodes": list(range(0, 101, 5))}]
with open(sys.argv[1], "w") as file:
    json.dump(manifest, file)
END
check lead "$godot" --headless --path "$project" --fixed-fps 60 -- --bundle="$build/supported" --lead=4 --seconds=2.2 --wait --check
check cut "$godot" --headless --path "$project" --fixed-fps 60 -- --bundle="$bundle" --cut --seconds=1.3 --wait --check
check tear "$godot" --headless --path "$project" --fixed-fps 60 -- --bundle="$bundle" --tear=1.1 --seconds=1.3 --wait --check
refused() { # name message options...
  local name=$1 message=$2 status=0
  shift 2
  "$godot" --headless --path "$project" -- --seconds=1 "$@" >"$build/$name.log" 2>&1 || status=$?
  if [ "$status" -eq 1 ] && grep -q "FAILED could not open the bundle.*$message" "$build/$name.log"; then
    passed=$((passed + 1))
  else
    failed=$((failed + 1))
    echo "$name: exit code $status"
    tail -n 20 "$build/$name.log"
  fi
}
refused lone-target corrections.target_mm --bundle="$bundle" --target=0.1
refused substeps substeps --bundle="$bundle" --corrections=3 --target=0.1 --substeps=300
refused step step_s --bundle="$bundle" --step=0.5

# A bundle that is not there: a message, exit code 1, no crash.
refused missing "" --bundle="$build/no-such-bundle"

if command -v Xvfb >/dev/null; then
  rm -f "$build/brain.png"
  check window xvfb-run -a -s "-screen 0 1024x768x24" "$godot" --path "$project" --rendering-method gl_compatibility \
    --rendering-driver opengl3 --audio-driver Dummy --fixed-fps 60 -- --bundle="$bundle" --seconds=1.1 --wait --screenshot="$build/brain.png" --check
  if [ -s "$build/brain.png" ]; then
    passed=$((passed + 1))
    echo "screenshot: $build/brain.png"
  else
    failed=$((failed + 1))
    echo "no screenshot was written"
  fi
  echo "$passed passed, $failed failed, 0 skipped"
else
  echo "skipped: window test, Xvfb is missing (apt-get install xvfb)"
  echo "$passed passed, $failed failed, 1 skipped"
fi
[ "$failed" -eq 0 ]
