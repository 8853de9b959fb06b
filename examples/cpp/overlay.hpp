// Text and bars over the picture, in pixels from the upper left corner; a 5x7 bitmap font of
// capitals.
#pragma once

#include <string>
#include <vector>

#include "gl.hpp"
#include "vec.hpp"

class Overlay {
public:
  void create();
  void begin(int width, int height);
  void text(float x, float y, float scale, const std::string &text, Vec3 colour);
  void box(float x, float y, float width, float height, Vec3 colour);
  void draw();

private:
  GLuint program_ = 0;
  gl::Vertices vertices_;
  std::vector<float> data_; // x, y, r, g, b
  int width_ = 1, height_ = 1;
};
