//! Centres of what is near: nodes that tools have touched, thinned out, and how far others are from them at rest.

use super::linear::WHAT;
use crate::error::Result;
use crate::memory;

/// Centres lie this far apart at least, mm: sets are made about them and compared by them, and a
/// tool that moves by less asks for the same ones.
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

/// What of a box lies within a distance of some nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Reached {
    Nothing,
    Part,
    /// All of it by one of the nodes.
    Whole,
}

/// What of a box, `[low, high]` of nodes at rest, lies within a distance of one of some nodes; where it is a part, `close` has the nodes that reach into it.
///
/// Sums and their order are those of [`is_by`], and rounding keeps what is farther from being nearer: for each node in the box both give one answer.
pub(super) fn reach_of(
    (rest, nodes): (&[f32], &[u32]),
    distance: f32,
    [low, high]: &[[f32; 3]; 2],
    close: &mut Vec<u32>,
) -> Result<Reached> {
    close.clear();
    memory::fit(close, nodes.len(), WHAT)?;
    let square = |apart: [f32; 3]| apart.iter().map(|x| x * x).sum::<f32>();
    for &node in nodes {
        let at = &rest[3 * node as usize..][..3];
        let nearest = [0, 1, 2].map(|k| (low[k] - at[k]).max(at[k] - high[k]).max(0.0));
        if square(nearest) < distance * distance {
            let farthest = [0, 1, 2].map(|k| (at[k] - low[k]).max(high[k] - at[k]));
            if square(farthest) < distance * distance {
                return Ok(Reached::Whole);
            }
            close.push(node);
        }
    }
    Ok(match close.is_empty() {
        true => Reached::Nothing,
        false => Reached::Part,
    })
}

/// Adds those nodes that do not lie by one of the centres.
/// In the order of the list: the same nodes in the same order give the same centres.
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
