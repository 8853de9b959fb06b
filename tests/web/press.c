/* Presses a ball into a bundle, moves it aside and lifts it: the steps of press.mjs, by the native
 * library.
 *
 *   press BUNDLE STEPS CORRECTIONS FILE
 *
 * Prints the milliseconds of each step. FILE, for each step: [K,3] displacements (mm), the force on
 * the ball (mN), and [K,3] displacements 7 ms later. One ball, 20 ms steps. The model is portable:
 * every machine writes the same file.
 */
#include "upt.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void ok(upt_status status) {
  if (status != UPT_OK) {
    fprintf(stderr, "%s: %s\n", upt_status_name(status), upt_last_error());
    exit(1);
  }
}

int main(int argc, char **argv) {
  upt_model_info info;
  upt_model_options portable;
  upt_scene_options options;
  upt_instrument ball;
  upt_input input;
  upt_instrument_reading reading;
  upt_scene_timing timing;
  upt_model *model = NULL;
  upt_scene *scene = NULL;
  uint32_t *domain;
  float *rest, *out;
  const float *tip;
  long step;
  FILE *file;
  if (argc != 5 || (file = fopen(argv[4], "wb")) == NULL) {
    fprintf(stderr, "usage: %s BUNDLE STEPS CORRECTIONS FILE\n", argv[0]);
    return 2;
  }
  memset(&portable, 0, sizeof portable);
  portable.struct_size = sizeof portable;
  portable.portable = 1;
  ok(upt_model_create(argv[1], &portable, &model));
  memset(&info, 0, sizeof info);
  info.struct_size = sizeof info;
  ok(upt_model_read_info(model, &info));
  memset(&options, 0, sizeof options);
  options.struct_size = sizeof options;
  options.corrections.count = (uint32_t)atoi(argv[3]);
  options.corrections.mode =
      options.corrections.count > 0 ? UPT_CORRECTIONS_COUNT : UPT_CORRECTIONS_RECOMMENDED;
  options.step_s = 0.02;
  ok(upt_scene_create(model, &options, &scene));
  rest = malloc(3 * info.node_count * sizeof *rest);
  out = malloc(3 * info.node_count * sizeof *out);
  domain = malloc(info.domain_node_count * sizeof *domain);
  ok(upt_model_read_positions(model, rest, 3 * info.node_count));
  ok(upt_model_read_indices(model, UPT_SET_DOMAIN_NODES, domain, info.domain_node_count, NULL));
  tip = rest + 3 * domain[0];
  memset(&ball, 0, sizeof ball);
  ball.struct_size = sizeof ball;
  ball.rotation[3] = 1.0f;
  ball.radius = 6.0f;
  ball.friction = 0.25f;
  memset(&input, 0, sizeof input);
  input.struct_size = sizeof input;
  input.instruments = &ball;
  input.instrument_count = 1;
  memset(&reading, 0, sizeof reading);
  reading.struct_size = sizeof reading;
  memset(&timing, 0, sizeof timing);
  timing.struct_size = sizeof timing;
  for (step = 0; step < atol(argv[2]); step++) {
    /* 8 mm down, 4 mm aside, and up: half a millimetre a step. */
    const double down = step < 16 ? step : step < 24 ? 16 : 40 - step;
    const double aside = step < 16 ? 0 : step < 24 ? step - 16 : 8;
    ball.position[0] = (float)((double)tip[0] + 0.5 * aside);
    ball.position[1] = tip[1];
    ball.position[2] = (float)((double)tip[2] + 6.0 - 0.5 * down);
    ok(upt_scene_step(scene, &input, out, 3 * info.node_count));
    fwrite(out, sizeof *out, 3 * info.node_count, file);
    ok(upt_scene_read_timing(scene, &timing));
    printf("%.4f\n", timing.step_ms);
    ok(upt_scene_read_instruments(scene, &reading, 1));
    fwrite(reading.force, sizeof *out, 3, file);
    ok(upt_scene_present(scene, &input, 0.007, NULL, out, 3 * info.node_count));
    fwrite(out, sizeof *out, 3 * info.node_count, file);
  }
  ok(upt_scene_destroy(scene));
  ok(upt_model_destroy(model));
  return fclose(file) == 0 ? 0 : 1;
}
