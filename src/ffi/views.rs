//! `upt_view`: what of a state the host wants to see.

use super::constants::*;
use super::convert;
use super::failure::{Failure, fail};
use super::pointers::{optional, options};
use super::step_structs::upt_view;
use crate::scene::{Scene, View};

/// For hosts in Rust.
impl upt_view {
    /// The attached points.
    pub const POINTS: upt_view = Self::of(UPT_VIEW_POINTS, &[]);
    /// The vertices of the surface.
    pub const SURFACE: upt_view = Self::of(UPT_VIEW_SURFACE, &[]);

    /// These nodes, which must live until the call that takes the view returns.
    pub const fn of_nodes(nodes: &[u32]) -> upt_view {
        Self::of(UPT_VIEW_NODES, nodes)
    }

    const fn of(kind: upt_view_kind, nodes: &[u32]) -> upt_view {
        upt_view {
            struct_size: size_of::<upt_view>() as u32,
            kind,
            nodes: nodes.as_ptr(),
            node_count: nodes.len() as u64,
        }
    }
}

/// What a view names.
pub(super) enum Shown<'a> {
    /// What a scene keeps with each state.
    Kept(View),
    /// Any nodes; `None`: all.
    Nodes(Option<&'a [u32]>),
}

/// A view of what a scene keeps with each state, or for a frame.
///
/// # Safety
/// NULL, or a struct whose first field is its size, with what the header asks for.
pub(super) unsafe fn kept_view(scene: &Scene, raw: *const upt_view) -> Result<View, Failure> {
    // SAFETY: the caller's.
    match unsafe { read_view(scene, raw) }? {
        Shown::Kept(view) => Ok(view),
        Shown::Nodes(_) => fail(
            UPT_ERR_UNSUPPORTED,
            "view.kind is UPT_VIEW_NODES, which only upt_scene_decode takes; upt_scene_set_region says which nodes each state and frame has",
        ),
    }
}

/// Any view.
///
/// # Safety
/// As [`kept_view`].
pub(super) unsafe fn read_view<'a>(
    scene: &Scene,
    raw: *const upt_view,
) -> Result<Shown<'a>, Failure> {
    // SAFETY: the caller's.
    let raw = unsafe { options(raw, "view") }?;
    let kept = match raw.kind {
        UPT_VIEW_REGION => View::Region,
        UPT_VIEW_POINTS => View::Points,
        UPT_VIEW_SURFACE => View::Surface,
        UPT_VIEW_NODES => {
            scene.check_node_count("view.node_count", raw.node_count)?;
            // SAFETY: the host passes that many elements, as the header asks.
            let nodes = unsafe { optional(raw.nodes, raw.node_count, "view.nodes") }?;
            return Ok(Shown::Nodes(nodes));
        }
        value => return convert::unknown("view.kind", value),
    };
    if raw.node_count != 0 {
        return fail(
            UPT_ERR_ARGUMENT,
            "view.node_count is set, and view.kind is not UPT_VIEW_NODES",
        );
    }
    Ok(Shown::Kept(kept))
}
