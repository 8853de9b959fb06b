/* What the C and C++ tests share: each expectation prints where it failed; main returns
 * expect_result(). */
#ifndef UPT_TEST_EXPECT_H
#define UPT_TEST_EXPECT_H

#include <stdio.h>
#include <string.h>

#include "upt.h"

static int expect_failures = 0;
static int expect_count = 0;
/* Statuses that any expectation saw, by -status (0 to 99); [99] is UPT_PENDING. */
static int expect_seen[100];

static inline void expect_true_at(int holds, const char *what, const char *file, int line) {
  expect_count++;
  if (!holds) {
    expect_failures++;
    printf("%s:%d: does not hold: %s\n", file, line, what);
  }
}

static inline void expect_status_at(upt_status found, upt_status wanted, const char *what,
                                    const char *file, int line) {
  expect_count++;
  if (found > 0) {
    expect_seen[99] = 1;
  } else if (found > -99) {
    expect_seen[-found] = 1;
  }
  if (found != wanted) {
    expect_failures++;
    printf("%s:%d: %s\n  gave %s, expected %s; last error: %s\n", file, line, what,
           upt_status_name(found), upt_status_name(wanted), upt_last_error());
  } else if (found < 0 && upt_last_error()[0] == '\0') {
    expect_failures++;
    printf("%s:%d: %s failed without a message\n", file, line, what);
  }
}

static inline int expect_result(const char *name) {
  printf("%s: %d expectations, %d failed\n", name, expect_count, expect_failures);
  return expect_failures == 0 ? 0 : 1;
}

#define EXPECT_TRUE(holds) expect_true_at((holds) ? 1 : 0, #holds, __FILE__, __LINE__)
#define EXPECT(call, wanted) expect_status_at((call), (wanted), #call, __FILE__, __LINE__)

#endif
