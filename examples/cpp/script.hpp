// What the mouse does in a run without a window.
#pragma once

#include "surgery.hpp"
#include "tissue.hpp"

struct Mouse {
  Ray ray;
  bool pressed;
  Kind kind;
  bool forceps = false; // are in the hand, and draw on what hangs on the organ
};

// The spatula presses the site. With `operates` a blade cuts 24 mm through it first, an aspirator
// takes tissue beside the slit, a coagulator hardens some, and the spatula presses the lip.
Mouse scripted(const Hit &site, bool operates, long frame);
// Forceps draw off what hangs there from the second second on.
Mouse drawn_off(const Hit &site, long frame);
