/* The same loop as overhead.py, without Python: prints the seconds of each call. */
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include <upt.h>

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

int main(int argc, char **argv) {
  upt_init_options start = {sizeof start, 0, argc > 3 ? argv[3] : NULL};
  upt_scene_options options = {.struct_size = sizeof options, .no_sleep = 1};
  upt_model_info info = {.struct_size = sizeof info};
  upt_model *model;
  upt_scene *scene;
  long calls = argc > 2 ? atol(argv[2]) : 0;
  if (calls < 1 || upt_init(&start) < 0 || upt_model_open(argv[1], NULL, &model) < 0 ||
      upt_scene_create(model, &options, &scene) < 0 || upt_model_get_info(model, &info) < 0) {
    fprintf(stderr, "usage: overhead BUNDLE CALLS ONNXRUNTIME [tool]; %s\n", upt_last_error());
    return 1;
  }
  float *out = malloc(3 * info.node_count * sizeof *out);
  double *seconds = malloc((size_t)calls * sizeof *seconds);
  uint32_t nodes[4];
  float vectors[12] = {0, 0, -1, 0, 0, -1, 0, 0, -1, 0, 0, -1};
  uint32_t *domain = malloc(info.domain_node_count * sizeof *domain);
  upt_model_indices(model, UPT_SET_DOMAIN_NODES, domain, info.domain_node_count, NULL);
  for (int i = 0; i < 4; i++) {
    nodes[i] = domain[i];
  }
  upt_instrument tool = {.struct_size = sizeof tool, .shape = UPT_SHAPE_CAPSULE, .radius = 3};
  tool.position[0] = 500;
  tool.rotation[3] = 1;
  int by_tool = argc > 4 && argv[4][0] == 't';
  for (long i = 0; i < calls; i++) {
    double begin = now();
    upt_status status =
        by_tool ? upt_scene_step_instruments(scene, &tool, 1, out, 3 * info.node_count)
                : upt_scene_step_contacts(scene, nodes, vectors, 4, out, 3 * info.node_count);
    if (status < 0) {
      fprintf(stderr, "%s\n", upt_last_error());
      return 1;
    }
    seconds[i] = now() - begin;
  }
  for (long i = 0; i < calls; i++) {
    printf("%.9f\n", seconds[i]);
  }
  upt_scene_destroy(scene);
  upt_model_close(model);
  return 0;
}
