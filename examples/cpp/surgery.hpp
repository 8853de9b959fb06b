// What tools that change the body do to it, step by step, in strokes that can be undone. The
// simulator with a window and the Godot node use it; as crates/cli/src/view/surgery.rs.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "upt.hpp"

// What the tool does: it touches the tissue; cuts along its way with an edge of 20 mm from its tip
// up its axis; takes what lies inside of the ball at its tip; or hardens what does. Its tip is the
// lower end of its local y, and the ball has its radius.
enum class Kind { press, blade, aspirate, coagulate };

class Surgery {
public:
  explicit Surgery(const upt::Model &model);

  // From now on the body may change, and what is shown is its surface. No step may be in flight.
  void begin(upt::Scene &scene);
  bool has_begun() const { return has_begun_; }
  // A step begins, and none is in flight: what the tool does to the body in it; null: it is lifted.
  void operate(upt::Scene &scene, Kind kind, const upt_instrument *tool, double step_s);
  // The body before the last stroke; false where there is none. No step may be in flight.
  bool undo(upt::Scene &scene);
  // The intact body is back, by `upt_scene_reset`.
  void reset(upt::Scene &scene);

  // The body's surface since `begin`.
  const upt::Surface &surface() const { return surface_; }
  // How often it has changed.
  std::int64_t changes() const { return changes_; }
  // Tissue that a touching tool stretches beyond this tears; 0: none does.
  float limit = 0;
  float area() const { return now_.area; }                 // that strokes have laid open, mm2
  float removed() const { return now_.removed; }           // that has left the body, mm3
  std::size_t hardened() const { return now_.hard_count; } // elements
  // What the tissue does to a blade in the step that has begun, mN.
  const std::array<float, 3> &force() const { return force_; }

private:
  struct Account {
    float area = 0, removed = 0;
    std::size_t hard_count = 0;
    std::vector<bool> hard; // by element
  };
  struct Before {
    std::vector<std::uint8_t> snapshot;
    Account account;
  };
  static constexpr std::size_t MOST_UNDONE = 16;

  upt_cut cut(upt::Scene &scene, const upt_instrument &tool);
  upt_cut coagulate(upt::Scene &scene, const upt_instrument &tool);
  void note(upt::Scene &scene, const upt_cut &made);
  void end_stroke(upt::Scene &scene);
  void follow(upt::Scene &scene);
  void stop();

  std::vector<float> middles_; // of the elements at rest, [E,3], mm
  upt::Surface surface_;
  Account now_;
  Before before_; // the stroke that goes on, until it has done something
  std::vector<Before> undone_;
  upt_instrument last_{};
  std::array<float, 3> force_{};
  Kind stroke_kind_ = Kind::press;
  std::uint32_t stroke_ = 0;
  std::int64_t changes_ = 0;
  bool in_stroke_ = false, has_begun_ = false;
  bool waits_ = false; // until the tool is lifted: its stroke has been taken back
};
