# Exported symbols are upt_* only and are exactly the functions that the header declares; nothing of safer_ffi is linked; the
# soname is libupt.so.0.
#   symbols.sh PREFIX HEADER
set -eu
library="$(find "$1" -name 'libupt.so.0' | head -n 1)"
exported="$(nm -D --defined-only "$library" | awk '{print $3}' | sed 's/@.*//' | sort)"
declared="$(grep -oE '\bupt_[a-z_]+\(' "$2" | tr -d '(' | sort -u)"
if [ "$exported" != "$declared" ]; then
  echo "exported symbols and upt.h differ:"
  printf '%s\n' "$exported" >exported.txt
  printf '%s\n' "$declared" >declared.txt
  diff exported.txt declared.txt
  exit 1
fi
# safer_ffi checks structs at compile time only: nothing of it is in the library.
if nm "$library" | grep safer_ffi; then
  echo "the library holds code of safer_ffi"
  exit 1
fi
readelf -d "$library" | grep -q 'soname: \[libupt.so.0\]'
echo "$(printf '%s\n' "$exported" | wc -l) symbols"
