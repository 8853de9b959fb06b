// Draws the tissue, the spatula and the numbers.
#pragma once

#include "camera.hpp"
#include "overlay.hpp"
#include "spatula.hpp"
#include "tissue.hpp"

// The flags of a step in words.
std::string flag_names(std::uint32_t flags);

class View {
public:
  // Colours span 0 to `scale_mm` of displacement.
  void create(const Tissue &tissue, float scale_mm);
  void draw(const Tissue &tissue, const Spatula &spatula, const Camera &camera, int width,
            int height, double frame_ms);

private:
  void draw_background();
  void draw_numbers(const Tissue &tissue, const Spatula &spatula, int width, int height,
                    double frame_ms);

  void draw_ghost(const Tissue &tissue, const Mat4 &matrix, Vec3 eye);

  GLuint tissue_program_ = 0, ghost_program_ = 0, metal_program_ = 0, background_program_ = 0;
  gl::Vertices tissue_, ghost_, metal_, background_;
  GLsizei index_count_ = 0, metal_count_ = 0;
  Overlay overlay_;
  float scale_mm_ = 10;
};
