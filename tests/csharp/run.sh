#!/usr/bin/env bash
# Compiles the Unity package's C# with Mono (the interop layer alone, the components and the sample against a stub of
# UnityEngine) and runs the NUnit tests against the real libupt and a real bundle.
# Environment (cargo xtask test sets it): UPT_ROOT, UPT_LIB_DIR, UPT_INCLUDE_DIR, UPT_BUNDLES, UPT_BUILD_DIR, ORT_DYLIB_PATH.
# Last line: "N passed, N failed, N skipped".
set -euo pipefail

root=${UPT_ROOT:-$(cd "$(dirname "$0")/../.." && pwd)}
libraries=${UPT_LIB_DIR:-$root/target/release}
include=${UPT_INCLUDE_DIR:-$root/include}
bundles=${UPT_BUNDLES:-$root/onnx}
build=${UPT_BUILD_DIR:-$root/target}/csharp
export ORT_DYLIB_PATH=${ORT_DYLIB_PATH:-$root/target/ort/libonnxruntime.so}

for tool in mcs mono nunit-console cc; do
  if ! command -v "$tool" >/dev/null; then
    echo "skipped: $tool is missing (Debian: apt-get install mono-mcs mono-runtime nunit-console libnunit-framework2.6.3-cil gcc)"
    echo "0 passed, 0 failed, 1 skipped"
    exit 0
  fi
done
nunit=$(find /usr/lib/cli /usr/lib/mono -name nunit.framework.dll 2>/dev/null | sort | head -n 1)
[ -n "$nunit" ] || { echo "nunit.framework.dll is missing: apt-get install libnunit-framework2.6.3-cil" >&2; exit 1; }

bundle=
for name in "${UPT_TEST_BUNDLE:-}" "$bundles/brain-reduced" "$bundles/brain-coarse" "$bundles/brain-fast"; do
  if [ -n "$name" ] && [ -f "$name/bundle.json" ]; then bundle=$name; break; fi
done
[ -n "$bundle" ] || { echo "no bundle in $bundles: expected brain-reduced, brain-coarse or brain-fast" >&2; exit 1; }
export UPT_TEST_BUNDLE=$bundle
export UPT_TEST_CORRECTED=$root/tests/fixtures/tiny-corrected

rm -rf "$build"
mkdir -p "$build"
# The library under its soname, as an installed prefix has it.
mkdir -p "$build/lib"
ln -sf "$libraries/libupt.so" "$build/lib/libupt.so"
ln -sf "$libraries/libupt.so" "$build/lib/libupt.so.0"
libraries=$build/lib
plugin=$root/unity-plugin
mcs_flags=(-langversion:7.2 -unsafe -warnaserror -warn:4 -nologo -debug- -optimize+)
# 0649: fields that Unity's inspector sets.
mcs "${mcs_flags[@]}" -target:library -out:"$build/Upt.Interop.dll" "$plugin"/Runtime/Interop/*.cs
mcs "${mcs_flags[@]}" -nowarn:0649,0067,0169 -target:library -out:"$build/UnityEngine.Stub.dll" "$root"/tests/csharp/stub/*.cs
mcs "${mcs_flags[@]}" -nowarn:0649 -target:library -out:"$build/Upt.dll" -r:"$build/Upt.Interop.dll" \
  -r:"$build/UnityEngine.Stub.dll" "$plugin"/Runtime/Components/*.cs
mcs "${mcs_flags[@]}" -nowarn:0649 -target:library -out:"$build/Upt.Editor.dll" -r:"$build/Upt.Interop.dll" \
  -r:"$build/UnityEngine.Stub.dll" -r:"$build/Upt.dll" "$plugin"/Editor/*.cs
mcs "${mcs_flags[@]}" -define:ENABLE_LEGACY_INPUT_MANAGER -nowarn:0649 -target:library -out:"$build/Upt.Samples.dll" -r:"$build/Upt.Interop.dll" \
  -r:"$build/UnityEngine.Stub.dll" -r:"$build/Upt.dll" "$plugin"/Samples~/*/*.cs
# As Unity compiles them for a WebGL player, whose calls tests/web/unity.mjs runs.
mcs "${mcs_flags[@]}" -define:UNITY_WEBGL -target:library -out:"$build/Web.Interop.dll" "$plugin"/Runtime/Interop/*.cs
mcs "${mcs_flags[@]}" -define:UNITY_WEBGL -nowarn:0649 -target:library -out:"$build/Web.dll" -r:"$build/Web.Interop.dll" \
  -r:"$build/UnityEngine.Stub.dll" "$plugin"/Runtime/Components/*.cs
mcs "${mcs_flags[@]}" -target:library -out:"$build/Upt.Tests.dll" -r:"$nunit" -r:"$build/Upt.Interop.dll" \
  -r:"$build/UnityEngine.Stub.dll" -r:"$build/Upt.dll" -r:"$build/Upt.Samples.dll" "$root"/tests/csharp/tests/*.cs "$plugin"/Tests/Runtime/*.cs
mcs "${mcs_flags[@]}" -target:exe -out:"$build/MissingLibrary.exe" -r:"$build/Upt.Interop.dll" \
  "$root"/tests/csharp/MissingLibrary.cs
cp "$nunit" "$build/"

cc -std=c99 -O2 -Wall -Wextra -Werror -I"$include" -o "$build/host" "$root/tests/csharp/host.c" \
  -L"$libraries" -lupt -lm -Wl,-rpath,"$libraries"
"$build/host" "$bundle" "$build/c-rollout.bin"
export UPT_TEST_C_ROLLOUT=$build/c-rollout.bin

cd "$build"
passed=0
failed=0
# Without the library: a message that says what to do, from a process of its own.
if message=$(env -u LD_LIBRARY_PATH mono MissingLibrary.exe 2>&1) && grep -q "cargo xtask package --unity" <<<"$message"; then
  passed=$((passed + 1))
else
  echo "a missing library gave no useful message: $message"
  failed=$((failed + 1))
fi

# A library of another architecture: the same, since the loader refuses it. The copy's ELF header names another machine.
mkdir -p "$build/foreign"
cp -L "$libraries/libupt.so" "$build/foreign/libupt.so"
machine='\xb7'
[ "$(uname -m)" = x86_64 ] || machine='\x3e'
printf "$machine" | dd of="$build/foreign/libupt.so" bs=1 seek=18 conv=notrunc status=none
if message=$(LD_LIBRARY_PATH="$build/foreign" mono MissingLibrary.exe 2>&1) && grep -q "cargo xtask package --unity" <<<"$message"; then
  passed=$((passed + 1))
else
  echo "a library of another architecture gave no useful message: $message"
  failed=$((failed + 1))
fi

if python3 "$root/tests/csharp/meta.py" --check; then passed=$((passed + 1)); else failed=$((failed + 1)); fi

export LD_LIBRARY_PATH=$libraries${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
tests() { # name options...
  local name=$1 summary run errors failures
  shift
  nunit-console Upt.Tests.dll -nologo -noshadow -nodots -domain=None -process=Single -xml="$build/$name.xml" "$@" 2>&1 | tee "$build/$name.log" || true
  summary=$(grep -E '^Tests run: ' "$build/$name.log" | tail -n 1 || true)
  if [ -z "$summary" ]; then
    echo "nunit-console ended without a summary"
    failed=$((failed + 1))
    return
  fi
  run=$(sed -E 's/^Tests run: ([0-9]+).*/\1/' <<<"$summary")
  errors=$(sed -E 's/.*Errors: ([0-9]+).*/\1/' <<<"$summary")
  failures=$(sed -E 's/.*Failures: ([0-9]+).*/\1/' <<<"$summary")
  passed=$((passed + run - errors - failures))
  failed=$((failed + errors + failures))
}
tests results
# On a coarse mesh a tool that is put into the tissue errs most.
coarse=$bundles/brain-coarse-reduced
if [ -f "$coarse/bundle.json" ] && [ "$coarse" != "$bundle" ]; then
  UPT_TEST_BUNDLE=$coarse tests coarse -run:Upt.Tests.ComponentTests.FramesShowTheSpatulaOutsideOfTheTissue
fi
# The interop layer under Roslyn for netstandard2.1, where a .NET SDK is at hand.
if command -v dotnet >/dev/null; then
  mkdir -p "$build/roslyn"
  cat >"$build/roslyn/Upt.Interop.csproj" <<PROJECT
<Project Sdk="Microsoft.NET.Sdk">
  <PropertyGroup>
    <TargetFramework>netstandard2.1</TargetFramework>
    <LangVersion>7.2</LangVersion>
    <AllowUnsafeBlocks>true</AllowUnsafeBlocks>
    <TreatWarningsAsErrors>true</TreatWarningsAsErrors>
    <EnableDefaultCompileItems>false</EnableDefaultCompileItems>
  </PropertyGroup>
  <ItemGroup><Compile Include="$plugin/Runtime/Interop/*.cs" /></ItemGroup>
</Project>
PROJECT
  if dotnet build --nologo -v quiet "$build/roslyn/Upt.Interop.csproj"; then passed=$((passed + 1)); else failed=$((failed + 1)); fi
else
  echo "left out: the netstandard2.1 build by Roslyn; no dotnet SDK is installed"
fi
echo "$passed passed, $failed failed, 0 skipped"
[ "$failed" -eq 0 ]
