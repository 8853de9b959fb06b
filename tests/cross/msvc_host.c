/* The least host, without a C runtime: its exit code says whether library and header speak the same
 * version. */
#include <upt.h>

int start(void) { return upt_abi_version() == UPT_ABI_VERSION ? 0 : 1; }
