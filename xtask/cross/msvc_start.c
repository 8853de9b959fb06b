/* What Microsoft's C runtime puts into every library beside its DLLs, as far as Rust's code asks
 * for it: for xtask/cross/msvc.sh, which links without that runtime's own libraries. */
#include <stdint.h>

/* That the code has floating-point numbers. */
int _fltused = 0x9875;

/* Memory of each thread: where it begins and ends, and the functions that Windows calls when a
 * thread comes or goes. */
uint32_t _tls_index;
__attribute__((section(".tls"))) char tls_start = 0;
__attribute__((section(".tls$ZZZ"))) char tls_end = 0;
__attribute__((section(".CRT$XLA"))) void *const callbacks_start = 0;
__attribute__((section(".CRT$XLZ"))) void *const callbacks_end = 0;
const struct {
  void *start, *end;
  uint32_t *index;
  void *const *callbacks;
  uint32_t zeros, flags;
} _tls_used = {&tls_start, &tls_end, &_tls_index, &callbacks_start + 1, 0, 0};

int _DllMainCRTStartup(void *module, uint32_t reason, void *reserved) {
  (void)module, (void)reason, (void)reserved;
  return 1;
}

/* Touches each page of a large frame, so that the stack grows: rax holds its size, and all
 * registers stay. */
__asm__(".text\n.globl __chkstk\n__chkstk:\n"
        "  push %rcx\n  push %rax\n  lea 24(%rsp), %rcx\n"
        "1: cmp $0x1000, %rax\n  jb 2f\n  sub $0x1000, %rcx\n  orb $0, (%rcx)\n  sub $0x1000, "
        "%rax\n  jmp 1b\n"
        "2: sub %rax, %rcx\n  orb $0, (%rcx)\n  pop %rax\n  pop %rcx\n  ret\n");

/* The table of the class to which the types of what is thrown belong; nothing calls through it. */
__asm__(".section .rdata,\"dr\"\n.globl \"??_7type_info@@6B@\"\n\"??_7type_info@@6B@\":\n  .quad "
        "0\n.text\n");
