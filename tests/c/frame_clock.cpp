// upt::FrameClock by a virtual clock: which steps it asks for, with which poses, and what it shows.
//
//   frame_clock CORRECTED REDUCED
#include "expect.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "upt.hpp"

static constexpr double DT = 0.05;

static upt_instrument ball(float x, float y, float z) {
  upt_instrument made = upt::make<upt_instrument>();
  made.shape = UPT_SHAPE_CAPSULE;
  made.position[0] = x;
  made.position[1] = y;
  made.position[2] = z;
  made.rotation[3] = 1;
  made.radius = 3;
  return made;
}

// A step for every 50 ms, with the poses of its own moment, at uneven frames.
static void steps_at_their_moments() {
  upt::FrameClock clock(DT);
  double now = 7.0;
  int steps = 0;
  for (int frame = 0; frame < 200; frame++) {
    const upt_instrument tool = ball(static_cast<float>(now), 0, 0);
    clock.moved(now, {&tool, 1});
    if (clock.due(now)) {
      const std::vector<upt_instrument> &poses = clock.start(now);
      EXPECT_TRUE(poses.size() == 1);
      EXPECT_TRUE(std::abs(clock.step_time() - (7.0 + DT * steps)) < 1e-9);
      EXPECT_TRUE(std::abs(poses[0].position[0] - clock.step_time()) < 1e-5);
      EXPECT_TRUE(!clock.due(now) && clock.in_flight());
      steps++;
    } else if (clock.in_flight()) {
      clock.finished();
    }
    EXPECT_TRUE(clock.since(now) >= 0 && clock.since(now) < 2 * DT);
    now += 0.002 + 0.003 * (frame % 5);
  }
  EXPECT_TRUE(std::abs(steps - (now - 7.0) / DT) <= 2);
}

// A host that hangs for a second makes one step where it is, not twenty.
static void a_hang_is_left_out() {
  upt::FrameClock clock(DT);
  const upt_instrument near = ball(0, 0, 0), far = ball(10, 0, 0);
  clock.moved(0.0, {&near, 1});
  clock.start(0.0);
  clock.finished();
  clock.moved(1.0, {&far, 1});
  EXPECT_TRUE(clock.due(1.0));
  EXPECT_TRUE(clock.start(1.0)[0].position[0] == 10);
  EXPECT_TRUE(clock.step_time() == 1.0);
  clock.finished();
  EXPECT_TRUE(!clock.due(1.0) && !clock.due(1.049) && clock.due(1.05));
  EXPECT_TRUE(clock.since(1.02) > 0.0199 && clock.since(1.02) < 0.0201);
}

// Frames of 33 ms and steps of 20: no step is lost, and each has the pose of its own moment.
static void frames_slower_than_steps() {
  const double dt = 0.02;
  upt::FrameClock clock(dt);
  int steps = 0;
  for (int frame = 0; frame < 60; frame++) {
    const double now = frame / 30.0;
    const upt_instrument tool = ball(static_cast<float>(now), 0, 0);
    clock.moved(now, {&tool, 1});
    while (clock.due(now)) {
      const bool behind = clock.behind(now);
      EXPECT_TRUE(std::abs(clock.start(now)[0].position[0] - dt * steps) < 1e-5);
      steps++;
      clock.finished();
      EXPECT_TRUE(clock.landed_instruments() == 1 && clock.due(now) == behind);
    }
    EXPECT_TRUE(clock.since(now) < dt);
  }
  EXPECT_TRUE(steps == 99); // 59 / 30 s and the first
}

// Rotations take the shorter way, and a tool that joins is where it is.
static void poses_between_frames() {
  upt::FrameClock clock(DT);
  upt_instrument tools[2] = {ball(0, 0, 0), ball(5, 5, 5)};
  clock.moved(0.0, {tools, 1});
  clock.start(0.0);
  clock.finished();
  clock.moved(0.04, {tools, 1});
  tools[0].rotation[2] = -1;
  tools[0].rotation[3] = -1e-8F;
  clock.moved(0.06, {tools, 1});
  const float *q = clock.start(0.06)[0].rotation;
  EXPECT_TRUE(std::abs(std::abs(q[2]) - std::sqrt(0.5F)) < 1e-3F &&
              std::abs(std::abs(q[3]) - std::sqrt(0.5F)) < 1e-3F);
  clock.finished();
  clock.moved(0.12, {tools, 2});
  EXPECT_TRUE(clock.start(0.12).size() == 2);
}

// The deepest node inside of the ball, mm.
static float depth(const std::vector<float> &rest, const std::vector<float> &u,
                   const std::vector<std::uint32_t> &nodes, const upt_instrument &tool) {
  float deepest = 0;
  for (const std::uint32_t node : nodes) {
    float square = 0;
    for (std::size_t k = 0; k < 3; k++) {
      const float apart = rest[3 * node + k] + u[3 * node + k] - tool.position[k];
      square += apart * apart;
    }
    deepest = std::max(deepest, tool.radius - std::sqrt(square));
  }
  return deepest;
}

// A ball that goes 2 mm deep and back at 20 mm/s, drawn at uneven frames with steps on the worker.
// How deep nodes lie in it at worst, mm.
static float deepest_frame(const char *bundle, double step_s) {
  const upt::Model model = upt::Model::open(bundle);
  auto options = upt::make<upt_scene_options>();
  options.step_s = step_s;
  upt::Scene scene(model, &options);
  upt::FrameClock clock(step_s > 0 ? step_s : static_cast<double>(model.info().dt));
  const std::vector<float> rest = model.positions();
  const std::vector<std::uint32_t> domain = model.indices(UPT_SET_DOMAIN_NODES);
  std::uint32_t middle = domain[0];
  float centre[2] = {0, 0};
  for (const std::uint32_t node : domain) {
    for (std::size_t k = 0; k < 2; k++) {
      centre[k] += rest[3 * node + k] / static_cast<float>(domain.size());
    }
  }
  const auto off = [&](std::uint32_t node) {
    return std::hypot(rest[3 * node] - centre[0], rest[3 * node + 1] - centre[1]);
  };
  for (const std::uint32_t node : domain) {
    middle = off(node) < off(middle) ? node : middle;
  }
  std::vector<float> u(rest.size());
  float deepest = 0, largest = 0;
  double now = 100.0;
  std::uint64_t landed = 0;
  for (int frame = 0; frame < 200; frame++) {
    const float way = static_cast<float>(std::fmod(20.0 * (now - 100.0), 7.0));
    const float press = way < 3.5F ? way : 7 - way;
    const upt_instrument tool =
        ball(rest[3 * middle], rest[3 * middle + 1], rest[3 * middle + 2] + 4.5F - press);
    EXPECT(clock.frame(scene, now, {&tool, 1}, u), UPT_OK);
    landed += clock.landed() ? 1 : 0;
    // A tool that was put inside is pushed out over a few steps. Slow frames make steps themselves
    // where the machine is quick enough, and are late where it is not.
    const bool slow = step_s > 0 && frame % 50 > 40;
    const bool after = step_s > 0 && frame > 50 && frame % 50 < 6;
    if (!slow && !after && (frame < 101 || frame > 110)) {
      deepest = std::max(deepest, depth(rest, u, domain, tool));
    }
    for (const float value : u) {
      EXPECT_TRUE(std::isfinite(value));
      largest = std::max(largest, std::abs(value));
    }
    // The step in flight finishes now or some frames later, as it likes; a second is lost once, and
    // some frames come later than the next two short steps.
    if (slow || frame % 3 == 2) {
      scene.wait(60000);
    }
    now += frame == 100 ? 1.0 : slow ? 0.045 : 0.004 + 0.004 * (frame % 4);
  }
  EXPECT_TRUE(landed > 20);
  EXPECT_TRUE(largest > 1);
  EXPECT(clock.reset(scene), UPT_OK);
  const upt_instrument away = ball(900, 0, 0);
  EXPECT(clock.frame(scene, 0.0, {&away, 1}, u), UPT_OK);
  EXPECT_TRUE(*std::max_element(u.begin(), u.end()) == 0);
  scene.wait(60000);
  return deepest;
}

int main(int argc, char **argv) {
  if (argc != 3) {
    return 2;
  }
  steps_at_their_moments();
  a_hang_is_left_out();
  frames_slower_than_steps();
  poses_between_frames();
  // Without corrections frames lie between the last two steps.
  const float presented = deepest_frame(argv[1], 0), late = deepest_frame(argv[2], 0);
  if (presented > 0.5F * late) {
    std::printf("%.2f mm inside, one step late %.2f\n", static_cast<double>(presented),
                static_cast<double>(late));
  }
  EXPECT_TRUE(presented <= 0.5F * late);
  // A host that takes shorter steps for its frames, some of which make steps themselves.
  EXPECT_TRUE(deepest_frame(argv[1], 0.02) <= 0.5F * late);
  EXPECT(upt::shutdown(), UPT_OK);
  return expect_result("frame_clock");
}
