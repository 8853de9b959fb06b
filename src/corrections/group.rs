//! Support groups of a bundle, and what their motions do to the body ([`super::lift`] makes it).

use std::sync::{Arc, OnceLock};

use super::whole::WholeModes;
use crate::bundle::Mesh;
use crate::error::Result;
use crate::memory::{self, HeldBytes};

const WHAT: &str = "the support groups of the corrections";

/// A support group of the bundle.
pub struct Group {
    /// Ascending.
    pub nodes: Vec<u32>,
    pub(super) lift: OnceLock<Lift>,
}

/// The answer of the body to a group's motions.
pub struct Lift {
    /// `b_j [j][n]`.
    pub(super) functions: Vec<Vec<f32>>,
    /// `w [3j][3K]`, by function, then axis.
    pub(super) columns: Vec<Vec<f32>>,
}

/// What groups do that have been let go.
#[derive(Default)]
pub struct GroupModes(pub(super) Option<Arc<WholeModes>>);

impl GroupModes {
    /// Whether they have been made.
    pub fn is_made(&self) -> bool {
        self.0.is_some()
    }
}

impl HeldBytes for GroupModes {
    fn held_bytes(&self) -> usize {
        self.0.as_ref().map_or(0, |modes| modes.held_bytes())
    }
}

impl Group {
    /// One and three coordinates along three axes.
    pub const MOST_COLUMNS: usize = 12;

    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn new(nodes: &[u32]) -> Result<Group> {
        Ok(Group {
            nodes: memory::copied(nodes, WHAT)?,
            lift: OnceLock::new(),
        })
    }

    /// Whether its columns have been made: a step has moved it, in any scene of the model.
    pub fn has_lift(&self) -> bool {
        self.lift.get().is_some()
    }

    /// What of a change at its nodes each column has; zero where none has been made.
    pub fn amounts(&self, change: impl Fn(usize) -> [f32; 3]) -> [f32; Group::MOST_COLUMNS] {
        (self.lift.get()).map_or([0.0; Group::MOST_COLUMNS], |lift| lift.amounts(change))
    }

    /// Adds to a node what those amounts of the columns do there.
    pub fn add(&self, amounts: &[f32], node: u32, u: &mut [f32; 3]) {
        let columns = self.lift.get().map_or(&[][..], |lift| &lift.columns);
        for (amount, column) in amounts.iter().zip(columns) {
            let own = &column[3 * node as usize..][..3];
            (u.iter_mut().zip(own)).for_each(|(u, w)| *u += amount * w);
        }
    }
}

impl Lift {
    /// What of a change of the group's displacement each column has.
    pub(super) fn amounts(&self, change: impl Fn(usize) -> [f32; 3]) -> [f32; Group::MOST_COLUMNS] {
        let mut sums = [0.0f64; Group::MOST_COLUMNS];
        let count = self.functions[0].len();
        for at in 0..count {
            let change = change(at);
            for (function, sums) in self.functions.iter().zip(sums.chunks_exact_mut(3)) {
                let value = f64::from(function[at]);
                sums.iter_mut()
                    .zip(change)
                    .for_each(|(sum, change)| *sum += value * f64::from(change));
            }
        }
        sums.map(|sum| (sum / count as f64) as f32)
    }
}

/// Those of a mesh.
///
/// # Errors
/// [`crate::Error::OutOfMemory`].
pub(super) fn groups(mesh: &Mesh) -> Result<Vec<Group>> {
    let groups = mesh.supports.iter();
    groups.map(|group| Group::new(&group.nodes)).collect()
}
