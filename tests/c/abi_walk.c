/* Walks every function of upt.h and every status code.
 *
 *   abi_walk BUNDLE DAMAGED      DAMAGED: folder with version/, hash/, json/: copies of BUNDLE made
 * wrong
 *
 * UPT_ERR_RUNTIME needs a process without ONNX Runtime: runtime_missing.c. UPT_ERR_PANIC needs a
 * library built with feature "fault"; without it that part is left out and said.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <math.h>
#include <pthread.h>
#include <stdlib.h>

#include "expect.h"

#define MANY 20000

static upt_model *model;
static upt_model_info info;
static uint64_t floats;       /* 3 K */
static float *before, *after; /* [K,3] */
static uint32_t contact_nodes[4];
static float contact_vectors[12];
static int log_count;

static void on_log(int32_t level, const char *message, void *user) {
  (void)level;
  (void)message;
  ++*(int *)user;
}

static upt_scene *make_scene_with(int32_t guard_policy) {
  upt_scene *scene = NULL;
  upt_scene_options options;
  memset(&options, 0, sizeof options);
  options.struct_size = sizeof options;
  options.guard_policy = guard_policy;
  EXPECT(upt_scene_create(model, &options, &scene), UPT_OK);
  return scene;
}

/* The fixtures' weights are random: their states are not refused, but flagged. */
static upt_scene *make_scene(void) { return make_scene_with(UPT_GUARD_REPORT); }

/* The scene's state is what it was when `before` was read. */
static void expect_unchanged(upt_scene *scene) {
  EXPECT(upt_scene_read(scene, after, floats), UPT_OK);
  EXPECT_TRUE(memcmp(before, after, (size_t)floats * sizeof *before) == 0);
}

static void walk_library(void) {
  upt_init_options options;
  char text[16], *all;
  uint64_t needed = 0;
  memset(&options, 0, sizeof options);

  EXPECT_TRUE(upt_abi_version() == UPT_ABI_VERSION);
  EXPECT_TRUE(strchr(upt_version(), '.') != NULL);
  EXPECT_TRUE(strcmp(upt_status_name(UPT_ERR_GUARD), "UPT_ERR_GUARD") == 0);
  EXPECT_TRUE(strcmp(upt_status_name(-77), "UPT_UNKNOWN") == 0);

  EXPECT(upt_init(&options), UPT_ERR_STRUCT_SIZE);
  EXPECT_TRUE(strstr(upt_last_error(), "upt_init") != NULL);
  options.struct_size = sizeof options;
  options.onnxruntime_path = "\xff\xfe";
  EXPECT(upt_init(&options), UPT_ERR_ARGUMENT);
  options.onnxruntime_path = NULL;
  EXPECT(upt_init(&options), UPT_OK);
  EXPECT(upt_init(&options), UPT_OK);
  options.threads = 3;
  EXPECT(upt_init(&options), UPT_ERR_STATE);

  EXPECT(upt_set_log(on_log, &log_count, 17), UPT_ERR_ARGUMENT);
  EXPECT(upt_set_log(on_log, &log_count, UPT_LOG_TRACE), UPT_OK);

  EXPECT(upt_providers(NULL, 0, NULL), UPT_ERR_NULL);
  EXPECT(upt_providers(NULL, 0, &needed), UPT_OK);
  EXPECT_TRUE(needed > 20);
  EXPECT(upt_providers(text, 4, NULL), UPT_ERR_ARGUMENT);
  all = malloc((size_t)needed + 1);
  EXPECT(upt_providers(all, needed, &needed), UPT_OK);
  EXPECT_TRUE(strlen(all) + 1 == needed);
  EXPECT_TRUE(strstr(all, "available") != NULL);
  free(all);
}

static void walk_model_open(const char *bundle, const char *damaged) {
  char path[4096];
  upt_model_options options;
  const int32_t cuda = UPT_PROVIDER_CUDA, unknown = 44;
  memset(&options, 0, sizeof options);

  EXPECT(upt_model_open(NULL, NULL, &model), UPT_ERR_NULL);
  EXPECT(upt_model_open(bundle, NULL, NULL), UPT_ERR_NULL);
  EXPECT(upt_model_open("", NULL, &model), UPT_ERR_ARGUMENT);
  EXPECT(upt_model_open("no/such/bundle", NULL, &model), UPT_ERR_IO);
  EXPECT(upt_model_open(bundle, &options, &model), UPT_ERR_STRUCT_SIZE);
  options.struct_size = sizeof options;
  options.reserved = 1;
  EXPECT(upt_model_open(bundle, &options, &model), UPT_ERR_ARGUMENT);
  options.reserved = 0;
  options.no_fallback = 7;
  EXPECT(upt_model_open(bundle, &options, &model), UPT_ERR_ARGUMENT);
  options.no_fallback = 1;
  options.provider_count = 1;
  EXPECT(upt_model_open(bundle, &options, &model), UPT_ERR_NULL);
  options.providers = &unknown;
  EXPECT(upt_model_open(bundle, &options, &model), UPT_ERR_ARGUMENT);
  options.providers = &cuda;
  EXPECT(upt_model_open(bundle, &options, &model), UPT_ERR_PROVIDER);
  options.provider_count = 0;
  options.providers = NULL;
  options.precision = 12;
  EXPECT(upt_model_open(bundle, &options, &model), UPT_ERR_ARGUMENT);

  snprintf(path, sizeof path, "%s/version", damaged);
  EXPECT(upt_model_open(path, NULL, &model), UPT_ERR_VERSION);
  snprintf(path, sizeof path, "%s/hash", damaged);
  EXPECT(upt_model_open(path, NULL, &model), UPT_ERR_BUNDLE);
  snprintf(path, sizeof path, "%s/json", damaged);
  EXPECT(upt_model_open(path, NULL, &model), UPT_ERR_BUNDLE);
  EXPECT_TRUE(strstr(upt_last_error(), "bundle.json") != NULL);
  EXPECT_TRUE(model == NULL);

  options.precision = UPT_PRECISION_F32;
  options.providers = &cuda;
  options.provider_count = 1;
  options.no_fallback = 0;
  EXPECT(upt_model_open(bundle, &options, &model), UPT_OK);
  EXPECT(upt_model_close(model), UPT_OK);
  EXPECT(upt_model_open(bundle, NULL, &model), UPT_OK);
}

static void walk_model(void) {
  char text[8], *all;
  uint64_t needed = 0, set_sizes[6];
  int32_t set;
  uint32_t one = 0, *indices;
  memset(&info, 0, sizeof info);
  EXPECT(upt_model_get_info(NULL, &info), UPT_ERR_NULL);
  EXPECT(upt_model_get_info(model, NULL), UPT_ERR_NULL);
  EXPECT(upt_model_get_info(model, &info), UPT_ERR_STRUCT_SIZE);
  info.struct_size = sizeof info;
  EXPECT(upt_model_get_info(model, &info), UPT_OK);
  EXPECT_TRUE(info.struct_size == sizeof info);
  EXPECT_TRUE(info.node_count > 0 && info.tet_count > 0 && info.dt > 0.0F);
  EXPECT_TRUE(info.provider == UPT_PROVIDER_CPU);
  floats = 3 * info.node_count;
  before = calloc((size_t)floats, sizeof *before);
  after = calloc((size_t)floats, sizeof *after);

  EXPECT(upt_model_describe(NULL, text, sizeof text, NULL), UPT_ERR_NULL);
  EXPECT(upt_model_describe(model, text, sizeof text, &needed), UPT_ERR_ARGUMENT);
  all = malloc((size_t)needed + 1);
  EXPECT(upt_model_describe(model, all, needed, NULL), UPT_OK);
  EXPECT_TRUE(all[0] == '{' && strlen(all) + 1 == needed);
  free(all);

  EXPECT(upt_model_positions(NULL, before, floats), UPT_ERR_NULL);
  EXPECT(upt_model_positions(model, NULL, floats), UPT_ERR_NULL);
  EXPECT(upt_model_positions(model, before, floats - 1), UPT_ERR_ARGUMENT);
  EXPECT(upt_model_positions(model, (float *)((char *)before + 1), floats), UPT_ERR_ARGUMENT);
  EXPECT(upt_model_positions(model, before, floats), UPT_OK);
  EXPECT_TRUE(isfinite(before[0]));

  EXPECT(upt_model_indices(model, 99, NULL, 0, &needed), UPT_ERR_ARGUMENT);
  EXPECT(upt_model_indices(NULL, UPT_SET_TETS, NULL, 0, &needed), UPT_ERR_NULL);
  EXPECT(upt_model_indices(model, UPT_SET_TETS, NULL, 0, NULL), UPT_ERR_NULL);
  EXPECT(upt_model_indices(model, UPT_SET_TETS, &one, 1, NULL), UPT_ERR_ARGUMENT);
  for (set = UPT_SET_SURFACE_NODES; set <= UPT_SET_TETS; set++) {
    uint64_t i;
    EXPECT(upt_model_indices(model, set, NULL, 0, &needed), UPT_OK);
    indices = malloc((size_t)needed * sizeof *indices + 1);
    EXPECT(upt_model_indices(model, set, indices, needed, NULL), UPT_OK);
    for (i = 0; i < needed; i++) {
      if (indices[i] >= info.node_count) {
        EXPECT_TRUE(indices[i] < info.node_count);
        break;
      }
    }
    if (set == UPT_SET_DOMAIN_NODES) {
      EXPECT_TRUE(needed >= 4);
      memcpy(contact_nodes, indices, sizeof contact_nodes);
    }
    set_sizes[set] = needed;
    free(indices);
  }
  EXPECT_TRUE(set_sizes[UPT_SET_TETS] == 4 * info.tet_count);
  EXPECT_TRUE(set_sizes[UPT_SET_SURFACE_FACES] == 3 * info.surface_face_count);
  EXPECT_TRUE(set_sizes[UPT_SET_DOMAIN_NODES] == info.domain_node_count);
  EXPECT_TRUE(set_sizes[UPT_SET_FIXED_NODES] == info.held_node_count);
}

static void walk_scene_create(const char *reduced_bundle) {
  upt_scene *scene = NULL;
  upt_model *reduced = NULL;
  upt_scene_options options;
  memset(&options, 0, sizeof options);
  EXPECT(upt_scene_create(NULL, NULL, &scene), UPT_ERR_NULL);
  EXPECT(upt_scene_create(model, NULL, NULL), UPT_ERR_NULL);
  EXPECT(upt_scene_create(model, &options, &scene), UPT_ERR_STRUCT_SIZE);
  options.struct_size = sizeof options;
  options.kernel = 9;
  EXPECT(upt_scene_create(model, &options, &scene), UPT_ERR_ARGUMENT);
  options.kernel = UPT_KERNEL_AUTO;
  options.guard_policy = -1;
  EXPECT(upt_scene_create(model, &options, &scene), UPT_ERR_ARGUMENT);
  options.guard_policy = UPT_GUARD_HOLD;
  options.reserved[2] = 1;
  EXPECT(upt_scene_create(model, &options, &scene), UPT_ERR_ARGUMENT);
  options.reserved[2] = 0;
  options.mesh_path = "no/such.mesh.safetensors";
  EXPECT_TRUE(upt_scene_create(model, &options, &scene) < 0);
  /* A reduced bundle's tables belong to its own mesh. */
  EXPECT(upt_model_open(reduced_bundle, NULL, &reduced), UPT_OK);
  EXPECT(upt_scene_create(reduced, &options, &scene), UPT_ERR_UNSUPPORTED);
  EXPECT(upt_model_close(reduced), UPT_OK);
  options.mesh_path = NULL;
  EXPECT_TRUE(scene == NULL);
  EXPECT(upt_scene_create(model, &options, &scene), UPT_OK);
  EXPECT(upt_scene_destroy(scene), UPT_OK);
}

static void walk_step(void) {
  upt_scene *scene = make_scene(), *twin = make_scene(), *held = make_scene_with(UPT_GUARD_HOLD);
  float *field = calloc((size_t)floats, sizeof *field);
  uint32_t far[1];
  int i;
  far[0] = (uint32_t)info.node_count;
  for (i = 0; i < 12; i++) {
    contact_vectors[i] = i % 3 == 2 ? -2.0F : 0.5F;
  }
  for (i = 0; i < 12; i++) {
    field[3 * contact_nodes[i / 3] + (uint32_t)(i % 3)] = contact_vectors[i];
  }

  EXPECT(upt_scene_step(NULL, NULL, NULL, NULL, 0), UPT_ERR_NULL);
  EXPECT(upt_scene_step(scene, NULL, field, NULL, floats), UPT_ERR_NULL);
  EXPECT(upt_scene_step(scene, NULL, field, after, floats - 3), UPT_ERR_ARGUMENT);
  EXPECT(upt_scene_step(scene, NULL, field, before, floats), UPT_OK);
  for (i = 0; i < 12; i++) {
    EXPECT_TRUE(before[3 * contact_nodes[i / 3] + (uint32_t)(i % 3)] == contact_vectors[i]);
  }
  expect_unchanged(scene);

  /* The sparse form is the same step. */
  EXPECT(upt_scene_step_contacts(twin, contact_nodes, contact_vectors, 4, after, floats), UPT_OK);
  EXPECT_TRUE(memcmp(before, after, (size_t)floats * sizeof *before) == 0);

  /* A refused step leaves the state. */
  field[0] = NAN;
  EXPECT(upt_scene_step(scene, NULL, field, NULL, 0), UPT_ERR_NON_FINITE);
  EXPECT(upt_scene_step(scene, field, NULL, NULL, 0), UPT_ERR_NON_FINITE);
  EXPECT(upt_scene_step_contacts(NULL, NULL, NULL, 0, NULL, 0), UPT_ERR_NULL);
  EXPECT(upt_scene_step_contacts(scene, NULL, contact_vectors, 4, NULL, 0), UPT_ERR_NULL);
  EXPECT(upt_scene_step_contacts(scene, contact_nodes, NULL, 4, NULL, 0), UPT_ERR_NULL);
  EXPECT(upt_scene_step_contacts(scene, far, contact_vectors, 1, NULL, 0), UPT_ERR_ARGUMENT);
  EXPECT(upt_scene_step_contacts(scene, contact_nodes, contact_vectors, UINT64_MAX, NULL, 0),
         UPT_ERR_ARGUMENT);
  contact_vectors[5] = INFINITY;
  EXPECT(upt_scene_step_contacts(scene, contact_nodes, contact_vectors, 4, NULL, 0),
         UPT_ERR_NON_FINITE);
  contact_vectors[5] = -2.0F;
  expect_unchanged(scene);

  /* So does one that the guard refuses. */
  EXPECT(upt_scene_read(held, before, floats), UPT_OK);
  contact_vectors[5] = 1000.0F;
  EXPECT(upt_scene_step_contacts(held, contact_nodes, contact_vectors, 4, NULL, 0), UPT_ERR_GUARD);
  contact_vectors[5] = -2.0F;
  expect_unchanged(held);
  EXPECT(upt_scene_destroy(held), UPT_OK);

  EXPECT(upt_scene_read(NULL, after, floats), UPT_ERR_NULL);
  EXPECT(upt_scene_read(scene, NULL, 0), UPT_ERR_NULL);
  EXPECT(upt_scene_read(scene, after, 3), UPT_ERR_ARGUMENT);

  /* The output may be the memory of an input. */
  field[0] = 0.0F;
  memset(field, 0, (size_t)floats * sizeof *field);
  EXPECT(upt_scene_step(scene, field, NULL, field, floats), UPT_OK);
  memset(after, 0, (size_t)floats * sizeof *after);
  EXPECT(upt_scene_reset(twin), UPT_OK);
  EXPECT(upt_scene_step(twin, after, NULL, before, floats), UPT_OK);

  EXPECT(upt_scene_reset(NULL), UPT_ERR_NULL);
  EXPECT(upt_scene_reset(scene), UPT_OK);
  EXPECT(upt_scene_read(scene, after, floats), UPT_OK);
  for (i = 0; i < (int)floats; i++) {
    if (after[i] != 0.0F) {
      EXPECT_TRUE(after[i] == 0.0F);
      break;
    }
  }
  EXPECT(upt_scene_destroy(scene), UPT_OK);
  EXPECT(upt_scene_destroy(twin), UPT_OK);
  free(field);
}

static void walk_worker(void) {
  upt_scene *scene = make_scene(), *twin = make_scene(), *held = make_scene_with(UPT_GUARD_HOLD);
  int i;
  EXPECT(upt_scene_submit(NULL, contact_nodes, contact_vectors, 4), UPT_ERR_NULL);
  EXPECT(upt_scene_submit(scene, NULL, contact_vectors, 4), UPT_ERR_NULL);
  EXPECT(upt_scene_poll(NULL), UPT_ERR_NULL);
  EXPECT(upt_scene_wait(NULL, 0), UPT_ERR_NULL);
  EXPECT(upt_scene_wait(scene, 0), UPT_ERR_STATE);
  EXPECT(upt_scene_submit(scene, contact_nodes, contact_vectors, 4), UPT_OK);
  EXPECT(upt_scene_wait(scene, 60000), UPT_OK);
  EXPECT(upt_scene_read(scene, before, floats), UPT_OK);
  EXPECT(upt_scene_step_contacts(twin, contact_nodes, contact_vectors, 4, after, floats), UPT_OK);
  EXPECT_TRUE(memcmp(before, after, (size_t)floats * sizeof *before) == 0);

  /* A step in flight: pending, busy, and reads of published states go on. */
  for (i = 0; i < MANY && !(expect_seen[99] && expect_seen[-UPT_ERR_BUSY]); i++) {
    upt_status status;
    EXPECT(upt_scene_submit(scene, contact_nodes, contact_vectors, 4), UPT_OK);
    status = upt_scene_step(scene, NULL, NULL, NULL, 0);
    if (status == UPT_ERR_BUSY) {
      EXPECT(status, UPT_ERR_BUSY);
    }
    EXPECT(upt_scene_read(scene, after, floats), UPT_OK);
    status = upt_scene_poll(scene);
    if (status == UPT_PENDING) {
      EXPECT(status, UPT_PENDING);
    }
    if (status == UPT_PENDING) {
      EXPECT(upt_scene_wait(scene, 60000), UPT_OK);
    }
  }
  EXPECT_TRUE(expect_seen[99]);
  EXPECT_TRUE(expect_seen[-UPT_ERR_BUSY]);

  /* The error of a submitted step is given once. */
  contact_vectors[5] = 1000.0F;
  EXPECT(upt_scene_submit(held, contact_nodes, contact_vectors, 4), UPT_OK);
  EXPECT(upt_scene_wait(held, 60000), UPT_ERR_GUARD);
  EXPECT(upt_scene_destroy(held), UPT_OK);
  contact_vectors[5] = -2.0F;

  EXPECT(upt_scene_sample(NULL, 0.5, after, floats), UPT_ERR_NULL);
  EXPECT(upt_scene_sample(scene, 0.5, NULL, floats), UPT_ERR_NULL);
  EXPECT(upt_scene_sample(scene, NAN, after, floats), UPT_ERR_NON_FINITE);
  EXPECT(upt_scene_sample(scene, 0.5, after, 6), UPT_ERR_ARGUMENT);
  EXPECT(upt_scene_sample(scene, 1.0, after, floats), UPT_OK);
  EXPECT(upt_scene_read(scene, before, floats), UPT_OK);
  EXPECT_TRUE(memcmp(before, after, (size_t)floats * sizeof *before) == 0);
  EXPECT(upt_scene_destroy(scene), UPT_OK);
  EXPECT(upt_scene_destroy(twin), UPT_OK);
}

static void walk_region_and_points(void) {
  upt_scene *scene = make_scene();
  const uint32_t far = (uint32_t)info.node_count;
  float few[12], points[6] = {0};
  float *positions = calloc((size_t)floats, sizeof *positions);
  upt_status status;
  int i;
  EXPECT(upt_scene_step_contacts(scene, contact_nodes, contact_vectors, 4, before, floats), UPT_OK);

  EXPECT(upt_scene_decode(NULL, contact_nodes, 4, few, 12), UPT_ERR_NULL);
  EXPECT(upt_scene_decode(scene, NULL, 4, few, 12), UPT_ERR_NULL);
  EXPECT(upt_scene_decode(scene, contact_nodes, 4, NULL, 12), UPT_ERR_NULL);
  EXPECT(upt_scene_decode(scene, contact_nodes, 4, few, 9), UPT_ERR_ARGUMENT);
  EXPECT(upt_scene_decode(scene, &far, 1, few, 3), UPT_ERR_ARGUMENT);
  EXPECT(upt_scene_decode(scene, contact_nodes, 4, few, 12), UPT_OK);
  for (i = 0; i < 12; i++) {
    EXPECT_TRUE(few[i] == before[3 * contact_nodes[i / 3] + (uint32_t)(i % 3)]);
  }

  EXPECT(upt_scene_set_region(NULL, contact_nodes, 4), UPT_ERR_NULL);
  EXPECT(upt_scene_set_region(scene, NULL, 4), UPT_ERR_NULL);
  EXPECT(upt_scene_set_region(scene, &far, 1), UPT_ERR_ARGUMENT);
  EXPECT(upt_scene_set_region(scene, contact_nodes, 4), UPT_OK);
  EXPECT(upt_scene_step_contacts(scene, contact_nodes, contact_vectors, 4, before, floats),
         UPT_ERR_ARGUMENT);
  EXPECT(upt_scene_step_contacts(scene, contact_nodes, contact_vectors, 4, few, 12), UPT_OK);
  EXPECT(upt_scene_set_region(scene, NULL, 0), UPT_OK);

  EXPECT(upt_model_positions(model, positions, floats), UPT_OK);
  memcpy(points, positions + 3 * contact_nodes[0], 3 * sizeof *points);
  memcpy(points + 3, positions + 3 * contact_nodes[1], 3 * sizeof *points);
  EXPECT(upt_scene_read_points(scene, points, 6), UPT_ERR_STATE);
  EXPECT(upt_scene_sample_points(scene, 0.5, points, 6), UPT_ERR_STATE);
  EXPECT(upt_scene_attach_points(NULL, points, 2), UPT_ERR_NULL);
  EXPECT(upt_scene_attach_points(scene, NULL, 2), UPT_ERR_NULL);
  points[1] = NAN;
  EXPECT(upt_scene_attach_points(scene, points, 2), UPT_ERR_NON_FINITE);
  points[1] = positions[3 * contact_nodes[0] + 1];
  EXPECT(upt_scene_attach_points(scene, points, 2), UPT_OK);
  EXPECT(upt_scene_step_contacts(scene, contact_nodes, contact_vectors, 4, before, floats), UPT_OK);
  EXPECT(upt_scene_read_points(NULL, few, 6), UPT_ERR_NULL);
  EXPECT(upt_scene_read_points(scene, NULL, 6), UPT_ERR_NULL);
  EXPECT(upt_scene_read_points(scene, few, 3), UPT_ERR_ARGUMENT);
  EXPECT(upt_scene_read_points(scene, few, 6), UPT_OK);
  EXPECT_TRUE(isfinite(few[0]) && isfinite(few[5]));
  EXPECT(upt_scene_sample_points(NULL, 1.0, few, 6), UPT_ERR_NULL);
  EXPECT(upt_scene_sample_points(scene, INFINITY, few, 6), UPT_ERR_NON_FINITE);
  EXPECT(upt_scene_sample_points(scene, 1.0, few, 3), UPT_ERR_ARGUMENT);
  EXPECT(upt_scene_sample_points(scene, 1.0, few, 6), UPT_OK);
  status = upt_scene_attach_points(scene, NULL, 0);
  EXPECT(status, UPT_OK);
  EXPECT(upt_scene_destroy(scene), UPT_OK);
  free(positions);
}

static void walk_instrument(void) {
  upt_scene *scene = make_scene();
  upt_instrument instrument;
  uint32_t *nodes = calloc((size_t)info.node_count, sizeof *nodes);
  float *vectors = calloc((size_t)floats, sizeof *vectors), few[12];
  uint64_t count = 0;
  upt_status status;
  memset(&instrument, 0, sizeof instrument);
  EXPECT(upt_model_positions(model, before, floats), UPT_OK);

  EXPECT(upt_scene_contacts_from_instruments(NULL, &instrument, 1, NULL, NULL, 0, &count),
         UPT_ERR_NULL);
  EXPECT(upt_scene_contacts_from_instruments(scene, &instrument, 1, NULL, NULL, 0, NULL),
         UPT_ERR_NULL);
  EXPECT(upt_scene_contacts_from_instruments(scene, NULL, 1, NULL, NULL, 0, &count), UPT_ERR_NULL);
  EXPECT(upt_scene_contacts_from_instruments(scene, &instrument, 1, nodes, vectors, info.node_count,
                                             &count),
         UPT_ERR_STRUCT_SIZE);
  instrument.struct_size = sizeof instrument;
  instrument.rotation[3] = 1.0F;
  instrument.radius = 3.0F;
  instrument.half_extents[1] = 5.0F;
  memcpy(instrument.position, before + 3 * contact_nodes[0], sizeof instrument.position);
  instrument.sticking = 4;
  EXPECT(upt_scene_contacts_from_instruments(scene, &instrument, 1, nodes, vectors, info.node_count,
                                             &count),
         UPT_ERR_ARGUMENT);
  instrument.sticking = 0;
  status = upt_scene_contacts_from_instruments(scene, &instrument, 1, nodes, vectors,
                                               info.node_count, &count);
  if (status == UPT_ERR_UNSUPPORTED) {
    EXPECT(status, UPT_ERR_UNSUPPORTED);
  } else {
    EXPECT(status, UPT_OK);
    EXPECT_TRUE(count > 0);
    instrument.position[0] = NAN;
    EXPECT(upt_scene_contacts_from_instruments(scene, &instrument, 1, nodes, vectors,
                                               info.node_count, &count),
           UPT_ERR_NON_FINITE);
  }

  EXPECT(upt_scene_contact_force(NULL, few, 12), UPT_ERR_NULL);
  EXPECT(upt_scene_contact_force(scene, NULL, 12), UPT_ERR_NULL);
  EXPECT(upt_scene_step_contacts(scene, contact_nodes, contact_vectors, 4, NULL, 0), UPT_OK);
  status = upt_scene_contact_force(scene, few, 12);
  if (status == UPT_ERR_UNSUPPORTED) {
    EXPECT(status, UPT_ERR_UNSUPPORTED);
  } else {
    EXPECT(status, UPT_OK);
    EXPECT_TRUE(isfinite(few[0]) && isfinite(few[11]));
    EXPECT(upt_scene_contact_force(scene, few, 9), UPT_ERR_ARGUMENT);
  }
  EXPECT(upt_scene_destroy(scene), UPT_OK);
  free(nodes);
  free(vectors);
}

static void walk_state(void) {
  upt_scene *scene = make_scene();
  upt_scene_stats stats;
  uint64_t needed = 0;
  uint8_t *bytes;
  int i;
  memset(&stats, 0, sizeof stats);
  for (i = 0; i < 3; i++) {
    EXPECT(upt_scene_step_contacts(scene, contact_nodes, contact_vectors, 4, NULL, 0), UPT_OK);
  }
  EXPECT(upt_scene_get_stats(NULL, &stats), UPT_ERR_NULL);
  EXPECT(upt_scene_get_stats(scene, NULL), UPT_ERR_NULL);
  EXPECT(upt_scene_get_stats(scene, &stats), UPT_ERR_STRUCT_SIZE);
  stats.struct_size = sizeof stats;
  EXPECT(upt_scene_get_stats(scene, &stats), UPT_OK);
  EXPECT_TRUE(stats.step_count == 3 && stats.contact_count == 4);
  EXPECT_TRUE(stats.step_ms > 0.0 && stats.max_displacement_mm > 1.0F);
  EXPECT_TRUE(stats.poisoned == 0 && stats.sleeping == 0);

  EXPECT(upt_scene_save(NULL, NULL, 0, &needed), UPT_ERR_NULL);
  EXPECT(upt_scene_save(scene, NULL, 0, NULL), UPT_ERR_NULL);
  EXPECT(upt_scene_save(scene, NULL, 0, &needed), UPT_OK);
  bytes = malloc((size_t)needed);
  EXPECT(upt_scene_save(scene, bytes, needed - 1, NULL), UPT_ERR_ARGUMENT);
  EXPECT(upt_scene_save(scene, bytes, needed, NULL), UPT_OK);
  EXPECT(upt_scene_read(scene, before, floats), UPT_OK);
  EXPECT(upt_scene_step(scene, NULL, NULL, NULL, 0), UPT_OK);
  EXPECT(upt_scene_restore(NULL, bytes, needed), UPT_ERR_NULL);
  EXPECT(upt_scene_restore(scene, NULL, needed), UPT_ERR_NULL);
  EXPECT(upt_scene_restore(scene, bytes, needed), UPT_OK);
  expect_unchanged(scene);
  EXPECT(upt_scene_restore(scene, bytes, needed / 2), UPT_ERR_SNAPSHOT);
  bytes[needed - 1] ^= 0x55;
  EXPECT(upt_scene_restore(scene, bytes, needed), UPT_ERR_SNAPSHOT);
  expect_unchanged(scene);
  EXPECT(upt_scene_destroy(scene), UPT_OK);
  free(bytes);
}

static void walk_handles(void) {
  upt_scene *scene = make_scene();
  upt_scene_stats stats;
  memset(&stats, 0, sizeof stats);
  stats.struct_size = sizeof stats;
  EXPECT(upt_scene_reset((upt_scene *)(void *)model), UPT_ERR_HANDLE);
  EXPECT_TRUE(strstr(upt_last_error(), "it is a model") != NULL);
  EXPECT(upt_model_get_info((upt_model *)(void *)scene, &info), UPT_ERR_HANDLE);
  EXPECT(upt_scene_reset((upt_scene *)(void *)&stats), UPT_ERR_HANDLE);
  EXPECT(upt_scene_destroy(scene), UPT_OK);
  EXPECT(upt_scene_destroy(scene), UPT_ERR_HANDLE);
  EXPECT_TRUE(strstr(upt_last_error(), "it was closed") != NULL);
  EXPECT(upt_scene_destroy(NULL), UPT_ERR_NULL);
  EXPECT(upt_scene_step(scene, NULL, NULL, NULL, 0), UPT_ERR_HANDLE);
  EXPECT(upt_scene_get_stats(scene, &stats), UPT_ERR_HANDLE);
}

static void *step_often(void *scene) {
  int i;
  for (i = 0; i < 200; i++) {
    upt_scene_step(scene, NULL, NULL, NULL, 0);
  }
  return NULL;
}

/* Two threads on one scene: each call either works or is refused as busy. */
static void walk_threads(void) {
  upt_scene *scene = make_scene();
  pthread_t thread;
  int i, other = 0;
  EXPECT_TRUE(pthread_create(&thread, NULL, step_often, scene) == 0);
  for (i = 0; i < 200; i++) {
    const upt_status status = upt_scene_step(scene, NULL, NULL, NULL, 0);
    other += status != UPT_OK && status != UPT_ERR_BUSY;
  }
  pthread_join(thread, NULL);
  EXPECT_TRUE(other == 0);
  EXPECT(upt_scene_destroy(scene), UPT_OK);
}

static int walk_panic(void) {
  upt_scene *scene, *sane;
  upt_scene_stats stats;
  upt_status (*test_panic)(upt_scene *);
  *(void **)&test_panic = dlsym(RTLD_DEFAULT, "upt_test_panic");
  if (test_panic == NULL) {
    printf("left out: UPT_ERR_PANIC (the library has no feature \"fault\")\n");
    return 0;
  }
  scene = make_scene();
  sane = make_scene();
  memset(&stats, 0, sizeof stats);
  stats.struct_size = sizeof stats;
  EXPECT(test_panic(scene), UPT_ERR_PANIC);
  EXPECT(upt_scene_step(scene, NULL, NULL, NULL, 0), UPT_ERR_PANIC);
  EXPECT(upt_scene_reset(scene), UPT_ERR_PANIC);
  EXPECT(upt_scene_get_stats(scene, &stats), UPT_OK);
  EXPECT_TRUE(stats.poisoned == 1);
  EXPECT(upt_scene_step(sane, NULL, NULL, NULL, 0), UPT_OK);
  EXPECT(upt_scene_destroy(scene), UPT_OK);
  EXPECT(upt_scene_destroy(sane), UPT_OK);
  return 1;
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
  if (argc != 4) {
    fprintf(stderr, "usage: %s BUNDLE DAMAGED REDUCED\n", argv[0]);
    return 2;
  }
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
  walk_state();
  walk_handles();
  walk_threads();
  panics = walk_panic();

  /* A scene outlives its model's handle; the library ends only after both. */
  orphan = make_scene();
  closed = model;
  EXPECT(upt_shutdown(), UPT_ERR_STATE);
  EXPECT(upt_model_close(NULL), UPT_ERR_NULL);
  EXPECT(upt_model_close(model), UPT_OK);
  EXPECT(upt_model_close(closed), UPT_ERR_HANDLE);
  EXPECT(upt_model_describe(closed, NULL, 0, NULL), UPT_ERR_HANDLE);
  EXPECT(upt_scene_step(orphan, NULL, NULL, NULL, 0), UPT_OK);
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
