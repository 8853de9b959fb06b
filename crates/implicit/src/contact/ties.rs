//! Ties of a scene: rows of its contact problem whose law is a spring, and what is remembered of them from step to step.
//!
//! Beside the rows of tools, which are samples of the surface, stand those of ties, with up to six nodes: a suture has nodes at both of its ends. Both are
//! told by numbers: a tie's are the last ones there are.

use ::contact::{Contact, End, Law, Pose, Sample, Samples, Tie, TiePoint, Vector};
use serde::{Deserialize, Serialize};

use super::stored;
use super::tool::{TieReading, Tool};
use crate::error::{Error, Result};
use crate::memory::HeldBytes;

/// Ties of a scene at most.
pub const MAX_TIES: usize = 256;
/// The tool of a tie's force: none.
pub const NO_TOOL: u32 = u32::MAX;
/// The number of the first tie's row.
const FIRST_ROW: u32 = u32::MAX - MAX_TIES as u32;

/// A tie whose far end is known in the mesh's frame.
#[derive(Clone, Copy, Debug, PartialEq, HeldBytes, Serialize, Deserialize)]
pub struct Placed {
    #[serde(with = "stored::tie")]
    pub tie: Tie,
    /// Where its far end is: in the frame of its tool, or in the mesh's; of a suture nothing.
    #[serde(with = "stored::vector")]
    pub place: Vector,
}

/// A tie at the end of a step.
#[derive(Clone, Copy, Debug, PartialEq, HeldBytes, Serialize, Deserialize)]
pub struct HeldTie {
    pub placed: Placed,
    pub broken: bool,
    /// Of the step alone.
    #[serde(skip)]
    pub reading: TieReading,
}

impl Placed {
    /// Whether it is this tie that another list has in its place.
    pub fn goes_on_as(&self, other: &Placed) -> bool {
        let same_end = match (&self.tie.end, &other.tie.end) {
            (End::World(_) | End::Support(_), End::World(_) | End::Support(_)) => true,
            (End::Tool { tool, .. }, End::Tool { tool: other, .. }) => tool == other,
            (End::Tissue(a), End::Tissue(b)) => a == b,
            _ => false,
        };
        same_end && self.tie.point == other.tie.point && other.tie.spring.stiffness > 0.0
    }

    /// Nodes and weights of its length: those of its point, and less those of its far end.
    pub fn row(&self) -> RowNodes {
        let mut row = RowNodes::from(self.tie.point);
        if let End::Tissue(far) = self.tie.end {
            far.entries()
                .for_each(|(node, weight)| row.push(node, -weight));
        }
        row
    }

    /// Whether its nodes are those of another.
    pub fn has_nodes_of(&self, other: &Placed) -> bool {
        self.row() == other.row()
    }
}

/// Nodes of a row with their weights.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RowNodes {
    count: usize,
    entries: [(u32, f32); 6],
}

impl RowNodes {
    fn push(&mut self, node: u32, weight: f32) {
        self.entries[self.count] = (node, weight);
        self.count += 1;
    }

    /// Nodes and weights, up to six.
    pub fn entries(&self) -> impl Iterator<Item = (u32, f32)> + '_ {
        self.entries[..self.count].iter().copied()
    }

    /// The same, not borrowed.
    pub fn into_entries(self) -> impl Iterator<Item = (u32, f32)> {
        self.entries.into_iter().take(self.count)
    }

    /// The row's value of a nodal field.
    pub fn gather(&self, field: impl Fn(u32) -> Vector) -> Vector {
        self.entries().fold(Vector::ZERO, |sum, (node, weight)| {
            sum + field(node) * weight
        })
    }
}

impl From<TiePoint> for RowNodes {
    fn from(point: TiePoint) -> RowNodes {
        Sample::from(point).into()
    }
}

impl From<Sample> for RowNodes {
    fn from(sample: Sample) -> RowNodes {
        let mut row = RowNodes::default();
        sample
            .entries()
            .for_each(|(node, weight)| row.push(node, weight));
        row
    }
}

/// The number of a tie's row.
pub fn row_of(index: usize) -> u32 {
    FIRST_ROW + index as u32
}

/// Which tie a row is.
pub fn tie_of(row: u32) -> Option<usize> {
    row.checked_sub(FIRST_ROW).map(|index| index as usize)
}

/// What the rows of a problem move: samples of the surface, and ties.
#[derive(Clone, Copy)]
pub struct Points<'a> {
    pub samples: &'a Samples,
    pub ties: &'a [Placed],
    /// Another number for ties of other nodes.
    pub generation: u64,
}

impl<'a> From<&'a Samples> for Points<'a> {
    fn from(samples: &'a Samples) -> Points<'a> {
        Points {
            samples,
            ties: &[],
            generation: 0,
        }
    }
}

impl Points<'_> {
    /// Nodes and weights of a row; none of a tie that is not there.
    pub fn at(&self, row: u32) -> RowNodes {
        match tie_of(row) {
            Some(index) => self.ties.get(index).map(Placed::row).unwrap_or_default(),
            None => self.samples.at(row).into(),
        }
    }
}

/// The ties of a step on their way.
#[derive(Clone, Copy)]
pub struct Pulling<'a> {
    pub ties: &'a [Placed],
    pub held: &'a [HeldTie],
    /// Where their far ends were at the start of the step.
    pub from: &'a [Vector],
    pub tools: &'a [Tool],
    /// Where these were.
    pub before: &'a [Pose],
    pub step_s: f32,
}

impl Pulling<'_> {
    /// Whether a tie pulls where it is taut.
    pub fn is_whole(&self, index: usize) -> bool {
        let is_whole = self.held.get(index).is_some_and(|held| !held.broken);
        let tie = self.ties.get(index);
        is_whole && tie.is_some_and(|placed| placed.tie.spring.stiffness > 0.0)
    }

    /// Where the far end of a tie is at part `part` of the step; none where its tool is gone.
    pub fn end(&self, index: usize, part: f32) -> Option<Vector> {
        let placed = self.ties.get(index)?;
        let from = self.from.get(index).copied().unwrap_or(placed.place);
        let place = from + (placed.place - from) * part;
        match placed.tie.end {
            End::World(_) | End::Support(_) => Some(place),
            End::Tissue(_) => Some(Vector::ZERO),
            End::Tool { tool, .. } => {
                let (now, before) = (
                    self.tools.get(tool as usize)?,
                    self.before.get(tool as usize)?,
                );
                let pose = ::contact::pose::between(before, &now.pose, part);
                Some(pose.transform_point(place))
            }
        }
    }

    /// The law of a tie whose row is at `point`, and was at `start`, at part `part` of the step; none of one that does not pull.
    pub fn contact(
        &self,
        index: usize,
        point: Vector,
        start: Vector,
        part: f32,
    ) -> Option<Contact> {
        if !self.is_whole(index) {
            return None;
        }
        let (end, from) = (self.end(index, part)?, self.end(index, 0.0)?);
        let spring = self.ties[index].tie.spring;
        Some(Contact {
            law: Law::Tie(spring.over((start - from).length(), self.step_s)),
            normal: Vector::X,
            gap: 0.0,
            slip: point - end,
        })
    }
}

/// Checks ties against the tools of their step and a body of `nodes` nodes, some of which contact can move.
///
/// # Errors
/// [`Error::Argument`], [`Error::NonFinite`], with the field.
pub fn check(ties: &[Tie], tools: usize, nodes: usize, moves: impl Fn(u32) -> bool) -> Result<()> {
    if ties.len() > MAX_TIES {
        return Err(Error::Argument(format!(
            "ties has {} entries, must have at most {MAX_TIES}",
            ties.len()
        )));
    }
    for (index, tie) in ties.iter().enumerate() {
        let fail = |what: String| Err(Error::Argument(format!("ties[{index}]: {what}")));
        if !tie.is_finite() {
            return Err(Error::NonFinite(format!(
                "ties[{index}] has a number that is not finite"
            )));
        }
        if let Err(reason) = tie.check() {
            return fail(reason);
        }
        if let End::Tool { tool, .. } = tie.end
            && tool as usize >= tools
        {
            return fail(format!("is tied to instrument {tool} of {tools}"));
        }
        let far = match tie.end {
            End::Tissue(far) => Some(far),
            _ => None,
        };
        let points = [("nodes", Some(tie.point)), ("other_nodes", far)];
        for (field, point) in points
            .into_iter()
            .filter_map(|(field, p)| Some((field, p?)))
        {
            if let Some(node) = point.nodes.iter().find(|node| **node as usize >= nodes) {
                return fail(format!(
                    "{field}: node {node} is beyond the mesh's {nodes} nodes"
                ));
            }
            if !point.entries().any(|(node, _)| moves(node)) {
                return fail(format!(
                    "{field} are {:?}, none of them both free and near the domain, the surface that instruments may touch",
                    point.nodes
                ));
            }
        }
    }
    Ok(())
}
