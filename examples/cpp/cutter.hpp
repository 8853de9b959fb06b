// A blade, an aspirator or a coagulator: follows the mouse over the tissue, and changes the body
// while the button is down.
#pragma once

#include "tissue.hpp"

class Cutter {
public:
  // Of the ball that an aspirator takes and a coagulator hardens, and how deep a blade cuts, mm.
  static constexpr float RADIUS = 3, DEPTH = 6;

  // Another tool is in the hand; Kind::press: none of these.
  void take(Kind kind) { kind_ = kind; }
  // The surface point under the mouse; none: the tool stays.
  void hover(const std::optional<Hit> &hit);
  // Whether it works.
  void press(bool pressed) { pressed_ = pressed; }
  // The tool of the next steps; none: it hovers.
  std::optional<upt_instrument> at_work() const;

  Kind kind() const { return kind_; }
  bool visible() const { return kind_ != Kind::press && visible_; }
  Vec3 tip() const;
  // `y` is its axis, from the tip up.
  const Frame &frame() const { return frame_; }

private:
  Kind kind_ = Kind::press;
  Hit under_{};
  Frame frame_{};
  bool visible_ = false, pressed_ = false;
};
