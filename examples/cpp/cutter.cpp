#include "cutter.hpp"

#include <algorithm>

// Over the surface while it does not work, mm.
static constexpr float HOVER = 3;
// Half the length of its shaft, mm.
static constexpr float HALF = 20;

void Cutter::hover(const std::optional<Hit> &hit) {
  if (!hit || !hit->domain) {
    return;
  }
  under_ = *hit;
  // A blade keeps the direction in which its stroke began.
  if (!pressed_ || !visible_) {
    const Frame lying = frame_around(hit->normal, {0, 0, 1});
    frame_ = {lying.x, lying.z, -lying.y};
  }
  visible_ = true;
}

Vec3 Cutter::tip() const {
  const float over = !pressed_ ? HOVER : kind_ == Kind::blade ? -DEPTH : -0.3F * RADIUS;
  return under_.point + frame_.y * over;
}

std::optional<upt_instrument> Cutter::at_work() const {
  if (!visible() || !pressed_) {
    return std::nullopt;
  }
  upt_instrument tool = upt::make<upt_instrument>();
  tool.shape = UPT_SHAPE_SPATULA;
  tool.radius = RADIUS;
  tool.half_extents[1] = HALF;
  const Vec3 middle = tip() + frame_.y * HALF;
  const float position[3] = {middle.x, middle.y, middle.z};
  const std::array<float, 4> rotation = quaternion(frame_);
  std::copy(position, position + 3, tool.position);
  std::copy(rotation.begin(), rotation.end(), tool.rotation);
  return tool;
}
