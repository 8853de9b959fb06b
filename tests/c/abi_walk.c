/* Walks every function of upt.h and every status code.
 *
 *   abi_walk BUNDLE DAMAGED REDUCED whole|bare
 *
 * DAMAGED: folder with version/, hash/, json/: copies of BUNDLE made wrong. REDUCED: a bundle whose
 * tables belong to its mesh. bare: the library has no instruments. The parts are walk_*.c.
 *
 * UPT_ERR_RUNTIME needs a process without ONNX Runtime: runtime_missing.c. UPT_ERR_PANIC needs a
 * library built with feature "fault"; without it that part is left out and said.
 */
#include <stdlib.h>

#include "walk.h"

upt_model *model;
upt_model_info info;
uint64_t floats;
float *before, *after;
uint32_t contact_nodes[4];
float contact_vectors[12];
int log_count;
int bare;

upt_scene *make_scene_with(int32_t guard_policy) {
  upt_scene *scene = NULL;
  upt_scene_options options;
  memset(&options, 0, sizeof options);
  options.struct_size = sizeof options;
  options.guard_policy = guard_policy;
  EXPECT(upt_scene_create(model, &options, &scene), UPT_OK);
  return scene;
}

upt_scene *make_scene(void) { return make_scene_with(UPT_GUARD_REPORT); }

void expect_unchanged(upt_scene *scene) {
  EXPECT(upt_scene_read(scene, NULL, after, floats), UPT_OK);
  EXPECT_TRUE(memcmp(before, after, (size_t)floats * sizeof *before) == 0);
}

static upt_input input_of_nodes(const uint32_t *nodes, const float *vectors, uint64_t count) {
  upt_input input;
  memset(&input, 0, sizeof input);
  input.struct_size = sizeof input;
  input.contact_nodes = nodes;
  input.contact_vectors = vectors;
  input.contact_count = count;
  return input;
}

static upt_input input_of_tools(const upt_instrument *tools, uint64_t count) {
  upt_input input;
  memset(&input, 0, sizeof input);
  input.struct_size = sizeof input;
  input.instruments = tools;
  input.instrument_count = count;
  return input;
}

upt_status step_nodes(upt_scene *scene, const uint32_t *nodes, const float *vectors, uint64_t count,
                      float *out, uint64_t out_count) {
  const upt_input input = input_of_nodes(nodes, vectors, count);
  return upt_scene_step(scene, &input, out, out_count);
}

upt_status submit_nodes(upt_scene *scene, const uint32_t *nodes, const float *vectors,
                        uint64_t count) {
  const upt_input input = input_of_nodes(nodes, vectors, count);
  return upt_scene_submit(scene, &input);
}

upt_status step_tools(upt_scene *scene, const upt_instrument *tools, uint64_t count, float *out,
                      uint64_t out_count) {
  const upt_input input = input_of_tools(tools, count);
  return upt_scene_step(scene, &input, out, out_count);
}

upt_status submit_tools(upt_scene *scene, const upt_instrument *tools, uint64_t count) {
  const upt_input input = input_of_tools(tools, count);
  return upt_scene_submit(scene, &input);
}

int main(int argc, char **argv) {
  static const int32_t codes[] = {
      UPT_OK,       UPT_ERR_NULL,   UPT_ERR_ARGUMENT, UPT_ERR_STRUCT_SIZE, UPT_ERR_HANDLE,
      UPT_ERR_BUSY, UPT_ERR_STATE,  UPT_ERR_PROVIDER, UPT_ERR_UNSUPPORTED, UPT_ERR_NON_FINITE,
      UPT_ERR_IO,   UPT_ERR_BUNDLE, UPT_ERR_VERSION,  UPT_ERR_SNAPSHOT,    UPT_ERR_GUARD,
  };
  upt_scene *orphan;
  upt_model *closed;
  size_t i;
  int panics;
  if (argc != 5) {
    fprintf(stderr, "usage: %s BUNDLE DAMAGED REDUCED whole|bare\n", argv[0]);
    return 2;
  }
  bare = strcmp(argv[4], "bare") == 0;
  walk_library();
  walk_model_open(argv[1], argv[2]);
  if (model == NULL) {
    return expect_result("abi_walk");
  }
  walk_model();
  walk_scene_create(argv[3]);
  walk_step();
  walk_worker();
  walk_region_and_points();
  walk_instrument();
  walk_instruments(argv[3]);
  walk_state();
  walk_handles();
  walk_threads();
  panics = walk_panic();

  /* A scene outlives its model's handle; the library ends only after both. */
  orphan = make_scene();
  closed = model;
  EXPECT(upt_shutdown(), UPT_ERR_STATE);
  EXPECT(upt_model_destroy(NULL), UPT_ERR_NULL);
  EXPECT(upt_model_destroy(model), UPT_OK);
  EXPECT(upt_model_destroy(closed), UPT_ERR_HANDLE);
  EXPECT(upt_model_describe(closed, NULL, 0, NULL), UPT_ERR_HANDLE);
  EXPECT(upt_scene_step(orphan, NULL, NULL, 0), UPT_OK);
  EXPECT(upt_shutdown(), UPT_ERR_STATE);
  EXPECT(upt_scene_destroy(orphan), UPT_OK);
  EXPECT_TRUE(log_count > 0);
  EXPECT(upt_set_log(NULL, NULL, UPT_LOG_OFF), UPT_OK);
  EXPECT(upt_shutdown(), UPT_OK);

  for (i = 0; i < sizeof codes / sizeof *codes; i++) {
    if (!expect_seen[-codes[i]]) {
      printf("no call gave %s\n", upt_status_name(codes[i]));
      expect_failures++;
    }
  }
  EXPECT_TRUE(expect_seen[99]);
  EXPECT_TRUE(!panics || expect_seen[-UPT_ERR_PANIC]);
  free(before);
  free(after);
  return expect_result("abi_walk");
}
