/* A process without a usable ONNX Runtime: a clear error, no crash, no hang, and the library stays
 * usable.
 *
 *   runtime_missing BUNDLE LIBRARY      LIBRARY: a path that is no ONNX Runtime (missing, or
 * another file)
 */
#include "expect.h"

/* The message names the file; its path may be written in the way of the system. */
static int names_file(const char *message, const char *path) {
  const char *name = strrchr(path, '/');
  return strstr(message, name == NULL ? path : name + 1) != NULL;
}

int main(int argc, char **argv) {
  upt_init_options options;
  upt_model *model = NULL;
  uint64_t needed = 0;
  if (argc != 3) {
    fprintf(stderr, "usage: %s BUNDLE LIBRARY\n", argv[0]);
    return 2;
  }
  memset(&options, 0, sizeof options);
  options.struct_size = sizeof options;
  options.onnxruntime_path = argv[2];
  EXPECT(upt_init(&options), UPT_OK);
  EXPECT(upt_providers(NULL, 0, &needed), UPT_ERR_RUNTIME);
  EXPECT(upt_model_create(argv[1], NULL, &model), UPT_ERR_RUNTIME);
  EXPECT_TRUE(names_file(upt_last_error(), argv[2]));
  EXPECT_TRUE(model == NULL);
  EXPECT(upt_model_create(argv[1], NULL, &model), UPT_ERR_RUNTIME);
  EXPECT(upt_shutdown(), UPT_OK);
  printf("message: %s\n", upt_last_error());
  return expect_result("runtime_missing");
}
