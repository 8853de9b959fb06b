/* Scenes and steps: options, dense and sparse contact, refused steps, the worker, sampling. */
#include <math.h>
#include <stdlib.h>

#include "walk.h"

#define MANY 20000

void walk_scene_create(const char *reduced_bundle) {
  upt_scene *scene = NULL;
  upt_model *reduced = NULL;
  upt_scene_options options;
  upt_scene_stats stats;
  memset(&options, 0, sizeof options);
  memset(&stats, 0, sizeof stats);
  EXPECT(upt_scene_create(NULL, NULL, &scene), UPT_ERR_NULL);
  EXPECT(upt_scene_create(model, NULL, NULL), UPT_ERR_NULL);
  EXPECT(upt_scene_create(model, &options, &scene), UPT_ERR_STRUCT_SIZE);
  options.struct_size = sizeof options;
  options.kernel = 9;
  EXPECT(upt_scene_create(model, &options, &scene), UPT_ERR_ARGUMENT);
  options.kernel = UPT_KERNEL_AUTO;
  options.step_path = 4;
  EXPECT(upt_scene_create(model, &options, &scene), UPT_ERR_ARGUMENT);
  options.step_path = UPT_STEP_AUTO;
  options.guard_policy = -1;
  EXPECT(upt_scene_create(model, &options, &scene), UPT_ERR_ARGUMENT);
  options.guard_policy = UPT_GUARD_HOLD;
  options.reserved[0] = 1;
  EXPECT(upt_scene_create(model, &options, &scene), UPT_ERR_ARGUMENT);
  options.reserved[0] = 0;
  /* Substeps need corrections with a target, and are at most 8. */
  options.substeps = 4;
  EXPECT(upt_scene_create(model, &options, &scene), UPT_ERR_ARGUMENT);
  options.substeps = 0;
  /* A budget limits the bundle's own corrections, none here; a target needs a count. */
  options.corrections.budget_us = 100;
  options.corrections.mode = UPT_CORRECTIONS_NONE;
  EXPECT(upt_scene_create(model, &options, &scene), UPT_ERR_ARGUMENT);
  options.corrections.mode = UPT_CORRECTIONS_RECOMMENDED;
  options.corrections.target_mm = 0.1f;
  EXPECT(upt_scene_create(model, &options, &scene), UPT_ERR_ARGUMENT);
  options.corrections.target_mm = 0.0f;
  /* A count belongs to its mode, and the mode to a count. */
  options.corrections.count = 5;
  EXPECT(upt_scene_create(model, &options, &scene), UPT_ERR_ARGUMENT);
  options.corrections.mode = UPT_CORRECTIONS_COUNT;
  options.corrections.count = 0;
  EXPECT(upt_scene_create(model, &options, &scene), UPT_ERR_ARGUMENT);
  options.corrections.mode = (upt_corrections_mode)7;
  EXPECT(upt_scene_create(model, &options, &scene), UPT_ERR_ARGUMENT);
  options.corrections.mode = UPT_CORRECTIONS_RECOMMENDED;
  EXPECT(upt_scene_create(model, &options, &scene), UPT_OK);
  EXPECT(upt_scene_destroy(scene), UPT_OK);
  scene = NULL;
  options.corrections.budget_us = 0;
  /* A damping of the scene's own needs corrections too, and has bounds. */
  options.damping_per_s = 2.0;
  EXPECT(upt_scene_create(model, &options, &scene), UPT_ERR_UNSUPPORTED);
  options.damping_per_s = -2.0;
  EXPECT(upt_scene_create(model, &options, &scene), UPT_ERR_ARGUMENT);
  options.damping_per_s = NAN;
  EXPECT(upt_scene_create(model, &options, &scene), UPT_ERR_NON_FINITE);
  options.damping_per_s = 0.0;
  options.mesh_path = "no/such.mesh.safetensors";
  EXPECT_TRUE(upt_scene_create(model, &options, &scene) < 0);
  /* A reduced bundle's tables belong to its own mesh. */
  EXPECT(upt_model_create(reduced_bundle, NULL, &reduced), UPT_OK);
  EXPECT(upt_scene_create(reduced, &options, &scene), UPT_ERR_UNSUPPORTED);
  /* Its contact forces are the linear response's. */
  EXPECT(upt_scene_create(reduced, NULL, &scene), UPT_OK);
  stats.struct_size = sizeof stats;
  EXPECT(upt_scene_read_stats(scene, &stats), UPT_OK);
  EXPECT_TRUE(stats.prior_forces == 1);
  EXPECT(upt_scene_destroy(scene), UPT_OK);
  scene = NULL;
  EXPECT(upt_model_destroy(reduced), UPT_OK);
  options.mesh_path = NULL;
  EXPECT_TRUE(scene == NULL);
  EXPECT(upt_scene_create(model, &options, &scene), UPT_OK);
  EXPECT(upt_scene_destroy(scene), UPT_OK);
}

void walk_step(void) {
  upt_scene *scene = make_scene(), *twin = make_scene(), *held = make_scene_with(UPT_GUARD_HOLD);
  float *field = calloc((size_t)floats, sizeof *field);
  uint32_t far[1];
  uint64_t absurd[5];
  int i;
  absurd[0] = info.node_count + 1;
  absurd[1] = 100 * info.node_count;
  absurd[2] = (uint64_t)1 << 31;
  absurd[3] = (uint64_t)1 << 59;
  absurd[4] = UINT64_MAX;
  far[0] = (uint32_t)info.node_count;
  for (i = 0; i < 12; i++) {
    contact_vectors[i] = i % 3 == 2 ? -2.0F : 0.5F;
  }
  for (i = 0; i < 12; i++) {
    field[3 * contact_nodes[i / 3] + (uint32_t)(i % 3)] = contact_vectors[i];
  }

  EXPECT(upt_scene_step(NULL, NULL, NULL, 0), UPT_ERR_NULL);
  EXPECT(upt_scene_step_field(scene, NULL, field, NULL, floats), UPT_ERR_NULL);
  EXPECT(upt_scene_step_field(scene, NULL, field, after, floats - 3), UPT_ERR_ARGUMENT);
  EXPECT(upt_scene_step_field(scene, NULL, field, before, floats), UPT_OK);
  for (i = 0; i < 12; i++) {
    EXPECT_TRUE(before[3 * contact_nodes[i / 3] + (uint32_t)(i % 3)] == contact_vectors[i]);
  }
  expect_unchanged(scene);

  /* The sparse form is the same step. */
  EXPECT(step_nodes(twin, contact_nodes, contact_vectors, 4, after, floats), UPT_OK);
  EXPECT_TRUE(memcmp(before, after, (size_t)floats * sizeof *before) == 0);

  /* A refused step leaves the state. */
  field[0] = NAN;
  EXPECT(upt_scene_step_field(scene, NULL, field, NULL, 0), UPT_ERR_NON_FINITE);
  EXPECT(upt_scene_step_field(scene, field, NULL, NULL, 0), UPT_ERR_NON_FINITE);
  EXPECT(upt_scene_step(NULL, NULL, NULL, 0), UPT_ERR_NULL);
  EXPECT(step_nodes(scene, NULL, contact_vectors, 4, NULL, 0), UPT_ERR_NULL);
  EXPECT(step_nodes(scene, contact_nodes, NULL, 4, NULL, 0), UPT_ERR_NULL);
  EXPECT(step_nodes(scene, far, contact_vectors, 1, NULL, 0), UPT_ERR_ARGUMENT);
  for (i = 0; i < (int)(sizeof absurd / sizeof *absurd); i++) {
    EXPECT(step_nodes(scene, contact_nodes, contact_vectors, absurd[i], NULL, 0), UPT_ERR_ARGUMENT);
    EXPECT(submit_nodes(scene, contact_nodes, contact_vectors, absurd[i]), UPT_ERR_ARGUMENT);
    EXPECT(step_nodes(scene, contact_nodes, before, absurd[i], before, floats), UPT_ERR_ARGUMENT);
  }
  contact_vectors[5] = INFINITY;
  EXPECT(step_nodes(scene, contact_nodes, contact_vectors, 4, NULL, 0), UPT_ERR_NON_FINITE);
  contact_vectors[5] = -2.0F;
  expect_unchanged(scene);

  /* So does one that the guard refuses. */
  EXPECT(upt_scene_read(held, NULL, before, floats), UPT_OK);
  contact_vectors[5] = 1000.0F;
  EXPECT(step_nodes(held, contact_nodes, contact_vectors, 4, NULL, 0), UPT_ERR_GUARD);
  contact_vectors[5] = -2.0F;
  expect_unchanged(held);
  EXPECT(upt_scene_destroy(held), UPT_OK);

  EXPECT(upt_scene_read(NULL, NULL, after, floats), UPT_ERR_NULL);
  EXPECT(upt_scene_read(scene, NULL, NULL, floats), UPT_ERR_NULL);
  EXPECT(upt_scene_read(scene, NULL, NULL, 0), UPT_ERR_ARGUMENT);
  EXPECT(upt_scene_read(scene, NULL, after, 3), UPT_ERR_ARGUMENT);

  /* The output may be the memory of an input. */
  field[0] = 0.0F;
  memset(field, 0, (size_t)floats * sizeof *field);
  EXPECT(upt_scene_step_field(scene, field, NULL, field, floats), UPT_OK);
  memset(after, 0, (size_t)floats * sizeof *after);
  EXPECT(upt_scene_reset(twin), UPT_OK);
  EXPECT(upt_scene_step_field(twin, after, NULL, before, floats), UPT_OK);

  EXPECT(upt_scene_reset(NULL), UPT_ERR_NULL);
  EXPECT(upt_scene_reset(scene), UPT_OK);
  EXPECT(upt_scene_read(scene, NULL, after, floats), UPT_OK);
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

void walk_worker(void) {
  upt_scene *scene = make_scene(), *twin = make_scene(), *held = make_scene_with(UPT_GUARD_HOLD);
  uint32_t far[1], twice[2];
  int i;
  far[0] = (uint32_t)info.node_count;
  twice[0] = twice[1] = contact_nodes[0];
  EXPECT(submit_nodes(NULL, contact_nodes, contact_vectors, 4), UPT_ERR_NULL);
  EXPECT(submit_nodes(scene, NULL, contact_vectors, 4), UPT_ERR_NULL);
  EXPECT(upt_scene_poll(NULL), UPT_ERR_NULL);
  EXPECT(upt_scene_wait(NULL, 0), UPT_ERR_NULL);
  EXPECT(upt_scene_wait(scene, 0), UPT_ERR_STATE);
  EXPECT(submit_nodes(scene, contact_nodes, contact_vectors, 4), UPT_OK);
  EXPECT(upt_scene_wait(scene, 60000), UPT_OK);
  EXPECT(upt_scene_read(scene, NULL, before, floats), UPT_OK);
  EXPECT(step_nodes(twin, contact_nodes, contact_vectors, 4, after, floats), UPT_OK);
  EXPECT_TRUE(memcmp(before, after, (size_t)floats * sizeof *before) == 0);

  /* A step in flight: pending, busy, and reads of published states go on. */
  for (i = 0; i < MANY && !(expect_seen[99] && expect_seen[-UPT_ERR_BUSY]); i++) {
    upt_status status;
    EXPECT(submit_nodes(scene, contact_nodes, contact_vectors, 4), UPT_OK);
    status = upt_scene_step(scene, NULL, NULL, 0);
    if (status == UPT_ERR_BUSY) {
      EXPECT(status, UPT_ERR_BUSY);
    }
    EXPECT(upt_scene_read(scene, NULL, after, floats), UPT_OK);
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

  /* What is wrong with an input is told at once. */
  EXPECT(submit_nodes(scene, far, contact_vectors, 1), UPT_ERR_ARGUMENT);
  EXPECT(submit_nodes(scene, twice, contact_vectors, 2), UPT_ERR_ARGUMENT);

  /* The error of a submitted step is given once. */
  contact_vectors[5] = 1000.0F;
  EXPECT(submit_nodes(held, contact_nodes, contact_vectors, 4), UPT_OK);
  EXPECT(upt_scene_wait(held, 60000), UPT_ERR_GUARD);
  EXPECT(upt_scene_destroy(held), UPT_OK);
  contact_vectors[5] = -2.0F;

  EXPECT(upt_scene_sample(NULL, 0.5, NULL, after, floats), UPT_ERR_NULL);
  EXPECT(upt_scene_sample(scene, 0.5, NULL, NULL, floats), UPT_ERR_NULL);
  EXPECT(upt_scene_sample(scene, NAN, NULL, after, floats), UPT_ERR_NON_FINITE);
  EXPECT(upt_scene_sample(scene, 0.5, NULL, after, 6), UPT_ERR_ARGUMENT);
  EXPECT(upt_scene_sample(scene, 1.0, NULL, after, floats), UPT_OK);
  EXPECT(upt_scene_read(scene, NULL, before, floats), UPT_OK);
  EXPECT_TRUE(memcmp(before, after, (size_t)floats * sizeof *before) == 0);
  EXPECT(upt_scene_destroy(scene), UPT_OK);
  EXPECT(upt_scene_destroy(twin), UPT_OK);
}
