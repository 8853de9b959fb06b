/* Steps a bundle through one push and its release, and writes each state: the same bytes wherever
 * it runs, or not.
 *
 *   rollout BUNDLE STEPS FILE [CORRECTIONS]        FILE: [STEPS,K,3] floats, mm
 *
 * With CORRECTIONS each step makes so many of them, whatever their error; 0: none.
 */
#include "expect.h"

#include <stdlib.h>

#define PUSHED 6

int main(int argc, char **argv) {
  upt_scene_options options;
  upt_model_info info;
  upt_input input;
  upt_model *model = NULL;
  upt_scene *scene = NULL;
  uint32_t nodes[PUSHED], *domain;
  float vectors[3 * PUSHED], *out;
  long step, steps;
  int i;
  FILE *file;
  if (argc < 4 || argc > 5) {
    fprintf(stderr, "usage: %s BUNDLE STEPS FILE [CORRECTIONS]\n", argv[0]);
    return 2;
  }
  steps = atol(argv[2]);
  memset(&options, 0, sizeof options);
  options.struct_size = sizeof options;
  options.sleep = UPT_SWITCH_OFF;
  options.guard_policy = UPT_GUARD_REPORT;
  if (argc > 4) {
    options.corrections.count = (uint32_t)atoi(argv[4]);
    options.corrections.mode =
        options.corrections.count == 0 ? UPT_CORRECTIONS_NONE : UPT_CORRECTIONS_COUNT;
  }
  memset(&info, 0, sizeof info);
  info.struct_size = sizeof info;
  EXPECT(upt_model_create(argv[1], NULL, &model), UPT_OK);
  EXPECT(upt_model_read_info(model, &info), UPT_OK);
  EXPECT(upt_scene_create(model, &options, &scene), UPT_OK);
  if (expect_failures > 0) {
    return expect_result("rollout");
  }
  domain = malloc(info.domain_node_count * sizeof *domain);
  out = malloc(3 * info.node_count * sizeof *out);
  EXPECT(upt_model_read_indices(model, UPT_SET_DOMAIN_NODES, domain, info.domain_node_count, NULL),
         UPT_OK);
  for (i = 0; i < PUSHED; i++) {
    nodes[i] = domain[i];
  }
  memset(&input, 0, sizeof input);
  input.struct_size = sizeof input;
  input.contact_nodes = nodes;
  input.contact_vectors = vectors;
  file = fopen(argv[3], "wb");
  EXPECT_TRUE(file != NULL);
  for (step = 0; file != NULL && step < steps; step++) {
    const int held = step < steps * 2 / 3;
    for (i = 0; i < PUSHED; i++) {
      vectors[3 * i] = 0.125f * (float)(step + 1);
      vectors[3 * i + 1] = 0.0f;
      vectors[3 * i + 2] = -0.25f * (float)(step + 1);
    }
    input.contact_count = held ? PUSHED : 0;
    EXPECT(upt_scene_step(scene, &input, out, 3 * info.node_count), UPT_OK);
    EXPECT_TRUE(fwrite(out, 3 * sizeof *out, info.node_count, file) == info.node_count);
  }
  if (file != NULL) {
    EXPECT_TRUE(fclose(file) == 0);
  }
  upt_scene_destroy(scene);
  upt_model_destroy(model);
  EXPECT(upt_shutdown(), UPT_OK);
  return expect_result("rollout");
}
