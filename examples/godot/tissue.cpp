#include "tissue.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

// The library says what it can do with them; here they only have to fit into its fields.
static upt::Scene make_scene(const upt::Model &model, const Effort &effort, double step_s) {
  if (effort.substeps < 0 || effort.substeps > std::numeric_limits<std::uint8_t>::max()) {
    throw std::runtime_error("substeps is " + std::to_string(effort.substeps));
  }
  auto options = upt::make<upt_scene_options>();
  const auto target_mm = static_cast<float>(effort.target_mm);
  switch (effort.corrections) {
  case 0:
    options.corrections = upt::corrections(UPT_CORRECTIONS_RECOMMENDED, target_mm);
    break;
  case -1:
    options.corrections = upt::corrections(UPT_CORRECTIONS_NONE, target_mm);
    break;
  default:
    const std::int64_t most = std::numeric_limits<std::uint32_t>::max();
    const auto count = effort.corrections < 0 ? most : std::min(effort.corrections, most);
    options.corrections = upt::corrections(static_cast<std::uint32_t>(count), target_mm);
  }
  options.substeps = static_cast<std::uint8_t>(effort.substeps);
  options.step_s = step_s;
  return upt::Scene(model, &options);
}

// What the host asks for; else what the bundle recommends for frames, which takes corrections.
static double length_of_step(const upt::Model &model, const Effort &effort) {
  const upt_model_info info = model.info();
  if (effort.step_s != 0) {
    return effort.step_s;
  }
  return effort.corrections < 0 ? static_cast<double>(info.dt) : info.frame_step_s;
}

Tissue::Tissue(const std::string &bundle, const Effort &effort)
    : model_(upt::Model::open(bundle)), step_s_(length_of_step(model_, effort)),
      scene_(make_scene(model_, effort, step_s_)), clock_(step_s_), surgery_(model_) {
  clock_.load([this](upt::Input &input, double moment) { load(input, moment); });
  try {
    upt_instrument far = upt::sphere(1.0F);
    far.position[0] = 1e4F;
    scene_.step({&far, 1});
    scene_.reset();
  } catch (const upt::error &error) {
    // No linear response, or a library without feature "instruments".
    if (error.status() != UPT_ERR_UNSUPPORTED) {
      throw;
    }
    solves_contact_ = false;
  }
  // Only the surface is drawn, so only the surface is worked out.
  const std::vector<std::uint32_t> surface = model_.indices(UPT_SET_SURFACE_NODES);
  scene_.set_region(surface);
  const std::vector<float> positions = model_.positions();
  std::vector<std::uint32_t> vertex_of(positions.size() / 3, 0);
  for (std::size_t vertex = 0; vertex < surface.size(); vertex++) {
    vertex_of[surface[vertex]] = static_cast<std::uint32_t>(vertex);
    const float *p = &positions[3 * static_cast<std::size_t>(surface[vertex])];
    rest_.insert(rest_.end(), p, p + 3);
  }
  faces_ = model_.indices(UPT_SET_SURFACE_FACES);
  for (std::uint32_t &node : faces_) {
    node = vertex_of[node];
  }
  displacement_.assign(rest_.size(), 0);
  nodes_.assign(surface.size(), 0);
  vectors_.assign(rest_.size(), 0);
}

static float up(float amplitude, double period, double now) {
  return 0.5F * amplitude * (1 - std::cos(static_cast<float>(6.283185307 * now / period)));
}

void Tissue::breathe(float amplitude, double period) {
  if (surgery_.has_begun() && amplitude != 0) {
    throw std::runtime_error("breathe: a tool changes the body");
  }
  if (!(period > 0.1) || !(std::fabs(amplitude) < 100)) {
    throw std::runtime_error("breathe: a period above 0.1 s and less than 100 mm");
  }
  amplitude_ = amplitude;
  period_ = period;
}

// A vector of the world in the frame of a tool: q* v q, by v + 2 q.xyz x (q.xyz x v - w v).
static void turn_back(const float q[4], float v[3]) {
  const float w = q[3];
  const float c[3] = {q[1] * v[2] - q[2] * v[1] - w * v[0], q[2] * v[0] - q[0] * v[2] - w * v[1],
                      q[0] * v[1] - q[1] * v[0] - w * v[2]};
  const float d[3] = {q[1] * c[2] - q[2] * c[1], q[2] * c[0] - q[0] * c[2],
                      q[0] * c[1] - q[1] * c[0]};
  for (int k = 0; k < 3; k++) {
    v[k] += 2 * d[k];
  }
}

std::size_t Tissue::hang(const float place[3], float radius, float stiffness, float tears_at) {
  if (!in_hand || kind != Kind::press) {
    throw std::runtime_error("hang: press a tool first, to which the tissue is tied");
  }
  wait();
  auto region = upt::make<upt_bed>();
  std::copy(place, place + 3, region.centre);
  region.centre[2] -= height_; // the library has it in the organ's frame
  region.radius_mm = radius;
  region.stiffness = stiffness;
  region.break_mn = tears_at;
  bed_ = scene_.bed(region);
  torn_ = 0;
  for (upt_tie &tie : bed_) {
    for (int k = 0; k < 3; k++) {
      tie.place[k] -= tool.position[k] - (k == 2 ? height_ : 0);
    }
    turn_back(tool.rotation, tie.place);
    tie.to = UPT_END_INSTRUMENT;
  }
  return bed_.size();
}

void Tissue::lead(const upt_support &group) {
  const auto known = std::find_if(groups_.begin(), groups_.end(),
                                  [&](const upt_support &own) { return own.group == group.group; });
  if (known != groups_.end()) {
    *known = group;
  } else {
    groups_.push_back(group);
  }
}

// A step begins: where what holds the organ is then, and what the tool does to the body.
void Tissue::load(upt::Input &input, double moment) {
  if (amplitude_ != 0) {
    const float position[3] = {0, 0, up(amplitude_, period_, moment)}, rotation[4] = {0, 0, 0, 1};
    input.support(position, rotation);
  }
  if (!groups_.empty()) {
    input.supports(groups_);
  }
  if (in_hand) {
    input.ties(bed_); // to the tool of this step
  }
  if (surgery_.has_begun()) {
    surgery_.operate(scene_, kind, in_hand ? &tool : nullptr, step_s_);
  }
}

void Tissue::frame(double now) {
  height_ = solves_contact_ ? up(amplitude_, period_, now) : 0;
  upt_instrument framed = tool; // the library has it in the organ's frame
  framed.position[2] -= height_;
  const bool presses = kind == Kind::press;
  const upt::span<const upt_instrument> tools(&framed, in_hand && presses ? 1 : 0);
  if (!solves_contact_) {
    follow(now, upt::span<const upt_instrument>(&framed, in_hand ? 1 : 0));
    return;
  }
  if ((!presses || surgery_.limit > 0) && !surgery_.has_begun()) {
    if (amplitude_ != 0) {
      throw std::runtime_error(
          "what holds the organ moves: breathe(0, 1) before a tool changes it");
    }
    wait();
    surgery_.begin(scene_);
    take_surface();
  }
  if (surgery_.has_begun()) {
    clock_.frame(scene_, now, tools, surgery_.surface(), displacement_);
  } else {
    clock_.frame(scene_, now, tools, displacement_);
  }
  const bool is_changed = taken_ != surgery_.changes();
  if (is_changed) {
    take_surface();
  }
  const std::size_t in_step = clock_.landed_instruments();
  // Another body has made no step yet: the tool feels what it felt.
  if (clock_.landed() && (!is_changed || in_step == 0)) {
    reading_ = in_step > 0 ? scene_.readings(in_step).front() : upt_instrument_reading{};
    if (in_step > 0 && !bed_.empty()) {
      const auto ties = scene_.tie_readings(bed_.size());
      torn_ = static_cast<std::size_t>(std::count_if(
          ties.begin(), ties.end(), [](const upt_tie_reading &tie) { return tie.broken != 0; }));
    }
  }
  if (!presses) {
    std::copy(surgery_.force().begin(), surgery_.force().end(), reading_.force);
  }
}

bool Tissue::undo() {
  wait();
  const bool is_undone = surgery_.undo(scene_);
  if (is_undone) {
    take_surface();
    // Until the next frame: the body's last state.
    scene_.surface_positions(displacement_);
    for (std::size_t i = 0; i < rest_.size(); i++) {
      displacement_[i] -= rest_[i];
    }
  }
  return is_undone;
}

// What is shown is the surface of the body as it is now: faces that were outside, then those that
// were inside.
void Tissue::take_surface() {
  const upt::Surface &surface = surgery_.surface();
  taken_ = surgery_.changes();
  rest_ = surface.rest;
  displacement_.resize(rest_.size());
  faces_.clear();
  for (std::uint8_t inside = 0; inside < 2; inside++) {
    outside_ = faces_.size();
    for (std::size_t slot = 0; slot < surface.inside.size(); slot++) {
      const std::uint32_t *corners = &surface.triangles[3 * slot];
      if (surface.inside[slot] == inside && corners[0] != corners[1]) {
        faces_.insert(faces_.end(), corners, corners + 3);
      }
    }
  }
}

// As upt::FrameClock::frame, for a bundle that a collision field drives: between its last two
// steps.
void Tissue::follow(double now, upt::span<const upt_instrument> tools) {
  clock_.moved(now, tools);
  if (clock_.in_flight() && upt_scene_poll(scene_.get()) != UPT_PENDING) {
    clock_.finished();
    counted_steps_ = stats().step_count;
    reading_.contact_count = static_cast<std::uint32_t>(contact_count_);
  }
  // It may have landed since it was asked.
  const bool landed = clock_.in_flight() && stats().step_count != counted_steps_;
  const double since = landed ? std::max(0.0, now - clock_.step_time()) : clock_.since(now);
  scene_.sample(std::min(1.0, since / step_s_), displacement_);
  if (clock_.due(now)) {
    scene_.contacts_from_instruments(clock_.start(now), nodes_, vectors_, contact_count_);
    scene_.submit(upt::Input::contacts({nodes_.data(), contact_count_},
                                       {vectors_.data(), 3 * contact_count_}));
  }
}

void Tissue::wait() {
  if (clock_.in_flight()) {
    scene_.wait(0xFFFFFFFF);
  }
}
