# Sourced by toolchain.sh (`triple`, `cross`, `root`): Windows with Microsoft's libraries (MSVC) from Linux.
#
# What links is LLVM's linker of Rust's own toolchain, as `lld-link`. An import library only says which DLL exports which name. Those of
# Windows itself are MinGW's; those of Microsoft's C runtime are made here of the names that Rust's code asks for, and what that runtime
# puts into each library besides is msvc_start.c. On Windows the library needs vcruntime140.dll, as all of that toolchain's do.
if ! has_own "$triple"; then
  echo "Rust's standard library for $triple is missing, and Debian has none: rustup target add $triple" >&2
  exit 1
fi
if ! command -v x86_64-w64-mingw32-gcc >/dev/null; then
  echo "MinGW is missing, whose import libraries name what Windows exports: apt-get install gcc-mingw-w64-x86-64-posix" >&2
  exit 1
fi
msvc="$cross/msvc"
mkdir -p "$msvc"
# import LIBRARY SYMBOL...
import() {
  local library="$1"
  shift
  printf '%s\n' "LIBRARY $library.dll" EXPORTS "$@" >"$msvc/$library.def"
  x86_64-w64-mingw32-dlltool --input-def "$msvc/$library.def" --output-lib "$msvc/$library.lib"
}
import vcruntime140 __CxxFrameHandler3 _CxxThrowException memcmp memcpy memmove memset
# Of C's mathematics whatever has an instruction of LLVM's, in both widths.
maths="acos asin atan atan2 cbrt ceil cos cosh exp exp2 expm1 floor fma fmod hypot log log10 log1p log2 pow rint round sin sinh tan tanh trunc"
# shellcheck disable=SC2046,SC2086 # names
import ucrtbase strlen $maths $(printf '%sf ' $maths)
# What a crate asks for by name, and takes nothing of.
printf '!<arch>\n' >"$msvc/legacy_stdio_definitions.lib"
for name in kernel32 ntdll userenv ws2_32 dbghelp; do
  cp "$(x86_64-w64-mingw32-gcc -print-file-name="lib$name.a")" "$msvc/$name.lib"
done
x86_64-w64-mingw32-gcc -O2 -c "$root/xtask/cross/msvc_start.c" -o "$msvc/start.obj"
export CARGO_TARGET_X86_64_PC_WINDOWS_MSVC_LINKER=rust-lld
export CARGO_TARGET_X86_64_PC_WINDOWS_MSVC_RUSTFLAGS="-Clinker-flavor=lld-link -Clink-arg=/LIBPATH:$msvc -Clink-arg=$msvc/start.obj \
-Clink-arg=/nodefaultlib:msvcrt -Clink-arg=vcruntime140.lib -Clink-arg=ucrtbase.lib"
