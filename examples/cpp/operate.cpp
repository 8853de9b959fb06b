// A body that is cut, one that breathes, and one whose support groups move, without a window.
//
//   operate BUNDLE [SUPPORTED]
//
// BUNDLE: corrections in it, such as onnx/liver-coarse. A blade cuts a slit into the middle of the
// domain, an aspirator takes tissue beside it, a ball presses the lip; each frame has the surface
// of its own moment. Then all of it is undone. Then the organ breathes, with a gall bladder that
// hangs on its bed and is drawn off. SUPPORTED: a bundle with support groups, the first of which
// carries the organ up, lets it go and holds it again. Exit code 1: something is not as it should
// be.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "upt.hpp"
#include "vec.hpp"

static void require(bool holds, const std::string &what) {
  if (!holds) {
    throw std::runtime_error(what);
  }
}

static Vec3 vertex(const std::vector<float> &list, std::size_t index) {
  return {list[3 * index], list[3 * index + 1], list[3 * index + 2]};
}

// The node in the middle of the domain, and the direction out of the tissue there.
static std::pair<Vec3, Vec3> site(const upt::Model &model) {
  const std::vector<float> positions = model.positions();
  const std::vector<std::uint32_t> faces = model.indices(UPT_SET_DOMAIN_FACES);
  Vec3 mean{}, normal{};
  for (const std::uint32_t node : faces) {
    mean = mean + vertex(positions, node) * (1.0F / static_cast<float>(faces.size()));
  }
  Vec3 best = vertex(positions, faces[0]);
  for (const std::uint32_t node : faces) {
    const Vec3 place = vertex(positions, node);
    best = length(place - mean) < length(best - mean) ? place : best;
  }
  for (std::size_t f = 0; f < faces.size(); f += 3) {
    const Vec3 a = vertex(positions, faces[f]);
    if (length(a - best) < 10) {
      normal =
          normal + cross(vertex(positions, faces[f + 1]) - a, vertex(positions, faces[f + 2]) - a);
    }
  }
  return {best, normalized(normal)};
}

static void put(float *out, Vec3 place) {
  out[0] = place.x;
  out[1] = place.y;
  out[2] = place.z;
}

// The edge stands upright from below the tissue to above it: two points.
static std::array<float, 6> upright(Vec3 place, Vec3 normal, float depth) {
  std::array<float, 6> edge{};
  put(edge.data(), place - normal * depth);
  put(edge.data() + 3, place + normal * 6.0F);
  return edge;
}

static void operate(const std::string &bundle) {
  const upt::Model model = upt::Model::open(bundle);
  upt::Scene scene(model);
  const auto [middle, normal] = site(model);
  const Vec3 along = normalized(cross(normal, {0.3F, 0.5F, 0.8F}));
  upt::Surface surface = scene.surface(); // all of it, once
  const std::vector<std::uint8_t> before = scene.save();

  // Pieces of 2 mm, one a step, by a blade that feels 10 J/m2.
  auto blade = upt::make<upt_blade>();
  blade.fracture_energy = 10;
  float area = 0, force = 0;
  for (int piece = -6; piece < 6; piece++) {
    std::vector<float> poses;
    for (const int end : {piece, piece + 1}) {
      const auto edge = upright(middle + along * (2.0F * static_cast<float>(end)), normal, 8);
      poses.insert(poses.end(), edge.begin(), edge.end());
    }
    upt_cut cut;
    scene.cut(0, poses, 2, cut, blade);
    area += cut.area_mm2;
    force = std::max(force, length(Vec3{cut.force[0], cut.force[1], cut.force[2]}));
    scene.step();
    scene.surface(surface); // a renderer uploads surface.changed, and vertices from first_vertex on
  }
  const auto inside = std::count(surface.inside.begin(), surface.inside.end(), 1);
  require(area > 60 && force > 10, "the blade has cut too little");
  require(inside > 10, "nothing of the inside is on the surface");

  // An aspirator beside the slit.
  upt_instrument ball = upt::sphere(3);
  put(ball.position, middle + cross(normal, along) * 8.0F - normal * 2.0F);
  upt_cut taken;
  scene.remove(ball, 60, taken);
  require(taken.removed_mm3 > 10, "the aspirator took nothing");
  scene.surface(surface);

  // A ball presses the lip; between two steps a frame is at its own moment.
  std::vector<float> moved(surface.rest.size());
  float deepest = 0;
  for (int step = 1; step <= 8; step++) {
    put(ball.position,
        middle + cross(normal, along) * -4.5F + normal * (4.0F - 0.75F * static_cast<float>(step)));
    scene.step({&ball, 1});
    scene.present(upt::Input(upt::span<const upt_instrument>(&ball, 1)), 0.02, moved,
                  upt::view(UPT_VIEW_SURFACE));
    for (std::size_t v = 0; v < moved.size() / 3; v++) {
      deepest = std::max(deepest, length(vertex(moved, v)));
    }
  }
  const upt_instrument_reading felt = scene.readings(1).front();
  std::printf("cut %.0f mm2 with %.0f mN at most, %zu nodes more, took %.0f mm3; the lip pushes "
              "back with %.0f mN, moved by %.1f mm\n",
              static_cast<double>(area), static_cast<double>(force),
              scene.node_count() - static_cast<std::size_t>(model.info().node_count),
              static_cast<double>(taken.removed_mm3),
              static_cast<double>(length(Vec3{felt.force[0], felt.force[1], felt.force[2]})),
              static_cast<double>(deepest));
  require(deepest > 1, "the ball moves nothing");

  scene.restore(before); // undo
  scene.surface(surface);
  require(surface.is_new && std::count(surface.inside.begin(), surface.inside.end(), 1) == 0,
          "undo left a wound");
}

// The organ goes up and down with what holds it, by 15 mm in four seconds. A gall bladder, a ball
// of 9 mm here, hangs on its bed: ties between it and the tissue below, which go with it. After two
// seconds it is drawn off, and the bed tears. All of it is in the organ's frame, which breathes.
static void breathe(const std::string &bundle) {
  const upt::Model model = upt::Model::open(bundle);
  upt::Scene scene(model);
  const auto [middle, normal] = site(model);
  upt_instrument bladder = upt::sphere(9);
  const Vec3 rest = middle + normal * 9.5F;
  put(bladder.position, rest);
  auto region = upt::make<upt_bed>();
  put(region.centre, middle);
  region.radius_mm = 15;
  region.stiffness = 300;
  region.break_mn = 400;
  std::vector<upt_tie> bed = scene.bed(region);
  for (upt_tie &tie : bed) {
    put(tie.place, vertex({tie.place, tie.place + 3}, 0) - rest); // in the ball's frame
    tie.to = UPT_END_INSTRUMENT;
  }
  const float upright[4] = {0, 0, 0, 1};
  float most = 0;
  std::size_t torn = 0;
  for (int step = 1; step <= 80; step++) {
    const float t = 0.05F * static_cast<float>(step);
    const float height[3] = {0, 0, 7.5F * (1 - std::cos(1.5707963F * t))};
    put(bladder.position, rest + normal * (10 * std::max(t - 2, 0.0F)));
    const upt::span<const upt_instrument> held(&bladder, 1);
    scene.step(upt::Input(held).support(height, upright).ties(bed));
    const upt_instrument_reading felt = scene.readings(1).front();
    most = std::max(most, length(vertex({felt.force, felt.force + 3}, 0)));
    const auto ties = scene.tie_readings(bed.size());
    const std::size_t before = torn;
    torn = static_cast<std::size_t>(std::count_if(
        ties.begin(), ties.end(), [](const upt_tie_reading &tie) { return tie.broken != 0; }));
    require(t > 2 || torn == 0, "the bed tears while the organ breathes");
    require(torn >= before, "a torn tie holds again");
  }
  std::printf("a gall bladder on a bed of %zu ties: %zu torn, %.0f mN at most\n", bed.size(), torn,
              static_cast<double>(most));
  require(bed.size() > 3 && torn == bed.size(), "the bed has not torn");
  require(most > 100 && most < 1000, "the bed bears another force");
}

// Where the nodes of the first group are on the average, from rest.
static Vec3 mean_of(upt::Scene &scene, const std::vector<std::uint32_t> &nodes) {
  std::vector<float> u(3 * nodes.size());
  scene.decode(upt::view(nodes), u);
  Vec3 mean{};
  for (std::size_t i = 0; i < nodes.size(); i++) {
    mean = mean + vertex(u, i) * (1.0F / static_cast<float>(nodes.size()));
  }
  return mean;
}

// The nodes of a support group.
static std::vector<std::uint32_t> group_of(const upt::Model &model, std::uint32_t group) {
  std::uint64_t count = 0;
  upt_model_read_support(model.get(), group, nullptr, 0, nullptr, 0, &count);
  std::vector<std::uint32_t> nodes(static_cast<std::size_t>(count));
  upt::check(upt_model_read_support(model.get(), group, nullptr, 0, nodes.data(), count, &count));
  return nodes;
}

static void carry(const std::string &bundle) {
  const upt::Model model = upt::Model::open(bundle);
  upt::Scene scene(model);
  const std::vector<std::uint32_t> nodes = group_of(model, 0);
  auto group = upt::make<upt_support>();
  group.rotation[3] = 1;
  const auto steps = [&](int count) {
    for (int step = 0; step < count; step++) {
      scene.step(upt::Input().supports({&group, 1}));
    }
  };
  for (int step = 1; step <= 20; step++) {
    group.position[2] = 0.2F * static_cast<float>(step); // 4 mm up in a second
    steps(1);
  }
  const float led = mean_of(scene, nodes).z;
  require(std::fabs(led - 4) < 1e-3F, "the group is not where it was led");
  group.let_go = 1;
  steps(20);
  const float free = mean_of(scene, nodes).z;
  group.let_go = 0;
  steps(5);
  const float held = mean_of(scene, nodes).z;
  std::printf("support group of %zu nodes: led to %.2f mm, let go %.2f mm, held again %.2f mm\n",
              nodes.size(), static_cast<double>(led), static_cast<double>(free),
              static_cast<double>(held));
  require(std::fabs(free - led) > 0.05F, "a group that is let go stays where it was");
  require(std::fabs(held - free) < 0.5F, "a group that is held again leaps");
}

int main(int argc, char **argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: operate BUNDLE [SUPPORTED]\n");
    return 1;
  }
  try {
    operate(argv[1]);
    breathe(argv[1]);
    if (argc > 2) {
      carry(argv[2]);
    }
    upt::shutdown();
  } catch (const std::exception &error) {
    std::fprintf(stderr, "operate: %s\n", error.what());
    return 1;
  }
  return 0;
}
