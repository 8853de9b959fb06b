#!/usr/bin/env bash
# lld_link.sh FOLDER: links FOLDER/msvc.obj against FOLDER/upt.lib as Microsoft's linker would.
set -euo pipefail
linker="$(command -v lld-link || command -v lld-link-14 || command -v lld-link-19)"
"$linker" /entry:start /subsystem:console /nodefaultlib "/out:$1/msvc.exe" "$1/msvc.obj" "$1/upt.lib"
x86_64-w64-mingw32-objdump -p "$1/msvc.exe" | grep -q 'DLL Name: upt.dll'
