#include "camera.hpp"

#include <algorithm>

void Camera::frame(Vec3 target, float radius, Vec3 from) {
  const Vec3 side = normalized(from);
  target_ = target;
  distance_ = 1.15F * radius / std::sin(half_angle_);
  around_ = std::atan2(side.y, side.x);
  over_ = std::asin(std::clamp(side.z, -0.95F, 0.95F));
}

void Camera::orbit(float around, float over) {
  around_ += around;
  over_ = std::clamp(over_ + over, -1.4F, 1.4F);
}

void Camera::zoom(float factor) { distance_ = std::clamp(distance_ * factor, 40.0F, 1200.0F); }

void Camera::set_size(int width, int height) {
  aspect_ = static_cast<float>(width) / static_cast<float>(std::max(height, 1));
}

Frame Camera::axes() const {
  const Vec3 back = {std::cos(over_) * std::cos(around_), std::cos(over_) * std::sin(around_),
                     std::sin(over_)};
  return frame_around(back, {0, 0, 1});
}

Vec3 Camera::eye() const { return target_ + axes().z * distance_; }

Mat4 Camera::matrix() const {
  const Frame a = axes();
  const Vec3 e = eye();
  const Mat4 view = {a.x.x, a.y.x, a.z.x, 0, a.x.y,        a.y.y,        a.z.y,        0,
                     a.x.z, a.y.z, a.z.z, 0, -dot(a.x, e), -dot(a.y, e), -dot(a.z, e), 1};
  const float near = 5, far = 2500, f = 1 / std::tan(half_angle_);
  const Mat4 projection = {f / aspect_,
                           0,
                           0,
                           0,
                           0,
                           f,
                           0,
                           0,
                           0,
                           0,
                           (far + near) / (near - far),
                           -1,
                           0,
                           0,
                           2 * far * near / (near - far),
                           0};
  return projection * view;
}

Ray Camera::ray(float x, float y) const {
  const Frame a = axes();
  const float t = std::tan(half_angle_);
  return {eye(), normalized(a.x * (x * t * aspect_) + a.y * (y * t) - a.z)};
}
