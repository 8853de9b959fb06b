#!/usr/bin/env bash
# msvc.sh DLL: upt.dll as it was built for Microsoft's toolchain steps a liver under Wine, with Wine's own vcruntime140.dll and ucrtbase.dll, as
# this machine's libupt does, to the bit. Without Wine it says that it never ran.
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)"
cd "$root"
work="$root/target/cross/msvc/run"
wine="$(command -v wine64 || ls /usr/lib/wine/wine64 2>/dev/null || true)"
if [ -z "$wine" ]; then
  echo "linked by lld-link, $(stat -c %s "$1") bytes; it never ran: Wine is missing"
  exit 0
fi
mkdir -p "$work"
cp "$1" "$work/upt.dll"
bash xtask/cross/import_library.sh "$work" "$work"
x86_64-w64-mingw32-gcc -O2 -I include tests/c/rollout.c tests/c/expect.c "$work/upt.lib" -o "$work/rollout.exe"
here="${UPT_LIB_DIR:-$root/target/release}"
cc -O2 -I include tests/c/rollout.c tests/c/expect.c -L "$here" -lupt -lm "-Wl,-rpath,$work" -o "$work/rollout"
ln -sf "$here/libupt.so" "$work/libupt.so.0"
export WINEPREFIX="$work/wine" WINEDEBUG=-all WINEDLLOVERRIDES="mscoree,mshtml="
unset DISPLAY
system="$WINEPREFIX/drive_c/windows/system32"
[ -e "$system/kernel32.dll" ] || "$wine" wineboot -i >/dev/null 2>&1
# As tests/cross/windows.sh: Wine 8 lacks it.
[ -e "$system/bcryptprimitives.dll" ] || x86_64-w64-mingw32-gcc -O2 -shared -o "$system/bcryptprimitives.dll" tests/cross/process_prng.c -ladvapi32
rm -f "$work/there" "$work/here"
"$wine" "$work/rollout.exe" onnx/liver-coarse 12 "$work/there"
"$work/rollout" onnx/liver-coarse 12 "$work/here"
cmp "$work/here" "$work/there"
echo "linked by lld-link, and steps under Wine as this machine does, to the bit; on no Windows machine yet"
