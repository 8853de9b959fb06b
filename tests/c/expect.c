#include "expect.h"

#include <stdio.h>

int expect_failures = 0;
int expect_seen[100];

static int expect_count = 0;

void expect_true_at(int holds, const char *what, const char *file, int line) {
  expect_count++;
  if (!holds) {
    expect_failures++;
    printf("%s:%d: does not hold: %s\n", file, line, what);
  }
}

void expect_status_at(upt_status found, upt_status wanted, const char *what, const char *file,
                      int line) {
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

int expect_result(const char *name) {
  printf("%s: %d expectations, %d failed\n", name, expect_count, expect_failures);
  return expect_failures == 0 ? 0 : 1;
}
