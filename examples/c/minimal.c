/* Loads a bundle, pushes one site of its domain for 6 s, lets go for 2 s, and prints what a step
 * costs.
 *
 *   minimal BUNDLE [STEPS]       BUNDLE: a folder with bundle.json; STEPS: default 160 (8 s)
 *
 * Lengths are mm. The push follows the surface's inward normal with sin^2 in time, as the training
 * schemes do.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "upt.h"

#define PUSH_MM 8.0
#define PATCH_RADIUS_MM 8.0
#define PUSH_SECONDS 6.0

static void require(upt_status status) {
  if (status < 0) {
    fprintf(stderr, "%s: %s\n", upt_status_name(status), upt_last_error());
    exit(1);
  }
}

static void *allocate(size_t count, size_t size) {
  void *memory = calloc(count > 0 ? count : 1, size);
  if (memory == NULL) {
    fprintf(stderr, "out of memory\n");
    exit(1);
  }
  return memory;
}

static uint32_t *indices(const upt_model *model, int32_t set, uint64_t *count) {
  uint32_t *out;
  require(upt_model_read_indices(model, set, NULL, 0, count));
  out = allocate((size_t)*count, sizeof *out);
  require(upt_model_read_indices(model, set, out, *count, count));
  return out;
}

/* The unit normal of a triangle, times its area, is added to normal. */
static void add_normal(const float *positions, const uint32_t *face, double normal[3]) {
  double a[3], b[3];
  int axis;
  for (axis = 0; axis < 3; axis++) {
    a[axis] = positions[3 * face[1] + axis] - positions[3 * face[0] + axis];
    b[axis] = positions[3 * face[2] + axis] - positions[3 * face[0] + axis];
  }
  normal[0] += 0.5 * (a[1] * b[2] - a[2] * b[1]);
  normal[1] += 0.5 * (a[2] * b[0] - a[0] * b[2]);
  normal[2] += 0.5 * (a[0] * b[1] - a[1] * b[0]);
}

static double distance(const float *a, const float *b) {
  const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
  return sqrt(x * x + y * y + z * z);
}

static int by_value(const void *a, const void *b) {
  const double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

int main(int argc, char **argv) {
  const long step_count = argc > 2 ? strtol(argv[2], NULL, 10) : 160;
  upt_model *model = NULL;
  upt_scene *scene = NULL;
  upt_model_info info;
  upt_scene_timing timing;
  upt_input input;
  float *positions, *displacement, *vectors;
  uint32_t *domain, *faces, *patch;
  uint64_t domain_count, face_count, patch_count = 0, i;
  double normal[3] = {0.0, 0.0, 0.0}, length, largest = 0.0, *times;
  const float *seed;
  long step;
  int axis;

  if (argc < 2 || step_count < 1) {
    fprintf(stderr, "usage: %s BUNDLE [STEPS]\n", argv[0]);
    return 2;
  }
  if (upt_abi_version() != UPT_ABI_VERSION) {
    fprintf(stderr, "libupt %s speaks another ABI than this program\n", upt_version());
    return 1;
  }

  require(upt_model_create(argv[1], NULL, &model));
  memset(&info, 0, sizeof info);
  info.struct_size = sizeof info;
  require(upt_model_read_info(model, &info));
  require(upt_scene_create(model, NULL, &scene));
  printf("libupt %s, %s bundle, K = %lu, opened in %.0f ms\n", upt_version(),
         info.kind == UPT_KIND_REDUCED ? "reduced" : "upt", (unsigned long)info.node_count,
         1e3 * info.load_seconds);

  positions = allocate(3 * (size_t)info.node_count, sizeof *positions);
  displacement = allocate(3 * (size_t)info.node_count, sizeof *displacement);
  require(upt_model_read_positions(model, positions, 3 * info.node_count));
  domain = indices(model, UPT_SET_DOMAIN_NODES, &domain_count);
  faces = indices(model, UPT_SET_DOMAIN_FACES, &face_count);
  if (domain_count == 0) {
    fprintf(stderr, "the bundle's mesh has no domain to touch\n");
    return 1;
  }

  /* One site: the domain's nodes near its middle node, pushed against their mean normal. */
  patch = allocate((size_t)domain_count, sizeof *patch);
  vectors = allocate(3 * (size_t)domain_count, sizeof *vectors);
  seed = positions + 3 * domain[domain_count / 2];
  for (i = 0; i < domain_count; i++) {
    if (distance(positions + 3 * domain[i], seed) <= PATCH_RADIUS_MM) {
      patch[patch_count++] = domain[i];
    }
  }
  for (i = 0; i + 2 < face_count; i += 3) {
    if (distance(positions + 3 * faces[i], seed) <= PATCH_RADIUS_MM) {
      add_normal(positions, faces + i, normal);
    }
  }
  length = sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
  printf("site: %lu nodes around (%.1f, %.1f, %.1f) mm\n", (unsigned long)patch_count, seed[0],
         seed[1], seed[2]);

  memset(&input, 0, sizeof input);
  input.struct_size = sizeof input;
  input.contact_nodes = patch;
  input.contact_vectors = vectors;
  times = allocate((size_t)step_count, sizeof *times);
  for (step = 0; step < step_count; step++) {
    const double time = (step + 1) * info.dt;
    const double phase = sin(3.14159265358979 * time / PUSH_SECONDS);
    const double push = PUSH_MM * phase * phase;
    const uint64_t contact_count = time < PUSH_SECONDS ? patch_count : 0;
    for (i = 0; i < contact_count; i++) {
      for (axis = 0; axis < 3; axis++) {
        vectors[3 * i + axis] = (float)(length > 0.0 ? -push * normal[axis] / length : 0.0);
      }
    }
    input.contact_count = contact_count;
    require(upt_scene_step(scene, &input, displacement, 3 * info.node_count));
    memset(&timing, 0, sizeof timing);
    timing.struct_size = sizeof timing;
    require(upt_scene_read_timing(scene, &timing));
    times[step] = timing.step_ms;
    for (i = 0; i < info.node_count; i++) {
      const float zero[3] = {0.0F, 0.0F, 0.0F};
      const double size = distance(displacement + 3 * i, zero);
      largest = size > largest ? size : largest;
    }
  }

  qsort(times, (size_t)step_count, sizeof *times, by_value);
  printf("%ld steps of %.0f ms: median %.2f ms, p99 %.2f ms, largest %.2f ms\n", step_count,
         1e3 * info.dt, times[step_count / 2], times[(step_count * 99) / 100],
         times[step_count - 1]);
  printf("largest displacement %.2f mm\n", largest);

  require(upt_scene_destroy(scene));
  require(upt_model_destroy(model));
  require(upt_shutdown());
  free(times);
  free(vectors);
  free(patch);
  free(faces);
  free(domain);
  free(displacement);
  free(positions);
  return 0;
}
