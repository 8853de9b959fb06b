//! Centres of what is near: nodes that tools have touched, thinned out, and how far others are from them at rest.

use super::linear::WHAT;
use crate::error::Result;
use crate::memory;

/// Centres lie this far apart at least, mm.
const APART_MM: f32 = 3.0;

/// The square of the distance from a node to the nearest of some nodes at rest, mm².
pub(super) fn nearest_squared(rest: &[f32], nodes: &[u32], node: u32) -> f32 {
    let at = |node: u32| &rest[3 * node as usize..][..3];
    let own = at(node);
    let squares = nodes.iter().map(|&other| {
        let apart = own.iter().zip(at(other)).map(|(a, b)| (a - b) * (a - b));
        apart.sum::<f32>()
    });
    squares.fold(
        f32::MAX,
        |least, square| if square < least { square } else { least },
    )
}

/// Whether one of some nodes lies within a distance of a node at rest.
pub(super) fn is_by(rest: &[f32], nodes: &[u32], node: u32, distance: f32) -> bool {
    let at = |node: u32| &rest[3 * node as usize..][..3];
    let own = at(node);
    nodes.iter().any(|&other| {
        let apart = own.iter().zip(at(other)).map(|(a, b)| (a - b) * (a - b));
        apart.sum::<f32>() < distance * distance
    })
}

/// Adds those nodes that do not lie by one of the centres.
pub(in crate::corrections) fn add_centres(
    rest: &[f32],
    nodes: &[u32],
    centres: &mut Vec<u32>,
) -> Result<()> {
    for &node in nodes {
        if !is_by(rest, centres, node, APART_MM) {
            memory::push(centres, node, WHAT)?;
        }
    }
    Ok(())
}
