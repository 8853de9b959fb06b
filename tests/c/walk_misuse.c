/* Handles that are closed or of another kind, two threads on one scene, a panic inside the library.
 */
#define _GNU_SOURCE
#ifdef _WIN32
#include <windows.h>
#else
#include <dlfcn.h>
#endif
#include <pthread.h>

#include "walk.h"

/* A function of the library that its header does not declare; NULL where it has none. */
static void *library_function(const char *name) {
#ifdef _WIN32
  void *found;
  FARPROC address = GetProcAddress(GetModuleHandleA("upt.dll"), name);
  memcpy(&found, &address, sizeof found);
  return found;
#else
  return dlsym(RTLD_DEFAULT, name);
#endif
}

/* Verifies REQ-013. */
void walk_handles(void) {
  upt_scene *scene = make_scene();
  upt_scene_stats stats;
  memset(&stats, 0, sizeof stats);
  stats.struct_size = sizeof stats;
  EXPECT(upt_scene_reset((upt_scene *)(void *)model), UPT_ERR_HANDLE);
  EXPECT_TRUE(strstr(upt_last_error(), "it is a model") != NULL);
  EXPECT(upt_model_read_info((upt_model *)(void *)scene, &info), UPT_ERR_HANDLE);
  EXPECT(upt_scene_reset((upt_scene *)(void *)&stats), UPT_ERR_HANDLE);
  EXPECT(upt_scene_destroy(scene), UPT_OK);
  EXPECT(upt_scene_destroy(scene), UPT_ERR_HANDLE);
  EXPECT_TRUE(strstr(upt_last_error(), "it was closed") != NULL);
  EXPECT(upt_scene_destroy(NULL), UPT_ERR_NULL);
  EXPECT(upt_scene_step(scene, NULL, NULL, 0), UPT_ERR_HANDLE);
  EXPECT(upt_scene_read_stats(scene, &stats), UPT_ERR_HANDLE);
}

static void *step_often(void *scene) {
  int i;
  for (i = 0; i < 200; i++) {
    upt_scene_step(scene, NULL, NULL, 0);
  }
  return NULL;
}

/* Two threads on one scene: each call either works or is refused as busy. */
void walk_threads(void) {
  upt_scene *scene = make_scene();
  pthread_t thread;
  int i, other = 0;
  EXPECT_TRUE(pthread_create(&thread, NULL, step_often, scene) == 0);
  for (i = 0; i < 200; i++) {
    const upt_status status = upt_scene_step(scene, NULL, NULL, 0);
    other += status != UPT_OK && status != UPT_ERR_BUSY;
  }
  pthread_join(thread, NULL);
  EXPECT_TRUE(other == 0);
  EXPECT(upt_scene_destroy(scene), UPT_OK);
}

/* Verifies REQ-012. */
int walk_panic(void) {
  upt_scene *scene, *sane;
  upt_scene_stats stats;
  upt_status (*test_panic)(upt_scene *);
  *(void **)&test_panic = library_function("upt_test_panic");
  if (test_panic == NULL) {
    printf("left out: UPT_ERR_PANIC (the library has no feature \"fault\")\n");
    return 0;
  }
  scene = make_scene();
  sane = make_scene();
  memset(&stats, 0, sizeof stats);
  stats.struct_size = sizeof stats;
  EXPECT(test_panic(scene), UPT_ERR_PANIC);
  EXPECT(upt_scene_step(scene, NULL, NULL, 0), UPT_ERR_PANIC);
  EXPECT(upt_scene_reset(scene), UPT_ERR_PANIC);
  EXPECT(upt_scene_read_stats(scene, &stats), UPT_OK);
  EXPECT_TRUE(stats.poisoned == 1);
  EXPECT(upt_scene_step(sane, NULL, NULL, 0), UPT_OK);
  EXPECT(upt_scene_destroy(scene), UPT_OK);
  EXPECT(upt_scene_destroy(sane), UPT_OK);
  return 1;
}
