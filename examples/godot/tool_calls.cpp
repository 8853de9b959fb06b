// What a script asks of the tool: where it is, of which shape, and how it holds the tissue.
#include "soft_tissue.hpp"

static float number(GDExtensionConstTypePtr argument) { return static_cast<float>(real(argument)); }

// The tool from now on: this shape, at a place and, where it has one, a rotation in Godot's axes.
static bool press(void *instance, upt_instrument tool, GDExtensionConstTypePtr position,
                  GDExtensionConstTypePtr rotation) {
  const float metres = 0.001F, half = 0.70710678F;
  const upt_instrument &hold = static_cast<SoftTissue *>(instance)->hold;
  const auto *at = static_cast<const float *>(position);
  tool.position[0] = at[0] / metres;
  tool.position[1] = -at[2] / metres;
  tool.position[2] = at[1] / metres;
  if (rotation) {
    // Godot's axes are RAS turned by -90 degrees about x: q_ras = turn * q, turn = (sin 45, 0, 0,
    // cos 45).
    const auto *q = static_cast<const float *>(rotation);
    tool.rotation[0] = half * (q[3] + q[0]);
    tool.rotation[1] = half * (q[1] - q[2]);
    tool.rotation[2] = half * (q[2] + q[1]);
    tool.rotation[3] = half * (q[3] - q[0]);
  }
  tool.friction = hold.friction;
  tool.mode = hold.mode;
  tool.tear_off_mn = hold.tear_off_mn;
  return opened(instance, [&](Tissue &tissue) {
    tissue.tool = tool;
    tissue.in_hand = true;
  });
}

/// The tool is a sphere at this place (m) from now on; radius in mm.
void press_sphere(void *instance, const GDExtensionConstTypePtr *arguments,
                  GDExtensionTypePtr result) {
  put(result, press(instance, upt::sphere(number(arguments[1])), arguments[0], nullptr));
}

/// The tool is a capsule along its own y axis from now on; half its length without the caps, and
/// its radius, in mm.
void press_capsule(void *instance, const GDExtensionConstTypePtr *arguments,
                   GDExtensionTypePtr result) {
  const upt_instrument tool = upt::capsule(number(arguments[3]), number(arguments[2]));
  put(result, press(instance, tool, arguments[0], arguments[1]));
}

/// The tool is a box with sharp edges from now on; half its lengths in mm.
void press_box(void *instance, const GDExtensionConstTypePtr *arguments,
               GDExtensionTypePtr result) {
  const auto *half = static_cast<const float *>(arguments[2]);
  const upt_instrument tool = upt::box(half[0], half[1], half[2]);
  put(result, press(instance, tool, arguments[0], arguments[1]));
}

/// The tool is a box whose edges are rounded from now on; half its lengths, rounding included, and
/// the radius of that in mm.
void press_spatula(void *instance, const GDExtensionConstTypePtr *arguments,
                   GDExtensionTypePtr result) {
  const auto *half = static_cast<const float *>(arguments[2]);
  const upt_instrument tool = upt::spatula(half[0], half[1], half[2], number(arguments[3]));
  put(result, press(instance, tool, arguments[0], arguments[1]));
}

/// How the tool of the next presses holds the tissue: Coulomb's coefficient; whether it grasps; the
/// pull at which a grasp tears off, mN, 0: never.
void hold(void *instance, const GDExtensionConstTypePtr *arguments, GDExtensionTypePtr result) {
  upt_instrument &hold = static_cast<SoftTissue *>(instance)->hold;
  hold.friction = number(arguments[0]);
  hold.mode = *static_cast<const GDExtensionBool *>(arguments[1]) ? UPT_MODE_GRASP : UPT_MODE_SLIDE;
  hold.tear_off_mn = number(arguments[2]);
  put(result, true);
}

/// The tool leaves the tissue.
void release(void *instance, const GDExtensionConstTypePtr *, GDExtensionTypePtr result) {
  put(result, opened(instance, [](Tissue &tissue) { tissue.in_hand = false; }));
}
