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
  for (long i = 0; i < calls; i++) {
    double begin = now();
    upt_status status = tool ? upt_scene_step_instruments(scene, tool, 1, out, length)
                             : upt_scene_step_contacts(scene, nodes, vectors, count, out, length);
    if (status < 0) {
      return status;
    }
    seconds[i] = now() - begin;
  }
  return UPT_OK;
}
