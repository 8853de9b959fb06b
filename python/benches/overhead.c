/* The loop of overhead.py without Python, on a scene that Python made: the seconds of each call. */
#include <time.h>

#include <upt.h>

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Steps by the instrument, or by nodes where there is none; the status that was not success, or 0.
 */
upt_status steps(upt_scene *scene, const upt_instrument *tool, const uint32_t *nodes,
                 const float *vectors, uint64_t count, float *out, uint64_t length, long calls,
                 double *seconds) {
  upt_input input = {sizeof input};
  if (tool) {
    input.instruments = tool;
    input.instrument_count = 1;
  } else {
    input.contact_nodes = nodes;
    input.contact_vectors = vectors;
    input.contact_count = count;
  }
  for (long i = 0; i < calls; i++) {
    double begin = now();
    upt_status status = upt_scene_step(scene, &input, out, length);
    if (status < 0) {
      return status;
    }
    seconds[i] = now() - begin;
  }
  return UPT_OK;
}
