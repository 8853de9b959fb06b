// Three-vectors and 4x4 matrices (column-major, as OpenGL has them).
#pragma once

#include <array>
#include <cmath>

struct Vec3 {
  float x = 0, y = 0, z = 0;
};

inline Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec3 operator-(Vec3 a) { return {-a.x, -a.y, -a.z}; }
inline Vec3 operator*(Vec3 a, float s) { return {a.x * s, a.y * s, a.z * s}; }
inline float dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3 cross(Vec3 a, Vec3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline float length(Vec3 a) { return std::sqrt(dot(a, a)); }
inline Vec3 normalized(Vec3 a) {
  const float size = length(a);
  return size > 0 ? a * (1 / size) : Vec3{0, 0, 1};
}

// An orthonormal frame; `z` is the main direction.
struct Frame {
  Vec3 x, y, z;
};

// A frame around `z` with `y` as near to `up` as can be.
inline Frame frame_around(Vec3 z, Vec3 up) {
  const Vec3 main = normalized(z);
  Vec3 side = cross(up, main);
  if (length(side) < 1e-3F) {
    side = cross({1, 0, 0}, main);
  }
  const Vec3 x = normalized(side);
  return {x, cross(main, x), main};
}

// A frame's rotation as a unit quaternion x, y, z, w.
inline std::array<float, 4> quaternion(const Frame &f) {
  const float trace = f.x.x + f.y.y + f.z.z;
  std::array<float, 4> q;
  if (trace > 0) {
    const float s = 2 * std::sqrt(1 + trace);
    q = {(f.y.z - f.z.y) / s, (f.z.x - f.x.z) / s, (f.x.y - f.y.x) / s, s / 4};
  } else if (f.x.x > f.y.y && f.x.x > f.z.z) {
    const float s = 2 * std::sqrt(1 + f.x.x - f.y.y - f.z.z);
    q = {s / 4, (f.y.x + f.x.y) / s, (f.z.x + f.x.z) / s, (f.y.z - f.z.y) / s};
  } else if (f.y.y > f.z.z) {
    const float s = 2 * std::sqrt(1 + f.y.y - f.x.x - f.z.z);
    q = {(f.y.x + f.x.y) / s, s / 4, (f.z.y + f.y.z) / s, (f.z.x - f.x.z) / s};
  } else {
    const float s = 2 * std::sqrt(1 + f.z.z - f.x.x - f.y.y);
    q = {(f.z.x + f.x.z) / s, (f.z.y + f.y.z) / s, s / 4, (f.x.y - f.y.x) / s};
  }
  return q;
}

using Mat4 = std::array<float, 16>;

inline Mat4 operator*(const Mat4 &a, const Mat4 &b) {
  Mat4 out{};
  for (int column = 0; column < 4; column++) {
    for (int row = 0; row < 4; row++) {
      for (int k = 0; k < 4; k++) {
        out[4 * column + row] += a[4 * k + row] * b[4 * column + k];
      }
    }
  }
  return out;
}

inline Mat4 identity() { return {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}; }

// Model matrix of a frame at `origin`.
inline Mat4 placed(const Frame &frame, Vec3 origin) {
  return {frame.x.x, frame.x.y, frame.x.z, 0, frame.y.x, frame.y.y, frame.y.z, 0,
          frame.z.x, frame.z.y, frame.z.z, 0, origin.x,  origin.y,  origin.z,  1};
}
