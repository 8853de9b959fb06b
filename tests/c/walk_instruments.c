/* Steps that instruments drive, on a bundle with a linear response: shapes, hulls, readings,
 * misuse. */
#include <math.h>
#include <stdlib.h>

#include "walk.h"

static const float corners[24] = {-3, -3, -3, 3, -3, -3, -3, 3, -3, 3, 3, -3,
                                  -3, -3, 3,  3, -3, 3,  -3, 3, 3,  3, 3, 3};

static const uint32_t faces[36] = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                                   2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};

static void walk_hull(upt_hull **hull) {
  float flat[12];
  upt_hull *other = NULL;
  memset(flat, 0, sizeof flat);
  EXPECT(upt_hull_create(corners, 8, NULL, 0, NULL), UPT_ERR_NULL);
  if (bare) {
    EXPECT(upt_hull_create(corners, 8, NULL, 0, hull), UPT_ERR_UNSUPPORTED);
    EXPECT_TRUE(*hull == NULL);
    return;
  }
  EXPECT(upt_hull_create(NULL, 8, NULL, 0, hull), UPT_ERR_NULL);
  EXPECT(upt_hull_create(corners, 3, NULL, 0, hull), UPT_ERR_ARGUMENT);
  EXPECT(upt_hull_create(corners, UINT64_MAX, NULL, 0, hull), UPT_ERR_ARGUMENT);
  EXPECT(upt_hull_create(flat, 4, NULL, 0, hull), UPT_ERR_ARGUMENT);
  /* A surface is closed, and its faces name its points. */
  EXPECT(upt_hull_create(corners, 8, NULL, 12, hull), UPT_ERR_NULL);
  EXPECT(upt_hull_create(corners, 8, faces, 11, hull), UPT_ERR_ARGUMENT);
  EXPECT(upt_hull_create(corners, 7, faces, 12, hull), UPT_ERR_ARGUMENT);
  EXPECT(upt_hull_create(corners, 8, faces, UINT64_MAX, hull), UPT_ERR_ARGUMENT);
  EXPECT_TRUE(*hull == NULL);
  EXPECT(upt_hull_create(corners, 8, NULL, 0, hull), UPT_OK);
  EXPECT(upt_hull_create(corners, 8, faces, 12, &other), UPT_OK);
  EXPECT(upt_hull_destroy(other), UPT_OK);
  EXPECT(upt_hull_destroy(other), UPT_ERR_HANDLE);
  EXPECT(upt_hull_destroy(NULL), UPT_ERR_NULL);
  EXPECT(upt_hull_destroy((upt_hull *)(void *)model), UPT_ERR_HANDLE);
}

/* An instrument at a node of the domain's. */
static upt_instrument at_node(const float *rest, uint32_t node, int32_t shape,
                              const upt_hull *hull) {
  upt_instrument one;
  memset(&one, 0, sizeof one);
  one.struct_size = sizeof one;
  one.shape = shape;
  memcpy(one.position, rest + 3 * node, sizeof one.position);
  one.rotation[3] = 1.0F;
  one.half_extents[0] = one.half_extents[1] = one.half_extents[2] = 2.0F;
  one.radius = 1.5F;
  one.friction = 0.2F;
  one.hull = hull;
  return one;
}

/* Each is refused and changes nothing. */
static void walk_refusals(upt_scene *scene, upt_instrument good, const upt_hull *hull) {
  upt_instrument many[65], two[2];
  int i;
  for (i = 0; i < 65; i++) {
    many[i] = good;
  }
  EXPECT(step_tools(NULL, &good, 1, NULL, 0), UPT_ERR_NULL);
  EXPECT(step_tools(scene, NULL, 1, NULL, 0), UPT_ERR_NULL);
  EXPECT(step_tools(scene, &good, 1, NULL, floats), UPT_ERR_NULL);
  EXPECT(step_tools(scene, &good, 1, after, 3), UPT_ERR_ARGUMENT);
  EXPECT(step_tools(scene, many, 65, NULL, 0), UPT_ERR_ARGUMENT);
  EXPECT(submit_tools(scene, many, UINT64_MAX), UPT_ERR_ARGUMENT);
  EXPECT(submit_tools(NULL, &good, 1), UPT_ERR_NULL);
  for (i = 0; i < 10; i++) {
    upt_status wanted = UPT_ERR_ARGUMENT;
    two[0] = two[1] = good;
    switch (i) {
    case 0:
      two[0].struct_size = 3;
      wanted = UPT_ERR_STRUCT_SIZE;
      break;
    case 1:
      two[1].position[1] = NAN;
      wanted = UPT_ERR_NON_FINITE;
      break;
    case 2:
      two[1].rotation[0] = 0.7F; /* no longer of length 1 */
      break;
    case 3:
      two[1].friction = -0.1F;
      break;
    case 4:
      two[1].tear_off_mn = INFINITY;
      break;
    case 5:
      two[1].mode = 2;
      break;
    case 6:
      two[1].reserved[0] = 1;
      break;
    case 7:
      two[1].shape = 7;
      break;
    case 8:
      two[1].hull = hull; /* without the shape */
      break;
    default:
      two[1].shape = UPT_SHAPE_HULL;
      two[1].hull = (const upt_hull *)(const void *)scene; /* another kind of handle */
      wanted = UPT_ERR_HANDLE;
    }
    EXPECT(step_tools(scene, two, 2, NULL, 0), wanted);
    EXPECT(submit_tools(scene, two, 2), wanted);
  }
  expect_unchanged(scene);
}

/* Points of a reading's instrument: their forces sum to the reading's. */
static void expect_sum(const upt_instrument_contact *contacts, uint64_t count, uint32_t instrument,
                       const upt_instrument_reading *reading) {
  double sum[3] = {0, 0, 0}, size = 0;
  uint64_t i, mine = 0;
  int axis;
  for (i = 0; i < count; i++) {
    if (contacts[i].instrument == instrument) {
      mine++;
      for (axis = 0; axis < 3; axis++) {
        sum[axis] += (double)contacts[i].force[axis];
      }
    }
  }
  EXPECT_TRUE(mine == reading->contact_count);
  for (axis = 0; axis < 3; axis++) {
    size += fabs((double)reading->force[axis]);
  }
  for (axis = 0; axis < 3; axis++) {
    EXPECT_TRUE(fabs(sum[axis] - (double)reading->force[axis]) <= 1e-3 * size + 1e-3);
  }
}

static void walk_driven(upt_scene *scene, const float *rest, uint32_t node, upt_hull *hull) {
  static const int32_t shapes[4] = {UPT_SHAPE_CAPSULE, UPT_SHAPE_BOX, UPT_SHAPE_SPATULA,
                                    UPT_SHAPE_HULL};
  float *round_tip;
  upt_instrument_reading readings[2];
  upt_instrument_contact *contacts;
  upt_instrument two[2];
  upt_scene_stats stats;
  uint64_t needed = 0;
  int i, step;
  memset(&stats, 0, sizeof stats);
  stats.struct_size = sizeof stats;
  EXPECT(upt_scene_read(scene, NULL, before, floats), UPT_OK);
  walk_refusals(scene, at_node(rest, node, UPT_SHAPE_BOX, NULL), hull);
  for (i = 0; i < 4; i++) {
    EXPECT(upt_scene_reset(scene), UPT_OK);
    two[0] = at_node(rest, node, shapes[i], i == 3 ? hull : NULL);
    two[1] = two[0];
    two[1].position[0] += 500.0F; /* in the air */
    memset(readings, 0, sizeof readings);
    for (step = 0; step < 4; step++) {
      two[0].mode = step == 3 ? UPT_MODE_GRASP : UPT_MODE_SLIDE;
      EXPECT(step_tools(scene, two, 2, after, floats), UPT_OK);
      if (step == 0) { /* the fixture's weights are random: later states are anywhere */
        EXPECT(upt_scene_read_instruments(scene, readings, 2), UPT_ERR_STRUCT_SIZE);
        readings[0].struct_size = readings[1].struct_size = sizeof *readings;
        EXPECT(upt_scene_read_instruments(scene, readings, 2), UPT_OK);
        EXPECT_TRUE(readings[0].contact_count > 0);
      }
    }
    EXPECT(upt_scene_read_instruments(scene, readings, 1), UPT_ERR_ARGUMENT);
    EXPECT(upt_scene_read_instruments(scene, NULL, 2), UPT_ERR_NULL);
    EXPECT(upt_scene_read_instruments(NULL, readings, 2), UPT_ERR_NULL);
    EXPECT(upt_scene_read_instruments(scene, readings, 2), UPT_OK);
    EXPECT_TRUE(readings[1].contact_count == 0);
    EXPECT_TRUE(readings[1].force[2] == 0.0F && readings[1].penetration_mm == 0.0F);
    EXPECT_TRUE(isfinite(readings[0].torque[0]) && readings[0].penetration_mm >= 0.0F);

    EXPECT(upt_scene_read_instrument_contacts(scene, NULL, 0, &needed), UPT_OK);
    EXPECT_TRUE(needed == readings[0].contact_count);
    contacts = calloc((size_t)needed + 1, sizeof *contacts);
    EXPECT(upt_scene_read_instrument_contacts(NULL, contacts, needed, &needed), UPT_ERR_NULL);
    if (needed > 1) {
      EXPECT(upt_scene_read_instrument_contacts(scene, NULL, needed, NULL), UPT_ERR_NULL);
      EXPECT(upt_scene_read_instrument_contacts(scene, contacts, needed - 1, NULL),
             UPT_ERR_ARGUMENT);
    }
    EXPECT(upt_scene_read_instrument_contacts(scene, contacts, needed, &needed), UPT_OK);
    expect_sum(contacts, needed, 0, &readings[0]);
    free(contacts);
    EXPECT(upt_scene_read_stats(scene, &stats), UPT_OK);
    EXPECT_TRUE(stats.step_count == 4);
  }

  /* A ball that was never turned is a capsule without length. */
  round_tip = calloc(floats, sizeof *round_tip);
  for (i = 0; i < 2; i++) {
    upt_instrument ball = at_node(rest, node, i ? UPT_SHAPE_SPHERE : UPT_SHAPE_CAPSULE, NULL);
    memset(ball.half_extents, 0, sizeof ball.half_extents);
    ball.rotation[3] = i ? 0.0F : 1.0F;
    EXPECT(upt_scene_reset(scene), UPT_OK);
    EXPECT(step_tools(scene, &ball, 1, i ? after : round_tip, floats), UPT_OK);
  }
  EXPECT_TRUE(memcmp(after, round_tip, floats * sizeof *after) == 0);
  free(round_tip);
  EXPECT(step_tools(scene, two, 2, NULL, 0), UPT_OK);

  /* On the worker; a hull may end while its step runs. */
  EXPECT(submit_tools(scene, two, 2), UPT_OK);
  EXPECT(upt_hull_destroy(hull), UPT_OK);
  EXPECT(upt_scene_wait(scene, 60000), UPT_OK);
  EXPECT(upt_scene_read_instruments(scene, readings, 2), UPT_OK);
  EXPECT(step_tools(scene, two, 2, NULL, 0), UPT_ERR_HANDLE);

  /* A free step: nothing is read of instruments that are no longer passed. */
  EXPECT(upt_scene_step(scene, NULL, NULL, 0), UPT_OK);
  EXPECT(upt_scene_read_instruments(scene, NULL, 0), UPT_OK);
  EXPECT(upt_scene_read_instrument_contacts(scene, NULL, 0, &needed), UPT_OK);
  EXPECT_TRUE(needed == 0);
}

void walk_instruments(const char *reduced_bundle) {
  upt_hull *hull = NULL;
  upt_model *reduced = NULL, *whole = model;
  upt_model_info whole_info = info;
  upt_scene *scene = make_scene();
  upt_instrument one;
  float *rest;
  uint32_t *domain;
  uint64_t needed = 0;
  walk_hull(&hull);
  memset(&one, 0, sizeof one);
  one.struct_size = sizeof one;
  one.shape = UPT_SHAPE_BOX;
  one.rotation[3] = one.half_extents[0] = one.half_extents[1] = one.half_extents[2] = 1.0F;
  if (bare) {
    upt_instrument_reading reading;
    memset(&reading, 0, sizeof reading);
    reading.struct_size = sizeof reading;
    EXPECT(step_tools(scene, &one, 1, NULL, 0), UPT_ERR_UNSUPPORTED);
    EXPECT(submit_tools(scene, &one, 1), UPT_ERR_UNSUPPORTED);
    EXPECT(upt_scene_read_instruments(scene, &reading, 1), UPT_ERR_UNSUPPORTED);
    EXPECT(upt_scene_read_instrument_contacts(scene, NULL, 0, &needed), UPT_ERR_UNSUPPORTED);
    EXPECT(upt_hull_destroy(hull), UPT_ERR_UNSUPPORTED);
    EXPECT(upt_scene_destroy(scene), UPT_OK);
    return;
  }
  if (info.kind != UPT_KIND_REDUCED) {
    /* The fixture of kind upt has no linear response to solve contact with. */
    EXPECT(step_tools(scene, &one, 1, NULL, 0), UPT_ERR_UNSUPPORTED);
    EXPECT(upt_scene_step(scene, NULL, NULL, 0), UPT_OK);
  }
  EXPECT(upt_scene_destroy(scene), UPT_OK);

  EXPECT(upt_model_create(reduced_bundle, NULL, &reduced), UPT_OK);
  model = reduced;
  memset(&info, 0, sizeof info);
  info.struct_size = sizeof info;
  EXPECT(upt_model_read_info(model, &info), UPT_OK);
  floats = 3 * info.node_count;
  before = realloc(before, (size_t)floats * sizeof *before);
  after = realloc(after, (size_t)floats * sizeof *after);
  rest = calloc((size_t)floats, sizeof *rest);
  domain = calloc((size_t)info.domain_node_count, sizeof *domain);
  EXPECT(upt_model_read_positions(model, rest, floats), UPT_OK);
  EXPECT(
      upt_model_read_indices(model, UPT_SET_DOMAIN_NODES, domain, info.domain_node_count, &needed),
      UPT_OK);
  scene = make_scene();
  walk_driven(scene, rest, domain[info.domain_node_count / 2], hull);
  EXPECT(upt_scene_destroy(scene), UPT_OK);
  EXPECT(upt_model_destroy(reduced), UPT_OK);

  model = whole;
  info = whole_info;
  floats = 3 * info.node_count;
  before = realloc(before, (size_t)floats * sizeof *before);
  after = realloc(after, (size_t)floats * sizeof *after);
  free(rest);
  free(domain);
}
