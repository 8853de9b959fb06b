// upt.hpp with exceptions: handles move, errors throw, spans take what a host has.
//
//   wrapper BUNDLE
#include "expect.h"

#include <array>
#include <string>
#include <type_traits>
#include <vector>

#include "upt.hpp"

static_assert(!std::is_copy_constructible_v<upt::Model> && !std::is_copy_assignable_v<upt::Model>);
static_assert(!std::is_copy_constructible_v<upt::Scene> && !std::is_copy_assignable_v<upt::Scene>);
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

int main(int argc, char **argv) {
  if (argc != 2) {
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
  EXPECT(scene.step_contacts({}, {}), UPT_OK);
  EXPECT(scene.contact_force({}), UPT_OK);
  EXPECT(scene.decode({}, {}), UPT_OK);
  EXPECT(scene.reset(), UPT_OK);
  upt::Model moved = std::move(model);
  EXPECT_TRUE(!model && moved);
  EXPECT_TRUE(thrown([&] { (void)model.info(); }) == UPT_ERR_NULL);

  const std::vector<std::uint32_t> domain = moved.indices(UPT_SET_DOMAIN_NODES);
  const std::array<std::uint32_t, 2> nodes = {domain[0], domain[1]};
  const float vectors[6] = {0, 0, -1, 0, 0, -1};
  std::vector<float> field(3 * info.node_count), same(field.size());
  EXPECT(scene.step_contacts(nodes, vectors, field), UPT_OK);
  EXPECT_TRUE(field[3 * nodes[0] + 2] == -1.0F);
  EXPECT(scene.read(same), UPT_OK);
  EXPECT_TRUE(field == same);
  EXPECT_TRUE(thrown([&] { scene.step_contacts(nodes, {vectors, 3}); }) == UPT_ERR_ARGUMENT);
  EXPECT_TRUE(scene.stats().step_count == 1);

  const std::vector<std::uint8_t> snapshot = scene.save();
  EXPECT(scene.step(nullptr, nullptr, field), UPT_OK);
  EXPECT(scene.restore(snapshot), UPT_OK);
  EXPECT(scene.read(same), UPT_OK);
  EXPECT_TRUE(same[3 * nodes[0] + 2] == -1.0F);

  EXPECT(scene.submit(nodes, vectors), UPT_OK);
  EXPECT(scene.wait(60000), UPT_OK);
  EXPECT(scene.sample(0.5, field), UPT_OK);

  upt::Scene other(moved);
  other = std::move(scene);
  EXPECT_TRUE(!scene && other);
  moved.close();
  EXPECT(other.reset(), UPT_OK);
  EXPECT_TRUE(thrown([] { upt::shutdown(); }) == UPT_ERR_STATE);
  other.destroy();
  EXPECT(upt::shutdown(), UPT_OK);
  return expect_result("wrapper");
}
