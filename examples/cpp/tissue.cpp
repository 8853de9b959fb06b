#include "tissue.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

static constexpr std::size_t STRIDE = Tissue::VERTEX_FLOATS;

static Vec3 at(const std::vector<float> &values, std::size_t index, std::size_t stride = 3) {
  return {values[stride * index], values[stride * index + 1], values[stride * index + 2]};
}

// Frames lag less behind steps of the length that the bundle recommends for them.
static upt::Scene make_scene(const upt::Model &model) {
  auto options = upt::make<upt_scene_options>();
  options.step_s = model.info().frame_step_s;
  return upt::Scene(model, &options);
}

Tissue::Tissue(const std::string &bundle)
    : model_(upt::Model::open(bundle)), scene_(make_scene(model_)), info_(model_.info()),
      clock_(info_.frame_step_s), surgery_(model_) {
  domain_ = model_.indices(UPT_SET_DOMAIN_NODES);
  const std::vector<float> positions = model_.positions();
  for (std::size_t node = 0; node < info_.node_count; node++) {
    nodes_.push_back(at(positions, node));
  }

  // A bundle without a linear response has nothing to solve contact with; a library may lack the
  // feature.
  try {
    upt_instrument far = upt::sphere(1.0F);
    far.position[0] = 1e4F;
    scene_.step({&far, 1});
    scene_.reset();
  } catch (const upt::error &error) {
    if (error.status() != UPT_ERR_UNSUPPORTED) {
      throw;
    }
    solves_contact_ = false;
  }

  // Only the surface is drawn, so only the surface is decoded.
  const std::vector<std::uint32_t> surface = model_.indices(UPT_SET_SURFACE_NODES);
  scene_.set_region(surface);
  std::vector<std::uint32_t> vertex_of(nodes_.size(), 0);
  for (std::size_t vertex = 0; vertex < surface.size(); vertex++) {
    vertex_of[surface[vertex]] = static_cast<std::uint32_t>(vertex);
    rest_.push_back(nodes_[surface[vertex]]);
  }
  triangles_ = model_.indices(UPT_SET_SURFACE_FACES);
  for (std::uint32_t &node : triangles_) {
    node = vertex_of[node];
  }
  outside_ = triangles_.size();
  vertex_in_domain_.assign(rest_.size(), false);
  for (const std::uint32_t node : domain_) {
    vertex_in_domain_[vertex_of[node]] = true;
  }
  find_rest();
  displacement_.assign(3 * rest_.size(), 0);
  fill(displacement_);
  find_bounds();
  clock_.load([this](upt::Input &input, double moment) { load(input, moment); });
}

void Tissue::find_bounds() {
  Vec3 low = nodes_[0], high = nodes_[0];
  for (const Vec3 &p : nodes_) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  centre_ = (low + high) * 0.5F;
  radius_ = 0.5F * length(high - low);
}

// All of the surface that does not change with its displacement.
void Tissue::find_rest() {
  vertex_outside_.assign(rest_.size(), false);
  for (std::size_t i = 0; i < outside_; i++) {
    vertex_outside_[triangles_[i]] = true;
  }
  cavity_.assign(rest_.size(), 0);
  vertices_.assign(STRIDE * rest_.size(), 0);
  ghost_.assign(GHOST_FLOATS * rest_.size(), 0);
  fill(std::vector<float>(3 * rest_.size(), 0));
  rest_normals_.clear();
  for (std::size_t vertex = 0; vertex < rest_.size(); vertex++) {
    const float *normal = &vertices_[STRIDE * vertex + 3];
    rest_normals_.push_back(normalized({normal[0], normal[1], normal[2]}));
    const Vec3 p = rest_[vertex], n = rest_normals_.back();
    const float values[GHOST_FLOATS] = {p.x, p.y, p.z, n.x, n.y, n.z, 0};
    std::copy(values, values + GHOST_FLOATS, &ghost_[GHOST_FLOATS * vertex]);
  }
  find_cavities();
}

// Where neighbours stand above a vertex's tangent plane there is a sulcus; it is drawn darker. The
// mean slope over the edges, smoothed once.
void Tissue::find_cavities() {
  std::vector<float> slope(rest_.size(), 0), sum(rest_.size(), 0), count(rest_.size(), 0);
  const auto each_edge = [&](auto visit) {
    for (std::size_t i = 0; i < outside_; i += 3) {
      for (int corner = 0; corner < 3; corner++) {
        visit(triangles_[i + corner], triangles_[i + (corner + 1) % 3]);
      }
    }
  };
  each_edge([&](std::uint32_t a, std::uint32_t b) {
    slope[a] += dot(rest_normals_[a], normalized(rest_[b] - rest_[a]));
    count[a] += 1;
  });
  for (std::size_t vertex = 0; vertex < rest_.size(); vertex++) {
    slope[vertex] /= std::max(count[vertex], 1.0F);
  }
  each_edge([&](std::uint32_t a, std::uint32_t b) { sum[a] += slope[b]; });
  for (std::size_t vertex = 0; vertex < rest_.size(); vertex++) {
    cavity_[vertex] = 0.5F * (slope[vertex] + sum[vertex] / std::max(count[vertex], 1.0F));
  }
}

void Tissue::advance(double now, const Contacts &contacts) {
  if (in_flight_) {
    if (scene_.poll() == UPT_PENDING) {
      return; // the frame does not wait
    }
    in_flight_ = false;
    count_step(0);
  }
  if (now - last_start_ + 1e-9 >= info_.frame_step_s) {
    scene_.submit(upt::Input::contacts(contacts.nodes, contacts.vectors));
    in_flight_ = true;
    last_start_ = std::max(last_start_ + info_.frame_step_s, now - info_.frame_step_s);
  }
}

float Tissue::height_at(double now) const {
  return breathes_ ? 7.5F * (1 - std::cos(1.5707963F * static_cast<float>(now))) : 0;
}

void Tissue::breathe() { breathes_ = true; }

// A step begins, and none is in flight: where what holds the organ is then, and what a tool does to
// the body.
void Tissue::load(upt::Input &input, double moment) {
  if (breathes_) {
    const float position[3] = {0, 0, height_at(moment)}, rotation[4] = {0, 0, 0, 1};
    input.support(position, rotation);
  }
  input.ties(ties_);
  if (surgery_.has_begun()) {
    surgery_.operate(scene_, kind_, tool_ ? &*tool_ : nullptr, info_.frame_step_s);
  }
}

void Tissue::work(Kind kind, const upt_instrument *tool) {
  kind_ = kind;
  tool_ = tool != nullptr ? std::make_optional(*tool) : std::nullopt;
  if (kind == Kind::press || surgery_.has_begun()) {
    return;
  }
  if (!can_be_cut()) {
    throw std::runtime_error(solves_contact_
                                 ? "no cuts while the organ breathes or something hangs on it"
                                 : "this bundle has no corrections: its body cannot be cut");
  }
  finish();
  surgery_.begin(scene_);
  take_surface();
}

// The body's surface as it is now: triangles that were outside, then those that were inside.
void Tissue::take_surface() {
  const upt::Surface &surface = surgery_.surface();
  taken_ = surgery_.changes();
  rest_.clear();
  for (std::size_t vertex = 0; vertex < surface.rest.size() / 3; vertex++) {
    rest_.push_back(at(surface.rest, vertex));
  }
  triangles_.clear();
  for (std::uint8_t inside = 0; inside < 2; inside++) {
    for (std::size_t slot = 0; slot < surface.inside.size(); slot++) {
      const std::uint32_t *corners = &surface.triangles[3 * slot];
      if (surface.inside[slot] == inside && corners[0] != corners[1]) {
        triangles_.insert(triangles_.end(), corners, corners + 3);
      }
    }
    outside_ = inside == 0 ? triangles_.size() : outside_;
  }
  // The first vertices are the mesh's nodes, the others lips of cuts.
  vertex_in_domain_.assign(rest_.size(), true);
  std::fill_n(vertex_in_domain_.begin(), nodes_.size(), false);
  for (const std::uint32_t node : domain_) {
    vertex_in_domain_[node] = true;
  }
  find_rest();
  displacement_.resize(3 * rest_.size());
  fill(displacement_);
}

bool Tissue::undo() {
  finish();
  return surgery_.undo(scene_);
}

void Tissue::frame(double now, upt::span<const upt_instrument> instruments) {
  // The library has all of it in the organ's frame, the mouse is in the world.
  height_ = height_at(now);
  std::vector<upt_instrument> framed(instruments.begin(), instruments.end());
  for (upt_instrument &instrument : framed) {
    instrument.position[2] -= height_;
  }
  if (surgery_.has_begun()) {
    clock_.frame(scene_, now, framed, surgery_.surface(), displacement_);
  } else {
    clock_.frame(scene_, now, framed, displacement_);
  }
  if (taken_ != surgery_.changes()) {
    take_surface();
  } else {
    fill(displacement_);
  }
  if (clock_.landed()) {
    count_step(clock_.landed_instruments());
  }
}

void Tissue::reset() {
  finish();
  if (solves_contact_) {
    clock_.reset(scene_);
    surgery_.reset(scene_);
  } else {
    scene_.reset();
  }
  reading_.reset();
}

void Tissue::finish() {
  if (clock_.in_flight()) {
    scene_.wait(60000);
  }
  if (in_flight_) {
    scene_.wait(60000);
    in_flight_ = false;
    count_step(0);
  }
}

void Tissue::count_step(std::size_t instruments) {
  const auto last = stats();
  reading_.reset();
  const std::size_t tool = ties_.empty() ? 0 : 1;
  if (instruments > tool) {
    reading_ = scene_.readings(instruments)[tool];
  }
  counted_steps_ = last.step_count;
  step_ms_.push_back(scene_.timing().step_ms);
}

void Tissue::sample(double now) {
  const auto steps = stats().step_count;
  if (steps > 0) {
    // While the step runs the last state stays; once it has published, it is approached from the
    // one before, even if poll() has not told yet.
    const bool running = in_flight_ && steps == counted_steps_;
    const double alpha = running ? 1.0 : (now - last_start_) / info_.frame_step_s;
    scene_.sample(std::clamp(alpha, 0.0, 1.0), displacement_);
  }
  fill(displacement_);
}

void Tissue::fill(const std::vector<float> &displacement) {
  max_displacement_ = 0;
  for (std::size_t vertex = 0; vertex < rest_.size(); vertex++) {
    const Vec3 u = at(displacement, vertex);
    const Vec3 p = rest_[vertex] + u + Vec3{0, 0, height_};
    const float size = length(u);
    const float values[STRIDE] = {p.x, p.y, p.z, 0, 0, 0, size, cavity_[vertex]};
    std::copy(values, values + STRIDE, &vertices_[STRIDE * vertex]);
    ghost_[GHOST_FLOATS * vertex + 2] = rest_[vertex].z + height_;
    ghost_[GHOST_FLOATS * vertex + 6] = size;
    max_displacement_ = std::max(max_displacement_, size);
  }
  sum_normals();
}

// Vertex normals: the sum of the faces' area vectors. A lip is lit as the outside that it was.
void Tissue::sum_normals() {
  for (std::size_t i = 0; i < triangles_.size(); i += 3) {
    const Vec3 a = position(triangles_[i]), b = position(triangles_[i + 1]),
               c = position(triangles_[i + 2]);
    const Vec3 area = cross(b - a, c - a);
    for (int corner = 0; corner < 3; corner++) {
      const std::uint32_t vertex = triangles_[i + corner];
      if (i < outside_ || !vertex_outside_[vertex]) {
        float *normal = &vertices_[STRIDE * vertex + 3];
        normal[0] += area.x;
        normal[1] += area.y;
        normal[2] += area.z;
      }
    }
  }
}

Vec3 Tissue::position(std::uint32_t vertex) const { return at(vertices_, vertex, STRIDE); }

std::uint32_t Tissue::vertex_of(std::uint32_t node) const {
  const auto is_there = [&](Vec3 rest) { return length(rest - nodes_[node]) == 0; };
  return static_cast<std::uint32_t>(
      std::distance(rest_.begin(), std::find_if(rest_.begin(), rest_.end(), is_there)));
}

std::optional<Hit> Tissue::pick(const Ray &ray) const {
  float nearest = std::numeric_limits<float>::max();
  std::optional<Hit> hit;
  for (std::size_t i = 0; i < triangles_.size(); i += 3) {
    const std::uint32_t *v = &triangles_[i];
    const Vec3 a = position(v[0]), e1 = position(v[1]) - a, e2 = position(v[2]) - a;
    const Vec3 p = cross(ray.direction, e2);
    const float determinant = dot(e1, p);
    if (determinant <= 1e-9F) {
      continue; // from behind, or edge on
    }
    const Vec3 s = ray.origin - a;
    const float beta = dot(s, p) / determinant;
    const Vec3 q = cross(s, e1);
    const float gamma = dot(ray.direction, q) / determinant, distance = dot(e2, q) / determinant;
    if (beta < 0 || gamma < 0 || beta + gamma > 1 || distance <= 0 || distance >= nearest) {
      continue;
    }
    nearest = distance;
    const float alpha = 1 - beta - gamma;
    const Vec3 rest = rest_[v[0]] * alpha + rest_[v[1]] * beta + rest_[v[2]] * gamma;
    const Vec3 normal = normalized(rest_normals_[v[0]] * alpha + rest_normals_[v[1]] * beta +
                                   rest_normals_[v[2]] * gamma);
    const bool domain =
        vertex_in_domain_[v[0]] && vertex_in_domain_[v[1]] && vertex_in_domain_[v[2]];
    hit = Hit{ray.origin + ray.direction * distance, rest, normal, domain};
  }
  return hit;
}

// A flat crown near the domain's middle: many touchable nodes just under its tangent plane and
// nothing of the surface above it.
Hit Tissue::flat_site() const {
  Hit best{};
  Vec3 middle{};
  for (const std::uint32_t node : domain_) {
    middle = middle + nodes_[node] * (1.0F / static_cast<float>(domain_.size()));
  }
  float best_score = -std::numeric_limits<float>::max();
  for (std::size_t seed = 0; seed < rest_.size(); seed++) {
    if (!vertex_in_domain_[seed]) {
      continue;
    }
    const Vec3 point = rest_[seed];
    Vec3 normal{};
    for (std::size_t vertex = 0; vertex < rest_.size(); vertex++) {
      if (length(rest_[vertex] - point) < 8) {
        normal = normal + rest_normals_[vertex];
      }
    }
    normal = normalized(normal);
    float score = -0.25F * length(point - middle);
    for (std::size_t vertex = 0; vertex < rest_.size(); vertex++) {
      const Vec3 offset = rest_[vertex] - point;
      if (length(offset) < 16) {
        const float height = dot(offset, normal);
        const bool near = length(offset) < 8 && vertex_in_domain_[vertex] && height > -3;
        score += (near ? 1.0F : 0.0F) - std::max(height, 0.0F);
      }
    }
    if (score > best_score) {
      best_score = score;
      best = {point, point, normal, true};
    }
  }
  return best;
}

double Tissue::median_step_ms() const {
  if (step_ms_.empty()) {
    return 0;
  }
  std::vector<double> sorted = step_ms_;
  std::sort(sorted.begin(), sorted.end());
  return sorted[sorted.size() / 2];
}
