/* What the parts of abi_walk share: the model under test, two fields to compare, a contact. */
#ifndef UPT_TEST_WALK_H
#define UPT_TEST_WALK_H

#include "expect.h"

extern upt_model *model;
extern upt_model_info info;
extern uint64_t floats;       /* 3 K */
extern float *before, *after; /* [K,3] */
extern uint32_t contact_nodes[4];
extern float contact_vectors[12];
extern int log_count;
extern int bare; /* 1: the library was built without feature "instruments" */

upt_scene *make_scene_with(int32_t guard_policy);

/* The fixtures' weights are random: their states are not refused, but flagged. */
upt_scene *make_scene(void);

/* The scene's state is what it was when `before` was read. */
void expect_unchanged(upt_scene *scene);

/* Steps, and submitted steps, with an input of nodes or of instruments alone. */
upt_status step_nodes(upt_scene *scene, const uint32_t *nodes, const float *vectors, uint64_t count,
                      float *out, uint64_t out_count);
upt_status submit_nodes(upt_scene *scene, const uint32_t *nodes, const float *vectors,
                        uint64_t count);
upt_status step_tools(upt_scene *scene, const upt_instrument *tools, uint64_t count, float *out,
                      uint64_t out_count);
upt_status submit_tools(upt_scene *scene, const upt_instrument *tools, uint64_t count);

void walk_library(void);
void walk_model_open(const char *bundle, const char *damaged);
void walk_model(void);

void walk_scene_create(const char *reduced_bundle);
void walk_step(void);
void walk_worker(void);

void walk_region_and_points(void);
void walk_instrument(void);
void walk_instruments(const char *reduced_bundle);
void walk_state(void);

void walk_handles(void);
void walk_threads(void);
/* 0 where the library has no feature "fault". */
int walk_panic(void);

#endif
