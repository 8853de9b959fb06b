// upt.hpp with exceptions: handles move, errors throw, spans take what a host has.
//
//   wrapper BUNDLE REDUCED
#include "expect.h"

#include <array>
#include <cmath>
#include <string>
#include <type_traits>
#include <vector>

#include "upt.hpp"

static_assert(!std::is_copy_constructible_v<upt::Model> && !std::is_copy_assignable_v<upt::Model>);
static_assert(!std::is_copy_constructible_v<upt::Scene> && !std::is_copy_assignable_v<upt::Scene>);
static_assert(!std::is_copy_constructible_v<upt::Hull> && !std::is_copy_assignable_v<upt::Hull>);
static_assert(std::is_nothrow_move_constructible_v<upt::Model>);
static_assert(std::is_nothrow_move_assignable_v<upt::Scene>);

template <typename Call> static upt_status thrown(Call call) {
  try {
    call();
  } catch (const upt::error &error) {
    EXPECT_TRUE(std::string(error.what()).size() > 4);
    return error.status();
  }
  return UPT_OK;
}

// Instruments drive the steps of a bundle with a linear response.
static void instruments(const char *bundle) {
  upt::Model model = upt::Model::open(bundle);
  upt::Scene scene(model);
  const std::vector<float> rest = model.positions();
  const std::vector<std::uint32_t> domain = model.indices(UPT_SET_DOMAIN_NODES);
  std::vector<float> points;
  for (int corner = 0; corner < 8; corner++) {
    for (int axis = 0; axis < 3; axis++) {
      points.push_back((corner >> axis & 1) != 0 ? 3.0F : -3.0F);
    }
  }
  EXPECT_TRUE(thrown([&] { upt::Hull({points.data(), 4}); }) == UPT_ERR_ARGUMENT);
  EXPECT_TRUE(thrown([&] { upt::Hull({points.data(), 12}); }) == UPT_ERR_ARGUMENT);
  upt::Hull cube(points), empty;
  EXPECT(empty.create(points), UPT_OK);
  empty = std::move(cube);
  EXPECT_TRUE(!cube && empty);
  upt_instrument tools[2] = {empty.instrument(), upt::sphere(2.0F)};
  tools[0].friction = 0.2F;
  for (int axis = 0; axis < 3; axis++) {
    tools[0].position[axis] = rest[3 * domain[domain.size() / 2] + static_cast<std::size_t>(axis)];
    tools[1].position[axis] = 900.0F;
  }
  std::vector<float> field(rest.size()), same(rest.size());
  EXPECT(scene.step(tools, field), UPT_OK);
  EXPECT(scene.step({tools, 2}), UPT_OK);
  EXPECT(scene.submit(tools), UPT_OK);
  EXPECT(scene.wait(60000), UPT_OK);
  const std::vector<upt_instrument_reading> readings = scene.readings(2);
  EXPECT_TRUE(readings[0].contact_count > 0 && readings[1].contact_count == 0);
  EXPECT_TRUE(thrown([&] { scene.readings(1); }) == UPT_ERR_ARGUMENT);
  EXPECT_TRUE(scene.instrument_contacts().size() == readings[0].contact_count);
  empty.destroy();
  EXPECT_TRUE(thrown([&] { scene.step(tools); }) == UPT_ERR_HANDLE);
  EXPECT(scene.step(), UPT_OK);
  EXPECT_TRUE(scene.readings(0).empty() && scene.instrument_contacts().empty());
}

// A hand feels a tool of a bundle with corrections; elsewhere it is told that it cannot.
static void haptics(const char *bundle) {
  upt::Model model = upt::Model::open(bundle);
  upt_scene_options corrected = upt::make<upt_scene_options>();
  corrected.corrections = upt::corrections(5);
  const upt_instrument tool = upt::sphere(3.0F);
  upt::Scene plain(model);
  upt::Scene scene;
  if (thrown([&] { scene.create(model, &corrected); }) == UPT_ERR_UNSUPPORTED) {
    EXPECT_TRUE(thrown([&] { upt::Haptics(plain, 0, tool); }) == UPT_ERR_UNSUPPORTED);
    return;
  }
  std::vector<float> field(3 * model.info().node_count), at_points(3);
  EXPECT(scene.attach_points({model.positions().data(), 3}), UPT_OK);
  EXPECT(scene.step(upt::Input({&tool, 1}).at(8.0), field), UPT_OK);
  EXPECT(scene.present({&tool, 1}, 8.01, field), UPT_OK);
  EXPECT(scene.present({}, 8.01, at_points, upt::view(UPT_VIEW_POINTS)), UPT_OK);
  EXPECT_TRUE(thrown([&] { scene.present({}, 7.9, field); }) == UPT_ERR_ARGUMENT);
  upt::Haptics hand(scene, 0, tool), other;
  other = std::move(hand);
  EXPECT_TRUE(!hand && other);
  upt_haptic_pose pose = upt::make<upt_haptic_pose>();
  pose.rotation[3] = 1.0F;
  pose.position_m[0] = 0.9F;
  EXPECT_TRUE(other.render(pose).contact == 0);
  pose.time_s = -1.0;
  EXPECT_TRUE(thrown([&] { other.render(pose); }) == UPT_ERR_ARGUMENT);
  scene.destroy();
  pose.time_s = 1.0;
  EXPECT_TRUE(thrown([&] { other.render(pose); }) == UPT_ERR_STATE);
}

// A bed holds what a thread pulls at; what is pulled too hard breaks.
static void ties(const char *bundle) {
  upt::Model model = upt::Model::open(bundle);
  upt_scene_options options = upt::make<upt_scene_options>();
  options.corrections = upt::corrections(5);
  upt::Scene scene(model, &options);
  const std::vector<float> rest = model.positions();
  const std::vector<std::uint32_t> domain = model.indices(UPT_SET_DOMAIN_NODES);
  upt_bed bed = upt::make<upt_bed>();
  bed.radius_mm = 15;
  bed.stiffness = 20;
  bed.break_mn = 1000;
  std::copy_n(&rest[3 * domain[domain.size() / 2]], 3, bed.centre);
  std::vector<upt_tie> ties = scene.bed(bed);
  EXPECT_TRUE(ties.size() > 2);
  upt_tie thread = upt::make<upt_tie>();
  EXPECT(scene.tie_point(bed.centre, thread), UPT_OK);
  thread.stiffness = 5;
  thread.slack_mm = 1;
  std::copy_n(bed.centre, 3, thread.place);
  thread.place[2] += 3;
  ties.push_back(thread);
  std::vector<float> field(rest.size());
  for (int step = 0; step < 5; step++) {
    EXPECT(scene.step(upt::Input().ties(ties), field), UPT_OK);
  }
  const std::vector<upt_tie_reading> readings = scene.tie_readings(ties.size());
  const upt_tie_reading &pulled = readings.back();
  EXPECT_TRUE(pulled.force[2] > 0.1F && pulled.length_mm > 1 && pulled.broken == 0);
  EXPECT_TRUE(std::fabs(pulled.force[2] - 5 * (pulled.length_mm - 1)) < 0.1F);
  ties.back().break_mn = 0.5F * pulled.force[2];
  EXPECT(scene.step(upt::Input().ties(ties), field), UPT_OK);
  EXPECT_TRUE(scene.tie_readings(ties.size()).back().broke == 1);
  ties[0].stiffness = -1;
  EXPECT_TRUE(thrown([&] { scene.step(upt::Input().ties(ties), field); }) == UPT_ERR_ARGUMENT);
}

// A blade through the upper half of a body with corrections: outputs and the surface grow, and go
// back.
static void cuts(const char *bundle) {
  upt::Model model = upt::Model::open(bundle);
  upt_scene_options options = upt::make<upt_scene_options>();
  options.corrections = upt::corrections(5);
  upt::Scene scene(model, &options);
  const std::vector<float> rest = model.positions();
  float low[3] = {rest[0], rest[1], rest[2]}, high[3] = {rest[0], rest[1], rest[2]};
  for (std::size_t k = 0; k < rest.size(); k++) {
    low[k % 3] = std::fmin(low[k % 3], rest[k]);
    high[k % 3] = std::fmax(high[k % 3], rest[k]);
  }
  const float x = low[0] + 0.45F * (high[0] - low[0]), z = low[2] + 0.6F * (high[2] - low[2]);
  const float blade[12] = {x, low[1] - 1, high[2] + 1, x, high[1] + 1, high[2] + 1,
                           x, low[1] - 1, z,           x, high[1] + 1, z};
  EXPECT_TRUE(thrown([&] { scene.cut(0, blade, 5); }) == UPT_ERR_ARGUMENT);
  const upt::Surface whole = scene.surface();
  EXPECT_TRUE(whole.is_new && whole.changed.size() == whole.inside.size());
  const upt_cut made = scene.cut(0, blade, 2);
  EXPECT_TRUE(made.copied_count > 0 && made.area_mm2 > 0);
  EXPECT_TRUE(scene.node_count() == rest.size() / 3 + made.copied_count);
  std::vector<float> field(3 * scene.node_count()), at(whole.rest.size());
  EXPECT_TRUE(thrown([&] { scene.surface_positions(at); }) == UPT_ERR_STATE);
  const upt::Surface parted = scene.surface();
  EXPECT_TRUE(!parted.is_new && parted.first_vertex == whole.rest.size() / 3);
  EXPECT_TRUE(parted.inside.size() > whole.inside.size() && !parted.changed.empty());
  EXPECT(scene.step({}, field), UPT_OK);
  at.resize(parted.rest.size());
  EXPECT(scene.surface_positions(at), UPT_OK);
  EXPECT_TRUE(std::fabs(at[0] - rest[0] - field[0]) < 1e-4F);
  upt_cut out;
  const std::uint32_t elements[1] = {0};
  EXPECT(scene.tear(1, 5.0F, 4, out), UPT_OK);
  EXPECT_TRUE(out.area_mm2 == 0 && out.is_changed == 0);
  EXPECT_TRUE(thrown([&] { scene.tear(1, 1.0F, 4, out); }) == UPT_ERR_ARGUMENT);
  EXPECT(scene.scale_stiffness(elements, 2.0F, out), UPT_OK);
  EXPECT(scene.drop_fragments(out), UPT_OK);
  upt_instrument tip = upt::sphere(2.0F);
  tip.position[0] = x;
  tip.position[1] = 0.5F * (low[1] + high[1]);
  tip.position[2] = high[2];
  EXPECT(scene.remove(tip, 5.0F, out), UPT_OK);
  EXPECT_TRUE(out.removed_mm3 > 0);
  EXPECT(scene.reset(), UPT_OK);
  EXPECT_TRUE(scene.node_count() == rest.size() / 3 && scene.surface().is_new);
}

int main(int argc, char **argv) {
  if (argc != 4) {
    return 2;
  }
  EXPECT_TRUE(upt::abi_matches());
  EXPECT_TRUE(thrown([] { upt::Model::open("no/such/bundle"); }) == UPT_ERR_IO);

  upt::Model model = upt::Model::open(std::string(argv[1]));
  const upt_model_info info = model.info();
  EXPECT_TRUE(model.positions().size() == 3 * info.node_count);
  EXPECT_TRUE(model.describe().front() == '{' && model.describe().back() == '}');

  upt::Scene scene(model);
  // A frame without contact: empty lists everywhere.
  EXPECT(scene.step(upt::Input::contacts({}, {})), UPT_OK);
  EXPECT(scene.contact_force({}), UPT_OK);
  {
    std::vector<float> all(3 * info.node_count);
    EXPECT(scene.decode(upt::view(upt::span<const std::uint32_t>{}), all), UPT_OK);
    EXPECT_TRUE(thrown([&] { scene.read(all, upt::view(UPT_VIEW_NODES)); }) == UPT_ERR_UNSUPPORTED);
  }
  EXPECT(scene.reset(), UPT_OK);
  upt::Model moved = std::move(model);
  EXPECT_TRUE(!model && moved);
  EXPECT_TRUE(thrown([&] { (void)model.info(); }) == UPT_ERR_NULL);

  const std::vector<std::uint32_t> domain = moved.indices(UPT_SET_DOMAIN_NODES);
  const std::array<std::uint32_t, 2> nodes = {domain[0], domain[1]};
  const float vectors[6] = {0, 0, -1, 0, 0, -1};
  std::vector<float> field(3 * info.node_count), same(field.size());
  EXPECT(scene.step(upt::Input::contacts(nodes, vectors), field), UPT_OK);
  EXPECT_TRUE(field[3 * nodes[0] + 2] == -1.0F);
  EXPECT(scene.read(same), UPT_OK);
  EXPECT_TRUE(field == same);
  const upt::Input uneven = upt::Input::contacts(nodes, {vectors, 3});
  EXPECT_TRUE(thrown([&] { scene.step(uneven); }) == UPT_ERR_ARGUMENT);
  EXPECT_TRUE(thrown([&] { scene.submit(uneven); }) == UPT_ERR_ARGUMENT);
  EXPECT_TRUE(scene.stats().step_count == 1);

  const std::vector<std::uint8_t> snapshot = scene.save();
  EXPECT(scene.record(), UPT_OK);
  EXPECT(scene.step_field(nullptr, nullptr, field), UPT_OK);
  EXPECT(scene.restore(snapshot), UPT_OK);
  EXPECT_TRUE(thrown([&] { scene.record(); }) == UPT_ERR_STATE);
  EXPECT(scene.record(0), UPT_OK);
  std::string lines = "# before\n";
  EXPECT(scene.take_record(lines), UPT_OK);
  // The state in which it began, the step, the restored state, the end.
  EXPECT_TRUE(lines.compare(0, 25, "# before\n{\"upt_replay\":2,") == 0);
  EXPECT_TRUE(lines.find("\n{\"restore\":\"") < lines.find("\n{\"step\":{"));
  const std::string end = "\n{\"end\":3}\n";
  EXPECT_TRUE(lines.compare(lines.size() - end.size(), end.size(), end) == 0);
  const std::size_t size = lines.size();
  EXPECT(scene.take_record(lines), UPT_OK);
  EXPECT_TRUE(lines.size() == size);
  EXPECT(scene.read(same), UPT_OK);
  EXPECT_TRUE(same[3 * nodes[0] + 2] == -1.0F);

  EXPECT(scene.submit(upt::Input::contacts(nodes, vectors).at(1.5)), UPT_OK);
  EXPECT(scene.wait(60000), UPT_OK);
  EXPECT(scene.sample(0.5, field), UPT_OK);

  upt::Scene other(moved);
  other = std::move(scene);
  EXPECT_TRUE(!scene && other);
  moved.close();
  EXPECT(other.reset(), UPT_OK);
  EXPECT_TRUE(thrown([] { upt::shutdown(); }) == UPT_ERR_STATE);
  other.destroy();
  instruments(argv[2]);
  haptics(argv[2]);
  haptics(argv[3]);
  ties(argv[3]);
  cuts(argv[3]);
  EXPECT(upt::shutdown(), UPT_OK);
  return expect_result("wrapper");
}
