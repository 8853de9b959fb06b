/* Library and model: versions, options, providers, bundles that are wrong, what a model tells. */
#include <math.h>
#include <stdlib.h>

#include "walk.h"

static void on_log(upt_log_level level, const char *message, void *user) {
  (void)level;
  (void)message;
  ++*(int *)user;
}

void walk_library(void) {
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

void walk_model_open(const char *bundle, const char *damaged) {
  char path[4096];
  upt_model_options options;
  const int32_t cuda = UPT_PROVIDER_CUDA, unknown = 44;
  memset(&options, 0, sizeof options);

  EXPECT(upt_model_create(NULL, NULL, &model), UPT_ERR_NULL);
  EXPECT(upt_model_create(bundle, NULL, NULL), UPT_ERR_NULL);
  EXPECT(upt_model_create("", NULL, &model), UPT_ERR_ARGUMENT);
  EXPECT(upt_model_create("no/such/bundle", NULL, &model), UPT_ERR_IO);
  EXPECT(upt_model_create(bundle, &options, &model), UPT_ERR_STRUCT_SIZE);
  options.struct_size = sizeof options;
  options.portable = 2;
  EXPECT(upt_model_create(bundle, &options, &model), UPT_ERR_ARGUMENT);
  options.portable = 0;
  options.fallback = 7;
  EXPECT(upt_model_create(bundle, &options, &model), UPT_ERR_ARGUMENT);
  options.fallback = UPT_SWITCH_OFF;
  options.provider_count = 1;
  EXPECT(upt_model_create(bundle, &options, &model), UPT_ERR_NULL);
  options.providers = &unknown;
  EXPECT(upt_model_create(bundle, &options, &model), UPT_ERR_ARGUMENT);
  options.providers = &cuda;
  EXPECT(upt_model_create(bundle, &options, &model), UPT_ERR_PROVIDER);
  options.provider_count = 0;
  options.providers = NULL;
  options.user_stream = path;
  EXPECT(upt_model_create(bundle, &options, &model), UPT_ERR_ARGUMENT);
  EXPECT_TRUE(strstr(upt_last_error(), "user_stream") != NULL);
  options.user_stream = NULL;
  options.precision = 12;
  EXPECT(upt_model_create(bundle, &options, &model), UPT_ERR_ARGUMENT);
  /* The fixtures have float32 graphs only. */
  options.precision = UPT_PRECISION_INT8;
  EXPECT(upt_model_create(bundle, &options, &model), UPT_ERR_UNSUPPORTED);

  snprintf(path, sizeof path, "%s/version", damaged);
  EXPECT(upt_model_create(path, NULL, &model), UPT_ERR_VERSION);
  snprintf(path, sizeof path, "%s/hash", damaged);
  EXPECT(upt_model_create(path, NULL, &model), UPT_ERR_BUNDLE);
  snprintf(path, sizeof path, "%s/json", damaged);
  EXPECT(upt_model_create(path, NULL, &model), UPT_ERR_BUNDLE);
  EXPECT_TRUE(strstr(upt_last_error(), "bundle.json") != NULL);
  EXPECT_TRUE(model == NULL);

  options.precision = UPT_PRECISION_F32;
  options.providers = &cuda;
  options.provider_count = 1;
  options.fallback = UPT_SWITCH_DEFAULT;
  EXPECT(upt_model_create(bundle, &options, &model), UPT_OK);
  EXPECT(upt_model_destroy(model), UPT_OK);
  EXPECT(upt_model_create(bundle, NULL, &model), UPT_OK);
}

void walk_model(void) {
  char text[8], *all;
  uint64_t needed = 0, set_sizes[6];
  int32_t set;
  uint32_t one = 0, *indices;
  memset(&info, 0, sizeof info);
  EXPECT(upt_model_read_info(NULL, &info), UPT_ERR_NULL);
  EXPECT(upt_model_read_info(model, NULL), UPT_ERR_NULL);
  EXPECT(upt_model_read_info(model, &info), UPT_ERR_STRUCT_SIZE);
  info.struct_size = sizeof info;
  EXPECT(upt_model_read_info(model, &info), UPT_OK);
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

  EXPECT(upt_model_read_positions(NULL, before, floats), UPT_ERR_NULL);
  EXPECT(upt_model_read_positions(model, NULL, floats), UPT_ERR_NULL);
  EXPECT(upt_model_read_positions(model, before, floats - 1), UPT_ERR_ARGUMENT);
  EXPECT(upt_model_read_positions(model, (float *)((char *)before + 1), floats), UPT_ERR_ARGUMENT);
  EXPECT(upt_model_read_positions(model, before, floats), UPT_OK);
  EXPECT_TRUE(isfinite(before[0]));

  EXPECT(upt_model_read_indices(model, 99, NULL, 0, &needed), UPT_ERR_ARGUMENT);
  EXPECT(upt_model_read_indices(NULL, UPT_SET_TETS, NULL, 0, &needed), UPT_ERR_NULL);
  EXPECT(upt_model_read_indices(model, UPT_SET_TETS, NULL, 0, NULL), UPT_ERR_NULL);
  EXPECT(upt_model_read_indices(model, UPT_SET_TETS, &one, 1, NULL), UPT_ERR_ARGUMENT);
  for (set = UPT_SET_SURFACE_NODES; set <= UPT_SET_TETS; set++) {
    uint64_t i;
    EXPECT(upt_model_read_indices(model, set, NULL, 0, &needed), UPT_OK);
    indices = malloc((size_t)needed * sizeof *indices + 1);
    EXPECT(upt_model_read_indices(model, set, indices, needed, NULL), UPT_OK);
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
