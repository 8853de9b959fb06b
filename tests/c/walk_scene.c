/* What a scene offers beside the step: regions, points, instruments, forces, statistics, snapshots.
 */
#include <math.h>
#include <stdlib.h>

#include "walk.h"

void walk_region_and_points(void) {
  upt_scene *scene = make_scene();
  const uint32_t far = (uint32_t)info.node_count;
  float few[12], points[6] = {0};
  upt_view attached = {sizeof attached, UPT_VIEW_POINTS, NULL, 0};
  upt_view nodes = {sizeof nodes, UPT_VIEW_NODES, NULL, 4};
  float *positions = calloc((size_t)floats, sizeof *positions);
  upt_status status;
  int i;
  EXPECT(step_nodes(scene, contact_nodes, contact_vectors, 4, before, floats), UPT_OK);

  EXPECT(upt_scene_decode(NULL, &nodes, few, 12), UPT_ERR_NULL);
  EXPECT(upt_scene_decode(scene, &nodes, few, 12), UPT_ERR_NULL);
  nodes.nodes = contact_nodes;
  EXPECT(upt_scene_decode(scene, &nodes, NULL, 12), UPT_ERR_NULL);
  EXPECT(upt_scene_decode(scene, &nodes, few, 9), UPT_ERR_ARGUMENT);
  EXPECT(upt_scene_read(scene, &nodes, few, 12), UPT_ERR_UNSUPPORTED);
  EXPECT_TRUE(strstr(upt_last_error(), "view.kind") != NULL);
  EXPECT(upt_scene_sample(scene, 0.5, &nodes, few, 12), UPT_ERR_UNSUPPORTED);
  attached.node_count = 1;
  EXPECT(upt_scene_decode(scene, &attached, few, 12), UPT_ERR_ARGUMENT);
  EXPECT_TRUE(strstr(upt_last_error(), "view.node_count") != NULL);
  attached.node_count = 0;
  nodes.nodes = &far;
  nodes.node_count = 1;
  EXPECT(upt_scene_decode(scene, &nodes, few, 3), UPT_ERR_ARGUMENT);
  nodes.node_count = UINT64_MAX;
  EXPECT(upt_scene_decode(scene, &nodes, few, 3), UPT_ERR_ARGUMENT);
  nodes.nodes = NULL;
  nodes.node_count = 0;
  EXPECT(upt_scene_decode(scene, &nodes, positions, floats), UPT_OK);
  EXPECT_TRUE(memcmp(positions, before, (size_t)floats * sizeof *before) == 0);
  EXPECT(upt_scene_decode(scene, NULL, positions, floats), UPT_OK);
  EXPECT_TRUE(memcmp(positions, before, (size_t)floats * sizeof *before) == 0);
  nodes.nodes = contact_nodes;
  nodes.node_count = 4;
  EXPECT(upt_scene_decode(scene, &nodes, few, 12), UPT_OK);
  for (i = 0; i < 12; i++) {
    EXPECT_TRUE(few[i] == before[3 * contact_nodes[i / 3] + (uint32_t)(i % 3)]);
  }

  EXPECT(upt_scene_set_region(NULL, contact_nodes, 4), UPT_ERR_NULL);
  EXPECT(upt_scene_set_region(scene, NULL, 4), UPT_ERR_NULL);
  EXPECT(upt_scene_set_region(scene, &far, 1), UPT_ERR_ARGUMENT);
  EXPECT(upt_scene_set_region(scene, contact_nodes, 4), UPT_OK);
  EXPECT(step_nodes(scene, contact_nodes, contact_vectors, 4, before, floats), UPT_ERR_ARGUMENT);
  EXPECT(step_nodes(scene, contact_nodes, contact_vectors, 4, few, 12), UPT_OK);
  /* The view that asks for all is not held to the region. */
  nodes.nodes = NULL;
  nodes.node_count = 0;
  EXPECT(upt_scene_decode(scene, &nodes, before, floats), UPT_OK);
  EXPECT_TRUE(before[3 * contact_nodes[1]] == few[3]);
  EXPECT(upt_scene_set_region(scene, NULL, 0), UPT_OK);

  EXPECT(upt_model_read_positions(model, positions, floats), UPT_OK);
  memcpy(points, positions + 3 * contact_nodes[0], 3 * sizeof *points);
  memcpy(points + 3, positions + 3 * contact_nodes[1], 3 * sizeof *points);
  EXPECT(upt_scene_read(scene, &attached, points, 6), UPT_ERR_STATE);
  EXPECT(upt_scene_sample(scene, 0.5, &attached, points, 6), UPT_ERR_STATE);
  EXPECT(upt_scene_attach_points(NULL, points, 2), UPT_ERR_NULL);
  EXPECT(upt_scene_attach_points(scene, NULL, 2), UPT_ERR_NULL);
  points[1] = NAN;
  EXPECT(upt_scene_attach_points(scene, points, 2), UPT_ERR_NON_FINITE);
  points[1] = positions[3 * contact_nodes[0] + 1];
  EXPECT(upt_scene_attach_points(scene, points, 2), UPT_OK);
  EXPECT(step_nodes(scene, contact_nodes, contact_vectors, 4, before, floats), UPT_OK);
  EXPECT(upt_scene_read(NULL, &attached, few, 6), UPT_ERR_NULL);
  EXPECT(upt_scene_read(scene, &attached, NULL, 6), UPT_ERR_NULL);
  EXPECT(upt_scene_read(scene, &attached, few, 3), UPT_ERR_ARGUMENT);
  EXPECT(upt_scene_read(scene, &attached, few, 6), UPT_OK);
  EXPECT_TRUE(isfinite(few[0]) && isfinite(few[5]));
  EXPECT(upt_scene_sample(NULL, 1.0, &attached, few, 6), UPT_ERR_NULL);
  EXPECT(upt_scene_sample(scene, INFINITY, &attached, few, 6), UPT_ERR_NON_FINITE);
  EXPECT(upt_scene_sample(scene, 1.0, &attached, few, 3), UPT_ERR_ARGUMENT);
  EXPECT(upt_scene_sample(scene, 1.0, &attached, few, 6), UPT_OK);
  status = upt_scene_attach_points(scene, NULL, 0);
  EXPECT(status, UPT_OK);
  EXPECT(upt_scene_destroy(scene), UPT_OK);
  free(positions);
}

void walk_instrument(void) {
  upt_scene *scene = make_scene();
  upt_instrument instrument;
  uint32_t *nodes = calloc((size_t)info.node_count, sizeof *nodes);
  float *vectors = calloc((size_t)floats, sizeof *vectors), few[12];
  uint64_t count = 0;
  upt_status status;
  memset(&instrument, 0, sizeof instrument);
  EXPECT(upt_model_read_positions(model, before, floats), UPT_OK);

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
  if (bare) {
    EXPECT(status, UPT_ERR_UNSUPPORTED);
  } else {
    EXPECT(status, UPT_OK);
    EXPECT_TRUE(count > 0);
    instrument.position[0] = NAN;
    EXPECT(upt_scene_contacts_from_instruments(scene, &instrument, 1, nodes, vectors,
                                               info.node_count, &count),
           UPT_ERR_NON_FINITE);
  }

  EXPECT(upt_scene_read_contact_force(NULL, few, 12), UPT_ERR_NULL);
  EXPECT(upt_scene_read_contact_force(scene, NULL, 12), UPT_ERR_NULL);
  EXPECT(upt_scene_read_contact_force(scene, NULL, 0), bare ? UPT_ERR_UNSUPPORTED : UPT_OK);
  EXPECT(step_nodes(scene, contact_nodes, contact_vectors, 4, NULL, 0), UPT_OK);
  status = upt_scene_read_contact_force(scene, few, 12);
  if (bare) {
    EXPECT(status, UPT_ERR_UNSUPPORTED);
  } else {
    EXPECT(status, UPT_OK);
    EXPECT_TRUE(isfinite(few[0]) && isfinite(few[11]));
    EXPECT(upt_scene_read_contact_force(scene, few, 9), UPT_ERR_ARGUMENT);
  }
  EXPECT(upt_scene_destroy(scene), UPT_OK);
  free(nodes);
  free(vectors);
}

void walk_state(void) {
  upt_scene *scene = make_scene();
  upt_scene_stats stats;
  uint64_t needed = 0;
  upt_scene_timing timing;
  uint8_t *bytes;
  int i;
  memset(&stats, 0, sizeof stats);
  for (i = 0; i < 3; i++) {
    EXPECT(step_nodes(scene, contact_nodes, contact_vectors, 4, NULL, 0), UPT_OK);
  }
  EXPECT(upt_scene_read_stats(NULL, &stats), UPT_ERR_NULL);
  EXPECT(upt_scene_read_stats(scene, NULL), UPT_ERR_NULL);
  EXPECT(upt_scene_read_stats(scene, &stats), UPT_ERR_STRUCT_SIZE);
  stats.struct_size = sizeof stats;
  EXPECT(upt_scene_read_stats(scene, &stats), UPT_OK);
  EXPECT_TRUE(stats.step_count == 3 && stats.contact_count == 4);
  EXPECT_TRUE(stats.max_displacement_mm > 1.0F);
  memset(&timing, 0, sizeof timing);
  EXPECT(upt_scene_read_timing(scene, NULL), UPT_ERR_NULL);
  EXPECT(upt_scene_read_timing(scene, &timing), UPT_ERR_STRUCT_SIZE);
  timing.struct_size = sizeof timing;
  EXPECT(upt_scene_read_timing(scene, &timing), UPT_OK);
  EXPECT_TRUE(timing.step_count == 3 && timing.step_ms > 0.0);
  EXPECT_TRUE(stats.poisoned == 0 && stats.sleeping == 0);
  EXPECT_TRUE(stats.prior_forces == (info.kind == UPT_KIND_REDUCED));

  EXPECT(upt_scene_save(NULL, NULL, 0, &needed), UPT_ERR_NULL);
  EXPECT(upt_scene_save(scene, NULL, 0, NULL), UPT_ERR_NULL);
  EXPECT(upt_scene_save(scene, NULL, 0, &needed), UPT_OK);
  bytes = malloc((size_t)needed);
  EXPECT(upt_scene_save(scene, bytes, needed - 1, NULL), UPT_ERR_ARGUMENT);
  EXPECT(upt_scene_save(scene, bytes, needed, NULL), UPT_OK);
  EXPECT(upt_scene_read(scene, NULL, before, floats), UPT_OK);
  EXPECT(upt_scene_step(scene, NULL, NULL, 0), UPT_OK);
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
