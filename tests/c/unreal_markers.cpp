// examples/unreal, compiled as Unreal compiles it (no exceptions) against stand-ins of its macros:
// scopes open and close around calls, counters have what the scene says.
//
//   unreal_markers BUNDLE
#include "UptProfiling.h"
#include "expect.h"

#include "ProfilingDebugging/CountersTrace.h"
#include "ProfilingDebugging/CpuProfilerTrace.h"

int main(int argc, char **argv) {
  if (argc != 2) {
    return 2;
  }
  upt::Model model;
  upt::Scene scene;
  upt_model_info info;
  EXPECT(model.reopen(argv[1]), UPT_OK);
  EXPECT(model.info(info), UPT_OK);
  EXPECT(scene.create(model), UPT_OK);

  // A ball on the first node of the domain, 1 mm deep.
  std::vector<float> rest(3 * info.node_count);
  std::vector<std::uint32_t> domain;
  EXPECT(model.positions(rest), UPT_OK);
  EXPECT(model.indices(UPT_SET_DOMAIN_NODES, domain), UPT_OK);
  upt_instrument ball = upt::sphere(3);
  std::copy_n(&rest[3 * domain[0]], 3, ball.position);
  ball.position[2] += 2;
  EXPECT(UptProfiling::Step(scene, upt::Input(&ball, 1)), UPT_OK);
  EXPECT_TRUE((Scopes() == std::vector<std::string>{"+libupt_Step", "-libupt_Step"}));

  upt_scene_timing timing;
  upt_scene_stats stats;
  EXPECT(scene.timing(timing), UPT_OK);
  EXPECT(scene.stats(stats), UPT_OK);
  std::map<std::string, double> &shown = Counters();
  EXPECT_TRUE(stats.corrections > 0 && shown["libupt/Corrections"] == stats.corrections);
  EXPECT_TRUE(timing.step_ms > 0 && shown["libupt/Step ms"] == timing.step_ms);
  EXPECT_TRUE(shown["libupt/Contact ms"] == timing.contact_ms);
  EXPECT_TRUE(shown["libupt/Corrections ms"] == timing.corrections_ms);
  EXPECT_TRUE(shown["libupt/Error mm"] == stats.error_mm);

  // Frames: no counters before a step has landed, and then those of the step.
  upt::FrameClock clock(info.dt);
  std::vector<float> moved(3 * info.node_count);
  Scopes().clear();
  shown.clear();
  EXPECT(UptProfiling::Frame(clock, scene, 0, {&ball, 1}, moved), UPT_OK);
  EXPECT_TRUE(shown.empty());
  EXPECT_TRUE((Scopes() == std::vector<std::string>{"+libupt_Frame", "-libupt_Frame"}));
  EXPECT(scene.wait(0xFFFFFFFFU), UPT_OK);
  EXPECT(UptProfiling::Frame(clock, scene, info.dt / 2, {&ball, 1}, moved), UPT_OK);
  EXPECT_TRUE(clock.landed() && shown.size() == 5);
  return expect_result("unreal_markers");
}
