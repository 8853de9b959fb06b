//! Support groups of a scene: parts of what holds the organ that move against each other, and are let go and held again.
//!
//! A group's node `X` that was held at `X + o` of the group's frame ends at `R (X + o) + c`; at first `o = 0`. One that is let go moves as all free nodes;
//! held again, `o` is where it is then in the group's frame, so that nothing leaps.

use serde::{Deserialize, Serialize};

use super::support::{Affine, SupportPose, affine};
use crate::bundle::{Mesh, NodeSet};
use crate::corrections::Held;
use crate::error::{Error, Result};
use crate::memory::{self, HeldBytes};
use crate::stored;

const WHAT: &str = "the support groups of a scene";
/// Support groups that a bundle may have.
pub const MAX_SUPPORTS: usize = 64;
/// The farthest that a held node goes in a step, mm.
const FARTHEST_MM: f32 = 40.0;

/// What a support group of the bundle does in a step.
#[derive(Debug, Clone, Copy, Default)]
pub struct GroupMotion<'a> {
    /// Its place among those of the bundle.
    pub group: u32,
    /// It holds nothing. Held again, it holds its nodes where they are then.
    pub let_go: bool,
    /// Where it is at the end of the step, as a rigid body in the mesh's frame; none: where it was meshed.
    pub pose: Option<SupportPose>,
    /// Instead: the displacement of each of its nodes at the end of the step `[n,3]`, mm.
    pub displacements: Option<&'a [f32]>,
}

/// A group in a state.
#[derive(Debug, Clone, Default, HeldBytes, Serialize, Deserialize)]
pub(super) struct GroupState {
    pub(super) let_go: bool,
    /// `o [n,3]`, mm; empty: zero.
    #[serde(with = "stored")]
    grip: Vec<f32>,
    /// Whether a node is displaced, or the group has been let go.
    moves: bool,
}

/// Checks motions against the groups of a mesh.
///
/// # Errors
/// [`Error::Argument`] and [`Error::NonFinite`], with the field.
pub(super) fn check(motions: &[GroupMotion<'_>], groups: &[NodeSet]) -> Result<()> {
    let mut seen = 0u64;
    for (index, motion) in motions.iter().enumerate() {
        let bad = |reason: String| Err(Error::Argument(format!("supports[{index}]: {reason}")));
        let Some(group) = groups.get(motion.group as usize) else {
            return bad(format!(
                "group {} is beyond the bundle's {}",
                motion.group,
                groups.len()
            ));
        };
        if seen >> motion.group & 1 != 0 {
            return bad(format!("group {} is named twice", motion.group));
        }
        seen |= 1 << motion.group;
        if let Some(pose) = &motion.pose {
            pose.checked().map_err(|error| match error {
                Error::NonFinite(text) => Error::NonFinite(format!("supports[{index}]: {text}")),
                other => Error::Argument(format!("supports[{index}]: {other}")),
            })?;
        }
        if let Some(given) = motion.displacements {
            let wanted = 3 * group.nodes.len();
            if given.len() != wanted {
                return bad(format!(
                    "displacements has {} numbers, must have three a node of group `{}`, {wanted}",
                    given.len(),
                    group.name
                ));
            }
            if let Some(at) = given.iter().position(|value| !value.is_finite()) {
                return Err(Error::NonFinite(format!(
                    "supports[{index}].displacements: node {} is {}",
                    at / 3,
                    given[at]
                )));
            }
            if motion.pose.is_some() {
                return bad("a pose and displacements are both given; give one of them".into());
            }
        }
    }
    Ok(())
}

/// Lists that [`follow`] fills.
#[derive(Default, HeldBytes)]
pub(super) struct Moved {
    /// Nodes of groups that hold, and where they end; ascending.
    places: Vec<(u32, [f32; 3])>,
}

/// Finds what holds the body at the end of a step that starts at `u [K,3]`, and the groups there; none where all are as they were meshed, and were.
///
/// # Errors
/// [`Error::Argument`] for a node that would go too far, [`Error::OutOfMemory`].
pub(super) fn follow(
    mesh: &Mesh,
    motions: &[GroupMotion<'_>],
    (last, u): (&[GroupState], &[f32]),
    (next, held, moved): (&mut Vec<GroupState>, &mut Option<Box<Held>>, &mut Moved),
) -> Result<()> {
    if motions.is_empty() && last.is_empty() {
        next.clear();
        *held = None;
        return Ok(());
    }
    memory::fit(next, mesh.supports.len(), WHAT)?;
    next.resize_with(mesh.supports.len(), GroupState::default);
    let count = mesh.supports.iter().map(|group| group.nodes.len()).sum();
    moved.places.clear();
    memory::fit(&mut moved.places, count, WHAT)?;
    for (at, (group, state)) in mesh.supports.iter().zip(&mut *next).enumerate() {
        let motion = motions.iter().find(|motion| motion.group as usize == at);
        let motion = motion.copied().unwrap_or_default();
        state.take(mesh, group, &motion, (last.get(at), u), &mut moved.places)?;
    }
    if !acts(next) && !acts(last) {
        next.clear();
        *held = None;
        return Ok(());
    }
    moved.places.sort_unstable_by_key(|(node, _)| *node);
    hold(mesh, next, held)?;
    if let Some(held) = held {
        let places = held.nodes.iter().map(|node| {
            let own = (moved.places).binary_search_by_key(node, |(node, _)| *node);
            own.map_or([0.0; 3], |at| moved.places[at].1)
        });
        held.places.clear();
        memory::fit(&mut held.places, 3 * held.nodes.len(), WHAT)?;
        held.places.extend(places.flatten());
    }
    Ok(())
}

impl GroupState {
    /// Becomes the group's state at the end of a step; adds to `places` where its nodes are then, if it holds them.
    pub(super) fn take(
        &mut self,
        mesh: &Mesh,
        group: &NodeSet,
        motion: &GroupMotion<'_>,
        (before, u): (Option<&GroupState>, &[f32]),
        places: &mut Vec<(u32, [f32; 3])>,
    ) -> Result<()> {
        self.grip.clear();
        self.let_go = motion.let_go;
        self.moves = motion.let_go;
        if motion.let_go {
            return Ok(());
        }
        let pose = motion.pose.map(|pose| pose.checked()).transpose()?;
        let pose = pose.map(|pose| affine(&pose));
        let (rest, now) = (mesh.positions.as_chunks::<3>().0, u.as_chunks::<3>().0);
        match before {
            Some(before) if before.let_go => {
                memory::fit(&mut self.grip, 3 * group.nodes.len(), WHAT)?;
                for &node in &group.nodes {
                    let [x, u] = [rest, now].map(|rows| rows[node as usize].map(f64::from));
                    let place = [0, 1, 2].map(|k| x[k] + u[k]);
                    let own = pose.map_or(place, |pose| back(&pose, place));
                    self.grip.extend([0, 1, 2].map(|k| (own[k] - x[k]) as f32));
                }
            }
            Some(before) => memory::replace(&mut self.grip, &before.grip, WHAT)?,
            None => {}
        }
        self.moves = !self.grip.is_empty();
        for (index, &node) in group.nodes.iter().enumerate() {
            let x = rest[node as usize].map(f64::from);
            let grip = self.grip.as_chunks::<3>().0.get(index);
            let held = grip.map_or(x, |grip| [0, 1, 2].map(|k| x[k] + f64::from(grip[k])));
            let there = pose.map_or(held, |pose| carried(&pose, held));
            let place = match motion.displacements {
                Some(given) => [0, 1, 2].map(|k| given[3 * group.row(index) + k]),
                None => [0, 1, 2].map(|k| (there[k] - x[k]) as f32),
            };
            let way = [0, 1, 2].map(|k| place[k] - now[node as usize][k]);
            let squared: f32 = way.iter().map(|v| v * v).sum();
            if squared.is_nan() || squared > FARTHEST_MM * FARTHEST_MM {
                return Err(Error::Argument(format!(
                    "supports: group `{}` takes node {node} {:.1} mm in a step, must be at most {FARTHEST_MM}",
                    group.name,
                    squared.sqrt()
                )));
            }
            self.moves |= place != [0.0; 3];
            places.push((node, place));
        }
        Ok(())
    }
}

/// Where a pose takes a place of its frame.
fn carried(pose: &Affine, place: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|row| {
        let turned: f64 = (0..3).map(|k| pose[row][k] * place[k]).sum();
        turned + pose[row][3]
    })
}

/// What a pose takes to a place.
fn back(pose: &Affine, place: [f64; 3]) -> [f64; 3] {
    let from = [0, 1, 2].map(|row| place[row] - pose[row][3]);
    [0, 1, 2].map(|k| (0..3).map(|row| pose[row][k] * from[row]).sum())
}

/// What the mesh holds, but for the groups that are let go; without places. What has been let go before goes on with what was made for it.
fn hold(mesh: &Mesh, states: &[GroupState], held: &mut Option<Box<Held>>) -> Result<()> {
    let mut let_go = 0u64;
    for (at, state) in states.iter().enumerate() {
        let_go |= u64::from(state.let_go) << at;
    }
    if held.as_ref().is_some_and(|held| held.let_go == let_go) {
        return Ok(());
    }
    let is_held = |node: &&u32| {
        let groups = mesh.supports.iter().zip(states);
        let mut free = groups.filter(|(_, state)| state.let_go);
        !free.any(|(group, _)| group.nodes.binary_search(node).is_ok())
    };
    let nodes = mesh.held_nodes.iter().filter(is_held).copied();
    let mut made = Held::new(mesh.node_count(), nodes)?;
    made.let_go = let_go;
    *held = Some(memory::boxed(made, WHAT)?);
    Ok(())
}

/// What holds a body whose groups are these, for what a saved state remembers; the next step leads the nodes.
///
/// # Errors
/// [`Error::OutOfMemory`].
pub(super) fn restored(mesh: &Mesh, states: &[GroupState]) -> Result<Option<Box<Held>>> {
    let mut held = None;
    if states.iter().any(|state| state.let_go) {
        hold(mesh, states, &mut held)?;
    }
    Ok(held)
}

/// Copies states.
///
/// # Errors
/// [`Error::OutOfMemory`].
pub(super) fn copy(from: &[GroupState], to: &mut Vec<GroupState>) -> Result<()> {
    memory::fit(to, from.len(), WHAT)?;
    to.resize_with(from.len(), GroupState::default);
    for (from, to) in from.iter().zip(to) {
        (to.let_go, to.moves) = (from.let_go, from.moves);
        memory::replace(&mut to.grip, &from.grip, WHAT)?;
    }
    Ok(())
}

/// The groups of a body that is cut further, from `then` to `now`; `source` is the node that each of its nodes was.
///
/// # Errors
/// [`Error::OutOfMemory`].
pub(super) fn cut(
    states: &[GroupState],
    (then, now): (&Mesh, &Mesh),
    source: impl Fn(usize) -> usize,
) -> Result<Vec<GroupState>> {
    let mut made = memory::room(states.len(), WHAT)?;
    for (at, state) in states.iter().enumerate() {
        let (before, after) = (&then.supports[at].nodes, &now.supports[at].nodes);
        let mut grip = Vec::new();
        if let (false, rows) = (state.grip.is_empty(), state.grip.as_chunks::<3>().0) {
            grip = memory::room(3 * after.len(), WHAT)?;
            grip.extend(after.iter().flat_map(|node| {
                let row = before.binary_search(&(source(*node as usize) as u32));
                row.map_or([0.0; 3], |row| rows[row])
            }));
        }
        made.push(GroupState {
            let_go: state.let_go,
            grip,
            moves: state.moves,
        });
    }
    Ok(made)
}

/// Whether any group is not as it was meshed.
pub(super) fn acts(states: &[GroupState]) -> bool {
    states.iter().any(|state| state.moves)
}

/// Checks what was read.
///
/// # Errors
/// [`Error::Snapshot`].
pub(super) fn admit(states: &[GroupState], groups: &[NodeSet]) -> Result<()> {
    if !states.is_empty() && states.len() != groups.len() {
        return Err(Error::Snapshot("the support groups are others".into()));
    }
    for (state, group) in states.iter().zip(groups) {
        if !state.grip.is_empty() {
            stored::check(&state.grip, 3 * group.nodes.len())?;
        }
    }
    Ok(())
}
