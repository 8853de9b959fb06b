// upt.hpp with UPT_NO_EXCEPTIONS, compiled with -fno-exceptions: the status is the answer.
//
//   wrapper_no_exceptions BUNDLE
#define UPT_NO_EXCEPTIONS
#include "expect.h"

#include "upt.hpp"

int main(int argc, char **argv) {
  if (argc != 2) {
    return 2;
  }
  upt::Model model;
  upt::Scene scene;
  upt_model_info info;
  EXPECT(model.reopen("no/such/bundle"), UPT_ERR_IO);
  EXPECT(scene.create(model), UPT_ERR_NULL);
  EXPECT(model.reopen(argv[1]), UPT_OK);
  EXPECT(model.info(info), UPT_OK);
  EXPECT(scene.create(model), UPT_OK);

  std::vector<std::uint32_t> domain;
  EXPECT(model.indices(UPT_SET_DOMAIN_NODES, domain), UPT_OK);
  const float vector[3] = {0, 0, -1};
  std::vector<float> field(3 * info.node_count);
  EXPECT(scene.step(upt::Input::contacts({domain.data(), 1}, vector), field), UPT_OK);
  EXPECT_TRUE(field[3 * domain[0] + 2] == -1.0F);
  EXPECT(scene.step(upt::Input::contacts({domain.data(), 2}, vector), field), UPT_ERR_ARGUMENT);
  EXPECT(scene.read({field.data(), 3}), UPT_ERR_ARGUMENT);
  upt_scene_stats stats;
  EXPECT(scene.stats(stats), UPT_OK);
  EXPECT_TRUE(stats.step_count == 1);
  return expect_result("wrapper_no_exceptions");
}
