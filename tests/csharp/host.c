/* The C host whose rollout the C# tests must equal to the bit: the push of InteropTests.Push over
 * 160 steps on the bundle argv[1]; the last displacement, [K,3] float32, goes to the file argv[2].
 */
#include "upt.h"

#include <stdio.h>
#include <stdlib.h>

static void require(upt_status status, const char *call) {
  if (status < 0) {
    fprintf(stderr, "%s: %s: %s\n", call, upt_status_name(status), upt_last_error());
    exit(1);
  }
}

int main(int argc, char **argv) {
  upt_model *model = NULL;
  upt_scene *scene = NULL;
  upt_model_info info = {0};
  upt_model_options model_options = {0};
  upt_input input = {0};
  uint32_t *domain, *nodes;
  float *positions, *vectors, *u;
  uint64_t domain_count = 0, node_count;
  FILE *out;
  int step;

  if (argc != 3) {
    fprintf(stderr, "usage: host BUNDLE OUT\n");
    return 2;
  }
  model_options.struct_size = sizeof model_options;
  model_options.threads = 1;
  require(upt_model_create(argv[1], &model_options, &model), "upt_model_create");
  info.struct_size = sizeof info;
  require(upt_model_read_info(model, &info), "upt_model_read_info");
  node_count = info.node_count;
  require(upt_model_read_indices(model, UPT_SET_DOMAIN_NODES, NULL, 0, &domain_count),
          "upt_model_read_indices");
  domain = malloc(domain_count * sizeof *domain);
  nodes = malloc(domain_count * sizeof *nodes);
  vectors = malloc(3 * domain_count * sizeof *vectors);
  positions = malloc(3 * node_count * sizeof *positions);
  u = malloc(3 * node_count * sizeof *u);
  if (!domain || !nodes || !vectors || !positions || !u)
    return 1;
  require(upt_model_read_indices(model, UPT_SET_DOMAIN_NODES, domain, domain_count, &domain_count),
          "upt_model_read_indices");
  require(upt_model_read_positions(model, positions, 3 * node_count), "upt_model_read_positions");
  require(upt_scene_create(model, NULL, &scene), "upt_scene_create");

  for (step = 1; step <= 160; step++) {
    const float *first = positions + 3 * (size_t)domain[domain_count / 2];
    float depth = step <= 40 ? 0.2f * (float)step : 8.0f;
    uint64_t i, count = 0;
    for (i = 0; step <= 120 && i < domain_count; i++) {
      const float *p = positions + 3 * (size_t)domain[i];
      double x = (double)p[0] - first[0], y = (double)p[1] - first[1], z = (double)p[2] - first[2];
      if (x * x + y * y + z * z > 100.0)
        continue;
      nodes[count] = domain[i];
      vectors[3 * count] = first[0] < 0 ? depth : -depth;
      vectors[3 * count + 1] = 0.0f;
      vectors[3 * count + 2] = 0.0f;
      count++;
    }
    input.struct_size = sizeof input;
    input.contact_nodes = nodes;
    input.contact_vectors = vectors;
    input.contact_count = count;
    require(upt_scene_step(scene, &input, u, 3 * node_count), "upt_scene_step");
  }
  out = fopen(argv[2], "wb");
  if (!out || fwrite(u, sizeof *u, 3 * node_count, out) != 3 * node_count || fclose(out) != 0) {
    perror(argv[2]);
    return 1;
  }
  require(upt_scene_destroy(scene), "upt_scene_destroy");
  require(upt_model_destroy(model), "upt_model_destroy");
  require(upt_shutdown(), "upt_shutdown");
  free(domain);
  free(nodes);
  free(vectors);
  free(positions);
  free(u);
  return 0;
}
