#include "surgery.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace {

const float EDGE_MM = 20;         // of a blade, from its tip along its axis
const float FRACTURE_ENERGY = 10; // J/m2
const float STILL_MM = 0.02F;     // a blade that goes less far since its last step waits
const float PUT_MM = 40;          // one that goes farther was put there
const float RATE = 500;           // of an aspirator, mm3/s
const std::uint32_t TORN = 4;     // elements that tear in a step, at the most
const float HARDER = 4;           // what coagulation multiplies stiffness by, once an element

// The point of the tool's axis, local y, so far from its middle.
void along(const upt_instrument &tool, float far, float *out) {
  const float *q = tool.rotation;
  const float axis[3] = {2 * (q[0] * q[1] - q[2] * q[3]), 1 - 2 * (q[0] * q[0] + q[2] * q[2]),
                         2 * (q[1] * q[2] + q[0] * q[3])};
  for (int k = 0; k < 3; k++) {
    out[k] = tool.position[k] + far * axis[k];
  }
}

// Of its tip: where a blade's edge begins, and the middle of the ball.
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

Surgery::Surgery(const upt::Model &model) {
  const std::vector<float> positions = model.positions();
  const std::vector<std::uint32_t> tets = model.indices(UPT_SET_TETS);
  now_.hard.assign(tets.size() / 4, false);
  middles_.assign(3 * now_.hard.size(), 0);
  for (std::size_t corner = 0; corner < tets.size(); corner++) {
    for (std::size_t k = 0; k < 3; k++) {
      middles_[3 * (corner / 4) + k] += 0.25F * positions[3 * std::size_t{tets[corner]} + k];
    }
  }
}

void Surgery::begin(upt::Scene &scene) {
  scene.set_region({});
  follow(scene);
  has_begun_ = true;
}

void Surgery::operate(upt::Scene &scene, Kind kind, const upt_instrument *tool, double step_s) {
  const bool works = tool != nullptr && (kind != Kind::press || limit > 0);
  force_ = {};
  waits_ = waits_ && works;
  if (waits_) {
    return;
  }
  if (!works || kind != stroke_kind_) {
    end_stroke(scene);
  }
  if (!works) {
    return;
  }
  if (!in_stroke_) {
    before_ = {scene.save(), now_};
    in_stroke_ = true;
    stroke_kind_ = kind;
    stroke_ += 1;
    last_ = *tool;
  }
  upt_cut made = upt::make<upt_cut>();
  if (kind == Kind::press) {
    scene.tear(stroke_, limit, TORN, made);
  } else if (kind == Kind::blade) {
    made = cut(scene, *tool);
  } else if (kind == Kind::aspirate) {
    upt_instrument ball = upt::sphere(tool->radius);
    along(*tool, tip(*tool), ball.position);
    scene.remove(ball, static_cast<float>(RATE * step_s), made);
  } else {
    made = coagulate(scene, *tool);
  }
  std::copy(made.force, made.force + 3, force_.begin());
  if (made.is_changed != 0) {
    note(scene, made);
  }
}

upt_cut Surgery::cut(upt::Scene &scene, const upt_instrument &tool) {
  upt_cut made = upt::make<upt_cut>();
  float poses[12];
  const upt_instrument *ends[2] = {&last_, &tool};
  for (int at = 0; at < 2; at++) {
    along(*ends[at], tip(*ends[at]), poses + 6 * at);
    along(*ends[at], tip(*ends[at]) + EDGE_MM, poses + 6 * at + 3);
  }
  const float way = std::fmax(apart(poses, poses + 6), apart(poses + 3, poses + 9));
  if (way < STILL_MM) {
    return made;
  }
  last_ = tool;
  if (way < PUT_MM && swept(poses) > STILL_MM * EDGE_MM) {
    auto blade = upt::make<upt_blade>();
    blade.fracture_energy = FRACTURE_ENERGY;
    scene.cut(stroke_, {poses, 12}, 2, made, blade);
  }
  return made;
}

upt_cut Surgery::coagulate(upt::Scene &scene, const upt_instrument &tool) {
  upt_cut made = upt::make<upt_cut>();
  float at[3];
  along(tool, tip(tool), at);
  std::vector<std::uint32_t> reached;
  for (std::size_t element = 0; element < now_.hard.size(); element++) {
    if (!now_.hard[element] && apart(&middles_[3 * element], at) < tool.radius) {
      reached.push_back(static_cast<std::uint32_t>(element));
    }
  }
  if (!reached.empty()) {
    scene.scale_stiffness(reached, HARDER, made);
    for (const std::uint32_t element : reached) {
      now_.hard[element] = true;
    }
    now_.hard_count += reached.size();
  }
  return made;
}

// The stroke has done something.
void Surgery::note(upt::Scene &scene, const upt_cut &made) {
  now_.area += made.area_mm2;
  now_.removed += made.removed_mm3;
  if (!before_.snapshot.empty()) {
    undone_.push_back(std::exchange(before_, {}));
    if (undone_.size() > MOST_UNDONE) {
      undone_.erase(undone_.begin());
    }
  }
  follow(scene);
}

// Pieces that nothing holds leave.
void Surgery::end_stroke(upt::Scene &scene) {
  if (!in_stroke_) {
    return;
  }
  in_stroke_ = false;
  const bool has_changed = std::exchange(before_, {}).snapshot.empty();
  upt_cut dropped = upt::make<upt_cut>();
  if (has_changed && scene.drop_fragments(dropped) == UPT_OK && dropped.is_changed != 0) {
    now_.removed += dropped.removed_mm3;
    follow(scene);
  }
}

bool Surgery::undo(upt::Scene &scene) {
  stop();
  if (undone_.empty()) {
    return false;
  }
  scene.restore(undone_.back().snapshot);
  now_ = std::move(undone_.back().account);
  undone_.pop_back();
  follow(scene);
  return true;
}

void Surgery::reset(upt::Scene &scene) {
  stop();
  undone_.clear();
  now_ = {0, 0, 0, std::vector<bool>(now_.hard.size(), false)};
  if (has_begun_) {
    follow(scene);
  }
}

void Surgery::stop() {
  waits_ = waits_ || in_stroke_;
  in_stroke_ = false;
  before_ = {};
}

void Surgery::follow(upt::Scene &scene) {
  scene.surface(surface_);
  changes_ += 1;
}
