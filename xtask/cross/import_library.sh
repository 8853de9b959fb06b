#!/usr/bin/env bash
# import_library.sh FOLDER OUT: OUT/upt.lib, which hosts of Microsoft's toolchain link against, for FOLDER/upt.dll.
set -euo pipefail
{
  echo "LIBRARY upt.dll"
  echo "EXPORTS"
  x86_64-w64-mingw32-objdump -p "$1/upt.dll" | sed -n 's/^.*\[ *[0-9]*\].* \(upt_[a-z_]*\)$/\1/p' | sort -u
} >"$2/upt.def"
x86_64-w64-mingw32-dlltool --input-def "$2/upt.def" --dllname upt.dll --output-lib "$2/upt.lib"
