//! The page's tool as an instrument of the library.

use upt::ffi;

use super::protocol::{Kind, Tool};
use host::instrument;

/// From this friction on, nodes that are moved by the tool stick to it.
const STICKS: f32 = 0.5;

/// The instruments of a tool: none where it does something else than press.
pub fn pressing(tool: Option<&Tool>) -> Vec<ffi::upt_instrument> {
    let presses = tool.filter(|tool| tool.kind == Kind::Press);
    presses.into_iter().map(capsule).collect()
}

fn capsule(tool: &Tool) -> ffi::upt_instrument {
    ffi::upt_instrument {
        shape: ffi::UPT_SHAPE_CAPSULE,
        position: tool.position,
        rotation: tool.rotation,
        half_extents: [0.0, tool.half_length, 0.0],
        radius: tool.radius,
        sticking: u8::from(tool.grasp || tool.friction >= STICKS),
        mode: match tool.grasp {
            true => ffi::UPT_MODE_GRASP,
            false => ffi::UPT_MODE_SLIDE,
        },
        friction: tool.friction,
        ..instrument()
    }
}
