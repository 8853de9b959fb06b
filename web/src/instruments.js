// An instrument's fields of JavaScript as those of `upt_instrument`, and words as constants.
import * as abi from "./abi.js";
import { UptError } from "./module.js";

const MODES = { slide: abi.UPT_MODE_SLIDE, grasp: abi.UPT_MODE_GRASP };
const SHAPES = { sphere: abi.UPT_SHAPE_SPHERE, capsule: abi.UPT_SHAPE_CAPSULE, box: abi.UPT_SHAPE_BOX, spatula: abi.UPT_SHAPE_SPATULA };

/** The constant of a word; `what` is what a refusal calls it. */
export function choice(names, name, what) {
  if (!(name in names)) throw new UptError("UPT_ERR_ARGUMENT", `${what} is ${name}; it can be ${Object.keys(names).join(", ")}`);
  return names[name];
}

/** The fields of the instrument at place `i` of the list. */
export function instrumentFields(tool, i) {
  const { shape = "capsule", mode = "slide", halfLength = 0 } = tool;
  return {
    shape: choice(SHAPES, shape, `instruments[${i}].shape`),
    position: tool.position,
    rotation: tool.rotation ?? [0, 0, 0, 1],
    half_extents: tool.halfExtents ?? [0, halfLength, 0],
    radius: tool.radius ?? 0,
    mode: choice(MODES, mode, `instruments[${i}].mode`),
    friction: tool.friction ?? 0,
    tear_off_mn: tool.tearOff ?? 0,
  };
}
