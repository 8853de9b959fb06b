/* What the C and C++ tests share: each expectation prints where it failed; main returns
 * expect_result(). */
#ifndef UPT_TEST_EXPECT_H
#define UPT_TEST_EXPECT_H

#include <stdio.h>
#include <string.h>

#include "upt.h"

#ifdef __cplusplus
extern "C" {
#endif

extern int expect_failures;
/* Statuses that any expectation saw, by -status (0 to 99); [99] is UPT_PENDING. */
extern int expect_seen[100];

void expect_true_at(int holds, const char *what, const char *file, int line);
void expect_status_at(upt_status found, upt_status wanted, const char *what, const char *file,
                      int line);
int expect_result(const char *name);

#ifdef __cplusplus
}
#endif

#define EXPECT_TRUE(holds) expect_true_at((holds) ? 1 : 0, #holds, __FILE__, __LINE__)
#define EXPECT(call, wanted) expect_status_at((call), (wanted), #call, __FILE__, __LINE__)

#endif
