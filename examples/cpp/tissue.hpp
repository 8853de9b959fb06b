// The deforming tissue: libupt steps on the scene's own worker, each frame shows the tissue at its
// own moment. Where a bundle does not solve contact a frame lies between the last two steps. Tools
// may change the body: then its surface is another one.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "camera.hpp"
#include "surgery.hpp"
#include "upt.hpp"
#include "vec.hpp"

// What the spatula does in the next step: nodes and their displacement, mm.
struct Contacts {
  std::vector<std::uint32_t> nodes;
  std::vector<float> vectors;
};

// A point of the surface.
struct Hit {
  Vec3 point;  // in the deformed surface
  Vec3 rest;   // the same point at rest
  Vec3 normal; // outward, at rest, smoothed
  bool domain; // whether instruments may touch here
};

class Tissue {
public:
  explicit Tissue(const std::string &bundle);

  // Starts a step when the last one has finished and its time has come. `now`: seconds.
  void advance(double now, const Contacts &contacts);
  // A frame with rigid instruments whose contact the library solves: the surface at `now`, and the
  // next step when it is due.
  void frame(double now, upt::span<const upt_instrument> instruments);
  // From the next step on a tool changes the body as `kind` says; null: it is lifted.
  void work(Kind kind, const upt_instrument *tool);
  // The body before the last stroke; false where there is none.
  bool undo();
  const Surgery &surgery() const { return surgery_; }
  // Whether the bundle and this build solve contact: then instruments drive the steps.
  bool solves_contact() const { return solves_contact_; }
  // Whether tools may change the body: not while what holds it moves, and not while it bears a bed.
  bool can_be_cut() const { return solves_contact_ && !breathes_ && ties_.empty(); }
  // What the tissue did to the first tool of the last finished step; none: it had none.
  const std::optional<upt_instrument_reading> &reading() const { return reading_; }
  // Waits for the step in flight (for pictures that must not depend on the machine's speed).
  void finish();
  // Positions, normals and displacements of the surface at `now`.
  void sample(double now);

  std::optional<Hit> pick(const Ray &ray) const;
  // A good place for a scripted push.
  Hit flat_site() const;
  Vec3 centre() const { return centre_; }
  float radius() const { return radius_; }

  upt::Scene &scene() { return scene_; }
  const upt_model_info &info() const { return info_; }
  upt_scene_stats stats() const { return scene_.stats(); }
  upt_scene_timing timing() const { return scene_.timing(); }
  void reset();
  // From now on what holds the organ goes up and down by 15 mm in four seconds.
  void breathe();
  // How far up the organ's frame is in the last frame, and at a moment, mm.
  float height() const { return height_; }
  float height_at(double now) const;
  // From now on each step has these ties, on an instrument that comes before all tools.
  void tie(const std::vector<upt_tie> &ties) { ties_ = ties; }
  // Of the surface: where a vertex is in the last frame, and that of a node of the mesh.
  Vec3 position(std::uint32_t vertex) const;
  std::uint32_t vertex_of(std::uint32_t node) const;

  // Per surface vertex: position 3, normal 3, displacement 1, cavity 1 (above 0 in a sulcus).
  static constexpr std::size_t VERTEX_FLOATS = 8;
  const std::vector<float> &vertices() const { return vertices_; }
  // The surface at rest; per vertex: position 3, normal 3, present displacement 1.
  static constexpr std::size_t GHOST_FLOATS = 7;
  const std::vector<float> &ghost() const { return ghost_; }
  // Three a triangle, indices of surface vertices; the first `outside` of them were on the surface
  // of the intact body, the others inside.
  const std::vector<std::uint32_t> &triangles() const { return triangles_; }
  std::size_t outside() const { return outside_; }
  // All nodes of the mesh, and those that instruments may touch.
  const std::vector<Vec3> &nodes() const { return nodes_; }
  const std::vector<std::uint32_t> &domain() const { return domain_; }
  float max_displacement() const { return max_displacement_; }
  double median_step_ms() const;

private:
  void load(upt::Input &input, double moment);
  void take_surface();
  void find_rest();
  void find_cavities();
  void find_bounds();
  void sum_normals();
  void count_step(std::size_t instruments);
  void fill(const std::vector<float> &displacement);

  upt::Model model_;
  upt::Scene scene_;
  upt_model_info info_;
  upt::FrameClock clock_;
  Surgery surgery_;
  std::vector<Vec3> rest_;             // of surface vertices
  std::vector<Vec3> nodes_;            // of the mesh, at rest
  std::vector<std::uint32_t> domain_;  // nodes that instruments may touch
  std::vector<bool> vertex_in_domain_; // per surface vertex
  std::vector<std::uint32_t> triangles_;
  std::size_t outside_ = 0;
  std::vector<bool> vertex_outside_; // per surface vertex: of a triangle that was outside
  std::vector<Vec3> rest_normals_;
  std::vector<float> displacement_, vertices_, ghost_, cavity_;
  std::vector<double> step_ms_;
  Vec3 centre_;
  float radius_ = 0, max_displacement_ = 0;
  bool in_flight_ = false, solves_contact_ = true;
  std::optional<upt_instrument_reading> reading_;
  std::uint64_t counted_steps_ = 0;
  Kind kind_ = Kind::press;
  std::optional<upt_instrument> tool_; // that changes the body
  std::int64_t taken_ = 0;             // of the body's surfaces, the one that is shown
  bool breathes_ = false;
  std::vector<upt_tie> ties_;
  float height_ = 0;
  double last_start_ = -1e9;
};
