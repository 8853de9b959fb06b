// What a blade and an aspirator do to the body, step by step, in strokes that can be undone; as
// crates/cli/src/view/surgery.rs.
#include "tissue.hpp"

#include <algorithm>
#include <cmath>

namespace {

const float EDGE_MM = 20;         // of a blade, from its tip along its axis
const float FRACTURE_ENERGY = 10; // J/m2
const float STILL_MM = 0.02F;     // a blade that goes less far since its last step waits
const float PUT_MM = 40;          // one that goes farther was put there
const float RATE = 500;           // of an aspirator, mm3/s

// The point of the tool's axis, local y, so far from its middle.
void along(const upt_instrument &tool, float far, float *out) {
  const float *q = tool.rotation;
  const float axis[3] = {2 * (q[0] * q[1] - q[2] * q[3]), 1 - 2 * (q[0] * q[0] + q[2] * q[2]),
                         2 * (q[1] * q[2] + q[0] * q[3])};
  for (int k = 0; k < 3; k++) {
    out[k] = tool.position[k] + far * axis[k];
  }
}

// Of its tip: where a blade's edge begins, and the middle of an aspirator.
float tip(const upt_instrument &tool) {
  return -tool.half_extents[1] - (tool.shape == UPT_SHAPE_CAPSULE ? tool.radius : 0);
}

float apart(const float *a, const float *b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

// Area between two places of an edge, mm2: none where it goes along itself.
float swept(const float *poses) {
  float p[3], q[3];
  for (int k = 0; k < 3; k++) {
    p[k] = poses[9 + k] - poses[k];
    q[k] = poses[6 + k] - poses[3 + k];
  }
  return 0.5F * std::hypot(p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2],
                           p[0] * q[1] - p[1] * q[0]);
}

} // namespace

// A step begins, and none is in flight: what the tool does to the body in it.
void Tissue::operate(const upt_instrument *cutter) {
  waits_ = waits_ && cutter != nullptr;
  if (waits_) {
    return;
  }
  if (cutter == nullptr || kind != stroke_kind_) {
    end_stroke();
  }
  if (cutter == nullptr) {
    return;
  }
  if (!in_stroke_) {
    in_stroke_ = true;
    stroke_kind_ = kind;
    stroke_ += 1;
    before_ = scene_.save();
    last_ = *cutter;
  }
  upt_cut made = upt::make<upt_cut>();
  if (kind == Kind::aspirate) {
    upt_instrument ball = upt::sphere(cutter->radius);
    along(*cutter, tip(*cutter), ball.position);
    scene_.remove(ball, static_cast<float>(RATE * step_s_), made);
  } else {
    float poses[12];
    const upt_instrument *tools[2] = {&last_, cutter};
    for (int at = 0; at < 2; at++) {
      along(*tools[at], tip(*tools[at]), poses + 6 * at);
      along(*tools[at], tip(*tools[at]) + EDGE_MM, poses + 6 * at + 3);
    }
    const float way = std::fmax(apart(poses, poses + 6), apart(poses + 3, poses + 9));
    if (way < STILL_MM) {
      return;
    }
    last_ = *cutter;
    if (way > PUT_MM || swept(poses) < STILL_MM * EDGE_MM) {
      return;
    }
    auto blade = upt::make<upt_blade>();
    blade.fracture_energy = FRACTURE_ENERGY;
    scene_.cut(stroke_, {poses, 12}, 2, made, blade);
  }
  std::copy(made.force, made.force + 3, reading_.force);
  if (made.is_changed != 0) {
    note(made);
  }
}

void Tissue::note(const upt_cut &made) {
  area_ += made.area_mm2;
  removed_ += made.removed_mm3;
  if (!before_.empty()) {
    undone_.push_back({std::move(before_), area_ - made.area_mm2, removed_ - made.removed_mm3});
    before_.clear();
    if (undone_.size() > MOST_UNDONE) {
      undone_.erase(undone_.begin());
    }
  }
  follow_surface();
}

// Pieces that nothing holds leave.
void Tissue::end_stroke() {
  if (!in_stroke_) {
    return;
  }
  in_stroke_ = false;
  const bool was_effective = before_.empty();
  before_.clear();
  upt_cut dropped = upt::make<upt_cut>();
  if (was_effective && scene_.drop_fragments(dropped) == UPT_OK && dropped.is_changed != 0) {
    removed_ += dropped.removed_mm3;
    follow_surface();
  }
}

bool Tissue::undo() {
  wait();
  waits_ = waits_ || in_stroke_;
  in_stroke_ = false;
  before_.clear();
  if (undone_.empty()) {
    return false;
  }
  scene_.restore(undone_.back().snapshot);
  area_ = undone_.back().area;
  removed_ = undone_.back().removed;
  undone_.pop_back();
  follow_surface();
  return true;
}

// What is shown is the surface of the body as it is now: faces that were outside, then those that
// were inside.
void Tissue::follow_surface() {
  if (!is_cut_) {
    is_cut_ = true;
    scene_.set_region({});
  }
  scene_.surface(surface_);
  rest_ = surface_.rest;
  faces_.clear();
  for (std::uint8_t inside = 0; inside < 2; inside++) {
    outside_ = faces_.size();
    for (std::size_t slot = 0; slot < surface_.inside.size(); slot++) {
      const std::uint32_t *corners = &surface_.triangles[3 * slot];
      if (surface_.inside[slot] == inside && corners[0] != corners[1]) {
        faces_.insert(faces_.end(), corners, corners + 3);
      }
    }
  }
  std::vector<float> now(rest_.size());
  scene_.surface_positions(now);
  displacement_.resize(rest_.size());
  for (std::size_t i = 0; i < now.size(); i++) {
    displacement_[i] = now[i] - rest_[i];
  }
  changes_ += 1;
}

// As upt::FrameClock::frame, for a body that the tool changes or has changed: what it does comes
// between the step that has landed and the one that is due.
void Tissue::work(double now, upt::span<const upt_instrument> tools) {
  clock_.moved(now, tools);
  if (clock_.in_flight() && upt_scene_poll(scene_.get()) != UPT_PENDING) {
    clock_.finished();
    reading_ = pressing_ > 0 ? scene_.readings(pressing_).front() : upt_instrument_reading{};
  }
  const bool presses = kind == Kind::press;
  const upt::Input framed = presses ? upt::Input(tools) : upt::Input();
  const double since = clock_.since(now);
  if (!clock_.due(now)) {
    present(framed, since);
    return;
  }
  const std::vector<upt_instrument> &poses = clock_.start(now);
  operate(presses || poses.empty() ? nullptr : &poses.front());
  present(framed, since);
  pressing_ = presses ? poses.size() : 0;
  scene_.submit(presses ? upt::Input(poses) : upt::Input());
}

void Tissue::present(const upt::Input &framed, double since) {
  const upt_view shown = upt::view(is_cut_ ? UPT_VIEW_SURFACE : UPT_VIEW_REGION);
  scene_.present(framed, since, displacement_, shown);
}
