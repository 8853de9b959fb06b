// Draws the tissue, the spatula and the numbers.
#pragma once

#include "bladder.hpp"
#include "camera.hpp"
#include "cutter.hpp"
#include "overlay.hpp"
#include "spatula.hpp"
#include "tissue.hpp"

// The flags of a step in words.
std::string flag_names(std::uint32_t flags);

class View {
public:
  // Colours span 0 to `scale_mm` of displacement.
  void create(const Tissue &tissue, float scale_mm);
  void draw(const Tissue &tissue, const Spatula &spatula, const Cutter &cutter,
            const Bladder &bladder, const Camera &camera, int width, int height, double frame_ms);

private:
  void draw_background();
  void draw_tissue(const Tissue &tissue, const Mat4 &matrix, Vec3 eye);
  void draw_metal(const gl::Vertices &metal, GLsizei count, const Mat4 &place, const Mat4 &matrix,
                  Vec3 eye, Vec3 tint);
  void draw_bladder(const Tissue &tissue, const Bladder &bladder, const Mat4 &matrix, Vec3 eye);
  void draw_numbers(const Tissue &tissue, const Spatula &spatula, const Cutter &cutter,
                    const Bladder &bladder, int width, int height, double frame_ms);
  void draw_work(const Tissue &tissue, const Cutter &cutter, const Bladder &bladder, int height);

  void draw_ghost(const Tissue &tissue, const Mat4 &matrix, Vec3 eye);

  GLuint tissue_program_ = 0, ghost_program_ = 0, metal_program_ = 0, background_program_ = 0;
  gl::Vertices tissue_, ghost_, metal_, blade_, tube_, bladder_, background_;
  GLsizei metal_count_ = 0, blade_count_ = 0, tube_count_ = 0;
  std::int64_t uploaded_ = 0; // of the body's surfaces, the one whose triangles are drawn
  Overlay overlay_;
  float scale_mm_ = 10;
};
