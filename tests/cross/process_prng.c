/* Wine 8 has no bcryptprimitives.dll, which Rust's std takes its random numbers from: this one is
 * for the tests' Wine prefix and never shipped. */
#include <windows.h>

BOOLEAN WINAPI SystemFunction036(PVOID buffer, ULONG length);

__declspec(dllexport) BOOL WINAPI ProcessPrng(PBYTE buffer, SIZE_T length) {
  return SystemFunction036(buffer, (ULONG)length);
}
