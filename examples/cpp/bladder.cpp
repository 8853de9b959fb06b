#include "bladder.hpp"

#include <algorithm>

namespace {

const float GAP = 0.5F;                       // between the tissue and the ball, mm
const float REGION = 15;                      // of the bed, mm
const float STIFFNESS = 300, STRENGTH = 1000; // of the whole bed: N/m, mN
const float SPEED = 10;                       // at which forceps draw it off, mm/s
const float TURN = 12;                        // on which way it turns by a radian, mm
const int ROUND = 32;                         // corners of the ball's equator

Vec3 vector(const float *values) { return {values[0], values[1], values[2]}; }

void put(float *out, Vec3 place) {
  out[0] = place.x;
  out[1] = place.y;
  out[2] = place.z;
}

void corner(std::vector<float> &out, Vec3 place, Vec3 normal) {
  out.insert(out.end(), {place.x, place.y, place.z, normal.x, normal.y, normal.z});
}

} // namespace

void Bladder::hang(Tissue &tissue, const Hit &site) {
  around_ = frame_around(site.normal, {0, 0, 1});
  site_ = site.rest + around_.z * GAP;
  auto region = upt::make<upt_bed>();
  put(region.centre, site.rest);
  region.radius_mm = REGION;
  region.stiffness = STIFFNESS;
  region.break_mn = STRENGTH;
  bed_ = tissue.scene().bed(region);
  for (upt_tie &tie : bed_) {
    roots_.push_back(tissue.vertex_of(tie.nodes[0]));
    put(tie.place, vector(tie.place) - place()); // in the ball's frame
    tie.to = UPT_END_INSTRUMENT;
    tie.instrument = 0;
  }
  readings_.assign(bed_.size(), upt::make<upt_tie_reading>());
  tissue.tie(bed_);
}

float Bladder::angle() const { return drawn_ / TURN; }

Vec3 Bladder::turned(Vec3 way) const {
  const Vec3 axis = around_.x, side = cross(axis, way);
  return way + side * std::sin(angle()) + cross(axis, side) * (1 - std::cos(angle()));
}

void Bladder::move(float seconds, bool drawn) { drawn_ += held_ && drawn ? SPEED * seconds : 0; }

std::vector<upt_instrument> Bladder::with(const Tissue &tissue, double now,
                                          const std::vector<upt_instrument> &instruments) const {
  if (!hangs()) {
    return instruments;
  }
  upt_instrument ball = upt::sphere(RADIUS);
  put(ball.position, place() + Vec3{0, 0, tissue.height_at(now)});
  const Vec3 axis = around_.x * std::sin(0.5F * angle());
  put(ball.rotation, axis);
  ball.rotation[3] = std::cos(0.5F * angle());
  std::vector<upt_instrument> all{ball};
  all.insert(all.end(), instruments.begin(), instruments.end());
  return all;
}

void Bladder::read(Tissue &tissue) {
  if (!hangs() || tissue.stats().step_count == 0) {
    return;
  }
  tissue.scene().tie_readings(readings_);
  Vec3 sum{};
  torn_ = 0;
  for (const upt_tie_reading &tie : readings_) {
    torn_ += tie.broken;
    sum = sum + vector(tie.force);
  }
  pull_ = length(sum);
}

void Bladder::reset() {
  drawn_ = pull_ = 0;
  torn_ = 0;
  readings_.assign(bed_.size(), upt::make<upt_tie_reading>());
}

std::vector<float> Bladder::ball(const Tissue &tissue) const {
  const Vec3 middle = place() + Vec3{0, 0, tissue.height()};
  const auto normal = [](int around, int up) {
    const float a = 6.2831853F * static_cast<float>(around) / ROUND,
                b = 6.2831853F * static_cast<float>(up) / ROUND;
    return Vec3{std::cos(a) * std::sin(b), std::sin(a) * std::sin(b), std::cos(b)};
  };
  std::vector<float> out;
  for (int around = 0; around < ROUND; around++) {
    for (int up = 0; up < ROUND / 2; up++) {
      const int corners[6][2] = {{0, 0}, {0, 1}, {1, 1}, {0, 0}, {1, 1}, {1, 0}};
      for (const auto &[side, above] : corners) {
        const Vec3 n = normal(around + side, up + above);
        corner(out, middle + n * RADIUS, n);
      }
    }
  }
  return out;
}

// Each with three sides, from the tissue, where it is shown, to the ball.
std::vector<float> Bladder::threads(const Tissue &tissue) const {
  std::vector<float> out;
  for (std::size_t tie = 0; tie < bed_.size(); tie++) {
    if (readings_[tie].broken != 0) {
      continue;
    }
    const Vec3 from = tissue.position(roots_[tie]);
    const Vec3 towards = normalized(turned(vector(bed_[tie].place)));
    const Vec3 to = place() + towards * RADIUS + Vec3{0, 0, tissue.height()};
    const Frame frame = frame_around(to - from, {0, 0, 1});
    const auto side = [&](int which) {
      const float a = 2.0943951F * static_cast<float>(which);
      return frame.x * std::cos(a) + frame.y * std::sin(a);
    };
    for (int which = 0; which < 3; which++) {
      const Vec3 n = side(which), m = side(which + 1);
      const Vec3 ends[6] = {from + n * 0.35F, to + n * 0.35F, to + m * 0.35F,
                            from + n * 0.35F, to + m * 0.35F, from + m * 0.35F};
      for (int i = 0; i < 6; i++) {
        corner(out, ends[i], i == 0 || i == 1 || i == 3 ? n : m);
      }
    }
  }
  return out;
}
