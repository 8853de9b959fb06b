#!/usr/bin/env bash
# What the C# side of the Unity package adds to the library, measured with Mono on the stub of UnityEngine: `ROW {json}`
# lines for `cargo xtask bench`. Environment as run.sh.
set -euo pipefail

root=${UPT_ROOT:-$(cd "$(dirname "$0")/../.." && pwd)}
libraries=${UPT_LIB_DIR:-$root/target/release}
bundle=${UPT_BUNDLES:-$root/onnx}/brain-reduced
build=${UPT_BUILD_DIR:-$root/target}/csharp-overhead
export ORT_DYLIB_PATH=${ORT_DYLIB_PATH:-$root/target/ort/libonnxruntime.so}

for tool in mcs mono; do
  if ! command -v "$tool" >/dev/null; then
    echo "left out: $tool is missing (Debian: apt-get install mono-mcs mono-runtime)"
    exit 0
  fi
done
rm -rf "$build"
mkdir -p "$build/lib"
ln -sf "$libraries/libupt.so" "$build/lib/libupt.so"
flags=(-langversion:7.2 -unsafe -nologo -debug- -optimize+ -nowarn:0649,0067,0169)
mcs "${flags[@]}" -target:library -out:"$build/Upt.Interop.dll" "$root"/unity-plugin/Runtime/Interop/*.cs
mcs "${flags[@]}" -target:library -out:"$build/UnityEngine.Stub.dll" "$root"/tests/csharp/stub/*.cs
# With the components' sources: their upload is internal.
mcs "${flags[@]}" -target:exe -out:"$build/Overhead.exe" -r:"$build/Upt.Interop.dll" -r:"$build/UnityEngine.Stub.dll" \
  "$root"/unity-plugin/Runtime/Components/*.cs "$root/tests/csharp/Overhead.cs"
LD_LIBRARY_PATH=$build/lib${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH} mono "$build/Overhead.exe" "$bundle"
