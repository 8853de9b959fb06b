#include <stdio.h>
#include <upt.h>

int main(void) {
  printf("libupt %s\n", upt_version());
  return upt_abi_version() == UPT_ABI_VERSION ? 0 : 1;
}
