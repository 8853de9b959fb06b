// The tissue of a SoftTissue3D, without Godot: libupt steps on the scene's own worker, each frame
// shows the surface at its own moment (upt::FrameClock). RAS, mm.
#pragma once

#include "surgery.hpp"
#include "upt.hpp"

#include <string>
#include <vector>

// How much work a step in contact gets; as upt_scene_options. Zeros: what the bundle recommends.
struct Effort {
  std::int64_t corrections = 0; // at most; -1: none, 0: as the bundle recommends
  double target_mm = 0;         // enough where the estimated error is below; with `corrections`
  std::int64_t substeps = 0;    // at most; from 2 with a target
  double step_s = 0;            // length of a step; zero with corrections: recommended for frames
};

class Tissue {
public:
  Tissue(const std::string &bundle, const Effort &effort);

  // One frame: the surface at `now` (s) with the tool where it is now. A step that has landed is
  // taken, the next one is started when it is due; neither is waited for.
  void frame(double now);
  // Until the step in flight has landed: for pictures that must not depend on the machine's speed.
  void wait();

  // What holds the organ goes up and down by so much (mm, z), once in `period` (s); 0: not at all.
  void breathe(float amplitude, double period);
  // How far up it is, mm: the displacements are in its frame.
  float height() const { return height_; }

  // The tissue within `radius` mm of a place is tied to the tool, where that is now: a bed, which
  // tears tie by tie. Of all ties together N/m and mN. How many there are.
  std::size_t hang(const float place[3], float radius, float stiffness, float tears_at);
  std::size_t torn() const { return torn_; }
  // What a support group of the bundle does in every step from now on.
  void lead(const upt_support &group);

  upt_instrument tool = upt::make<upt_instrument>();
  bool in_hand = false; // whether the tool is there
  Kind kind = Kind::press;

  // The body before the last stroke of a tool that changes it; false where there is none.
  bool undo();
  // How often the surface has changed: `rest` and `faces` are others then.
  std::int64_t changes() const { return surgery_.changes(); }
  // Tissue that a touching tool stretches beyond this tears from the next step on; 0: none does.
  void tear_at(float stretch) { surgery_.limit = stretch; }
  // Of `faces`, those that were on the intact body's surface come first: so many indices.
  std::size_t outside() const { return surgery_.has_begun() ? outside_ : faces_.size(); }
  float area() const { return surgery_.area(); }       // that strokes have laid open, mm2
  float removed() const { return surgery_.removed(); } // that has left the body, mm3

  const std::vector<float> &rest() const { return rest_; }                 // [n,3]
  const std::vector<float> &displacement() const { return displacement_; } // [n,3]
  const std::vector<std::uint32_t> &faces() const { return faces_; }       // vertices, three a face
  // Of the last step that a frame took: zero without a tool.
  const upt_instrument_reading &reading() const { return reading_; }
  upt_scene_stats stats() const { return scene_.stats(); }
  upt_scene_timing timing() const { return scene_.timing(); }

private:
  void follow(double now, upt::span<const upt_instrument> tools);
  void load(upt::Input &input, double moment);
  void take_surface();

  upt::Model model_;
  double step_s_;
  upt::Scene scene_;
  upt::FrameClock clock_;
  std::vector<std::uint32_t> faces_;
  std::vector<float> rest_, displacement_;
  upt_instrument_reading reading_{};
  float height_ = 0, amplitude_ = 0;
  double period_ = 4;
  std::vector<upt_tie> bed_;
  std::size_t torn_ = 0;
  std::vector<upt_support> groups_;
  // For a bundle that cannot solve contact: what the tool pushes, found by geometry.
  bool solves_contact_ = true;
  std::vector<std::uint32_t> nodes_;
  std::vector<float> vectors_;
  std::uint64_t contact_count_ = 0, counted_steps_ = 0;
  // Of a body that a tool changes.
  Surgery surgery_;
  std::int64_t taken_ = 0; // of its surfaces, the one that is shown
  std::size_t outside_ = 0;
};
