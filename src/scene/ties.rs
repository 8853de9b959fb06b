//! Ties of a step: checked, and their far ends put into the mesh's frame.
//!
//! REQ-072: A tie pulls as its spring does, and once broken stays so.

use ::contact::{End, Tie, TiePoint, Vector};

use super::StepInput;
use super::body::SceneBody;
use crate::contact::{Placed, ties};
use crate::error::{Error, Result};
use crate::memory;

const WHAT: &str = "the ties of a scene";

/// The points of the tissue that a tie has.
fn points_of(tie: &Tie) -> impl Iterator<Item = TiePoint> {
    let far = match tie.end {
        End::Tissue(far) => Some(far),
        _ => None,
    };
    [Some(tie.point), far].into_iter().flatten()
}

/// Takes the ties of a step with so many tools.
///
/// # Errors
/// [`Error::Argument`] and [`Error::NonFinite`] with the tie and its field, [`Error::OutOfMemory`].
pub(super) fn place(
    placed: &mut Vec<Placed>,
    body: &SceneBody,
    input: &StepInput<'_>,
    tools: usize,
) -> Result<()> {
    let given = input.loads.ties;
    let (prior, held) = (&body.model.prior, &body.held);
    // A place in the list that holds nothing may name tissue that is gone.
    let is_idle = |node: u32| {
        let has = |point: &TiePoint| point.entries().any(|(own, _)| own == node);
        let mut of_it = given
            .iter()
            .filter(|tie| points_of(tie).any(|point| has(&point)));
        body.is_gone(node) && of_it.all(|tie| tie.spring.stiffness == 0.0)
    };
    let moves = |node: u32| {
        let prior = prior.as_ref();
        let column = prior.and_then(|prior| prior.column_for(held, node));
        column.is_some() || is_idle(node)
    };
    let count = body.intact_mesh().node_count();
    for (index, tie) in given.iter().enumerate() {
        let is_gone = |point: &TiePoint| {
            let mut nodes = point.entries().map(|(node, _)| node);
            nodes.all(|node| (node as usize) < count && body.is_gone(node))
        };
        let mut points = points_of(tie);
        if let (true, Some(point)) = (tie.spring.stiffness > 0.0, points.find(is_gone)) {
            return Err(Error::Argument(format!(
                "ties[{index}]: of its nodes {:?} the body has nothing left; give it a stiffness of 0",
                point.nodes
            )));
        }
    }
    ties::check(given, tools, count, moves)?;
    let support = input.loads.support.map(|pose| pose.checked()).transpose()?;
    placed.clear();
    memory::fit(placed, given.len(), WHAT)?;
    placed.extend(given.iter().map(|tie| Placed {
        tie: *tie,
        // The world's places go to the frame of the mesh, in which the body's displacements and
        // tools are; without a support that moves the two frames are one.
        place: match (tie.end, &support) {
            (End::World(place), Some(support)) => support.inverse_transform_point(place),
            (End::World(place) | End::Support(place) | End::Tool { place, .. }, _) => place,
            (End::Tissue(_), _) => Vector::ZERO,
        },
    }));
    Ok(())
}
