//! The nearest of the nodes of a surface to each of a few points.
//!
//! All nodes are looked at: a tree over a surface that moves would have to be made anew in every
//! step, while in one pass [`AT_ONCE`] points share each node that is read.

use lanes::{Isa, by_isa};

/// Points that are looked for at once: as many as the widest register has lanes. Places that are
/// not needed may hold any number, and their results are not read.
pub const AT_ONCE: usize = 16;

/// Some points by axis, mm.
pub type Points = [[f32; AT_ONCE]; 3];

/// What a pass over nodes finds.
#[derive(Debug, Clone, Copy)]
pub struct NearestNodes {
    /// Square of the distance from each point to the nearest node, mm².
    pub squares: [f32; AT_ONCE],
    /// That node's place among the nodes; the first of several that are as near.
    pub places: [u32; AT_ONCE],
}

/// The nearest of `nodes` to each point, with the nodes at `rest + u` `[K,3]`, or at `rest` where `u` is empty; the squares are `f32::MAX` where there is no node. The
/// bits do not depend on `isa`.
///
/// # Panics
/// If a node is not below `K`.
pub fn nearest_nodes(
    isa: Isa,
    (rest, u): (&[f32], &[f32]),
    nodes: &[u32],
    points: &Points,
) -> NearestNodes {
    let mut found = NearestNodes {
        squares: [f32::MAX; AT_ONCE],
        places: [0; AT_ONCE],
    };
    match u.is_empty() {
        true => pass(isa, rest, rest, 0.0, nodes, points, &mut found),
        false => pass(isa, rest, u, 1.0, nodes, points, &mut found),
    }
    found
}

by_isa! {
    /// One pass over nodes at `rest + part * u`.
    fn pass(rest: &[f32], u: &[f32], part: f32, nodes: &[u32], points: &Points, found: &mut NearestNodes) = pass_body, pass_scalar;
}

/// The compiler makes vectors of the points.
#[inline(always)]
fn pass_scalar(
    rest: &[f32],
    u: &[f32],
    part: f32,
    nodes: &[u32],
    points: &Points,
    found: &mut NearestNodes,
) {
    let (rest, u) = (rest.as_chunks::<3>().0, u.as_chunks::<3>().0);
    let [x, y, z] = points;
    let (mut squares, mut places) = (found.squares, found.places);
    for (place, node) in (0..).zip(nodes) {
        let (rest, u) = (rest[*node as usize], u[*node as usize]);
        let [px, py, pz] = [0, 1, 2].map(|axis| rest[axis] + part * u[axis]);
        for at in 0..AT_ONCE {
            let [dx, dy, dz] = [px - x[at], py - y[at], pz - z[at]];
            let square = dx * dx + dy * dy + dz * dz;
            let is_nearer = square < squares[at];
            squares[at] = if is_nearer { square } else { squares[at] };
            places[at] = if is_nearer { place } else { places[at] };
        }
    }
    (found.squares, found.places) = (squares, places);
}

/// The same loop, compiled for an instruction set: nothing of `V` is used, and each set gives the same bits.
///
/// # Safety
/// The instruction set is there.
#[inline(always)]
unsafe fn pass_body<V>(
    rest: &[f32],
    u: &[f32],
    part: f32,
    nodes: &[u32],
    points: &Points,
    found: &mut NearestNodes,
) {
    pass_scalar(rest, u, part, nodes, points, found);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// Each set of instructions finds the node that a search one by one finds, at the same distance to the bit.
    #[test]
    fn the_nearest_node_is_found() {
        let mut random = Random::new(1);
        let [rest, u] = [0, 1].map(|_| random.normal(3 * 300, 1.0));
        let nodes: Vec<u32> = (0..300).step_by(3).collect();
        let values = random.normal(3 * AT_ONCE, 1.0);
        let mut points: Points = [[0.0; AT_ONCE]; 3];
        for (axis, points) in points.iter_mut().enumerate() {
            points.copy_from_slice(&values[axis * AT_ONCE..][..AT_ONCE]);
        }
        for u in [&u[..], &[]] {
            let place = |node: u32, axis: usize| {
                let at = 3 * node as usize + axis;
                rest[at] + u.get(at).copied().unwrap_or(0.0)
            };
            for isa in Isa::available() {
                let found = nearest_nodes(isa, (&rest, u), &nodes, &points);
                for at in 0..AT_ONCE {
                    let square = |node: u32| {
                        let [x, y, z] = [0, 1, 2].map(|axis| place(node, axis) - points[axis][at]);
                        x * x + y * y + z * z
                    };
                    let best = nodes.iter().map(|node| square(*node));
                    let best = best.fold(f32::MAX, f32::min);
                    assert_eq!(found.squares[at].to_bits(), best.to_bits(), "{isa:?}");
                    assert_eq!(square(nodes[found.places[at] as usize]), best, "{isa:?}");
                }
            }
        }
    }
}
