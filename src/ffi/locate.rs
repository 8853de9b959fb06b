//! `upt_model`: points of the tissue.

use super::call::call;
use super::constants::*;
use super::output::output;
use super::pointers::slice;
use super::registry::find_model;
use super::structs::*;
use crate::memory::collected;
use crate::scene::{PointForce, check_point_count};

/// Finds points of the intact mesh: of each the tetrahedron that holds it, or of one outside of the mesh the closest combination. What `upt_point_force` takes; some milliseconds
/// for a large mesh, so find a point once, not in every step.
///
/// - `places`: `[count,3]`, rest positions, mm.
/// - `count`: number of points.
/// - `nodes`: `[count,4]`, receives the corners of each one's tetrahedron.
/// - `weights`: `[count,4]`, receives their weights, 0 or more, with the sum 1.
///
/// Threads: any.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_NON_FINITE`, `UPT_ERR_ARGUMENT` (a point 25 mm or more outside of the mesh), `UPT_ERR_OUT_OF_MEMORY`,
/// `UPT_ERR_PANIC`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_model_locate_points(
    model: *const upt_model,
    places: *const f32,
    count: u64,
    nodes: *mut u32,
    weights: *mut f32,
) -> upt_status {
    call(
        "upt_model_locate_points",
        || (),
        || {
            let model = find_model(model)?;
            check_point_count(count)?;
            // SAFETY: the host passes that many elements, as the header asks.
            let places = unsafe { slice(places, 3 * count, "places") }?;
            // SAFETY: the host passes room for that many elements, as the header asks.
            let nodes = unsafe { output(nodes, 4 * count, "nodes") }?;
            // SAFETY: as above.
            let weights = unsafe { output(weights, 4 * count, "weights") }?;
            let found = PointForce::at(&model, places.as_chunks::<3>().0)?;
            let (corners, shares) = (
                found.iter().flat_map(|p| p.nodes),
                found.iter().flat_map(|p| p.weights),
            );
            let corners = collected(4 * found.len(), corners, "located points")?;
            let shares = collected(4 * found.len(), shares, "located points")?;
            nodes.copy_from(&corners);
            weights.copy_from(&shares);
            Ok(UPT_OK)
        },
    )
}
