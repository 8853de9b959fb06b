// An orbiting camera: looks at a target from a direction; turns mouse positions into rays.
#pragma once

#include "vec.hpp"

struct Ray {
  Vec3 origin, direction;
};

class Camera {
public:
  // Sees a ball of `radius` mm around `target` from the side `from`.
  void frame(Vec3 target, float radius, Vec3 from);
  // Turns by angles, radians.
  void orbit(float around, float over);
  void zoom(float factor);
  void set_size(int width, int height);

  Vec3 eye() const;
  Mat4 matrix() const;
  // x, y: from -1 to 1, y up.
  Ray ray(float x, float y) const;

private:
  Frame axes() const;

  Vec3 target_;
  float distance_ = 300, around_ = 0, over_ = 0, aspect_ = 1;
  float half_angle_ = 0.28F;
};
