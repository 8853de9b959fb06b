#include "spatula.hpp"

#include <algorithm>

// Speeds, mm/s, and heights over the surface, mm.
static constexpr float DOWN = 14, UP = 40, HOVER = 4, DRAG_LIMIT = 5;
// Coulomb's coefficient of a dry blade on tissue.
static constexpr float FRICTION = 0.4F;
// Nodes this far over or under the touched point, along the blade's normal, belong to the same
// patch, mm. Those over it are pushed further than the blade's depth.
static constexpr float OVER = 2, UNDER = 9;

void Spatula::hover(const std::optional<Hit> &hit, const Ray &ray) {
  if (engaged_) {
    // While it presses, the mouse drags the blade sideways.
    const Vec3 plane = anchor_.rest - frame_.z * depth_;
    const float slope = dot(ray.direction, frame_.z);
    if (slope < -0.2F) {
      const float distance = dot(plane - ray.origin, frame_.z) / slope;
      Vec3 aim = ray.origin + ray.direction * distance - plane;
      const float far = length(aim);
      aim = far > DRAG_LIMIT ? aim * (DRAG_LIMIT / far) : aim;
      drag_ = drag_ + (aim - drag_) * 0.08F;
    }
  } else if (hit && hit->domain) {
    anchor_ = *hit;
    frame_ = frame_around(hit->normal, {0, 0, 1});
    drag_ = {};
    visible_ = true;
  }
}

void Spatula::move(float seconds, bool pressed) {
  if (!visible_) {
    return;
  }
  depth_ += pressed ? DOWN * seconds : -UP * seconds;
  depth_ = std::clamp(depth_, -HOVER, max_depth_);
  engaged_ = depth_ > -HOVER;
}

Vec3 Spatula::centre() const { return anchor_.rest + drag_ + frame_.z * (HALF.z - depth_); }

Contacts Spatula::contacts(Tissue &tissue) {
  Contacts out;
  if (visible_ && engaged_) {
    library_contacts_ = library_contacts_ && library(tissue, out);
    if (!library_contacts_) {
      own(tissue, out);
    }
  }
  return out;
}

upt_instrument Spatula::blade() const {
  upt_instrument blade = upt::make<upt_instrument>();
  const Vec3 position = centre();
  const std::array<float, 4> rotation = quaternion(frame_);
  blade.shape = UPT_SHAPE_SPATULA;
  blade.sticking = 1;
  blade.friction = FRICTION;
  const float values[3] = {position.x, position.y, position.z};
  std::copy(values, values + 3, blade.position);
  std::copy(rotation.begin(), rotation.end(), blade.rotation);
  const float half[3] = {HALF.x, HALF.y, HALF.z};
  std::copy(half, half + 3, blade.half_extents);
  blade.radius = 0.5F;
  return blade;
}

std::vector<upt_instrument> Spatula::instruments() const {
  return visible_ && engaged_ ? std::vector<upt_instrument>{blade()}
                              : std::vector<upt_instrument>{};
}

bool Spatula::library(Tissue &tissue, Contacts &out) {
  const upt_instrument blade = this->blade();
  out.nodes.resize(tissue.domain().size());
  out.vectors.resize(3 * out.nodes.size());
  std::uint64_t count = 0;
  try {
    tissue.scene().contacts_from_instruments({&blade, 1}, out.nodes, out.vectors, count);
  } catch (const upt::error &error) {
    out = {};
    if (error.status() == UPT_ERR_UNSUPPORTED) {
      return false;
    }
    throw;
  }
  out.nodes.resize(count);
  out.vectors.resize(3 * count);
  return true;
}

void Spatula::own(const Tissue &tissue, Contacts &out) const {
  for (const std::uint32_t node : tissue.domain()) {
    const Vec3 from_anchor = tissue.nodes()[node] - anchor_.rest;
    const float across = dot(from_anchor, frame_.x), along = dot(from_anchor, frame_.y),
                height = dot(from_anchor, frame_.z);
    const float below = height + depth_; // how far the blade has gone past the node
    if (std::abs(across) <= HALF.x && std::abs(along) <= HALF.y && height < OVER &&
        height > -UNDER && below > 0) {
      const Vec3 c = drag_ - frame_.z * below;
      out.nodes.push_back(node);
      out.vectors.insert(out.vectors.end(), {c.x, c.y, c.z});
    }
  }
}
