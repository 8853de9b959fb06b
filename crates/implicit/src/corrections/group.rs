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
    /// `w [3j][3K]`, by function, then axis; of a cut body those of the intact one.
    pub(super) columns: Arc<Vec<Vec<f32>>>,
    /// Of each copy of a node of a cut body: the node that it stems from, whose answer it has.
    pub(super) parents: Vec<u32>,
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
        let Some(lift) = self.lift.get() else {
            return;
        };
        for (amount, column) in amounts.iter().zip(&*lift.columns) {
            let own = lift.row(column, node as usize);
            (u.iter_mut().zip(own)).for_each(|(u, w)| *u += amount * w);
        }
    }
}

impl Lift {
    /// What a column does at a node.
    pub(super) fn row(&self, column: &[f32], node: usize) -> [f32; 3] {
        let at = match node.checked_sub(column.len() / 3) {
            Some(copy) => self.parents.get(copy).map_or(0, |parent| *parent as usize),
            None => node,
        };
        [0, 1, 2].map(|axis| column[3 * at + axis])
    }

    /// Adds so much of a column to a field of all nodes.
    pub(super) fn add(&self, (column, amount): (&[f32], f32), u: &mut [f32]) {
        let (own, copies) = u.split_at_mut(column.len().min(u.len()));
        own.iter_mut()
            .zip(column)
            .for_each(|(u, w)| *u += amount * w);
        for (u, parent) in copies.as_chunks_mut::<3>().0.iter_mut().zip(&self.parents) {
            let from = &column[3 * *parent as usize..][..3];
            u.iter_mut().zip(from).for_each(|(u, w)| *u += amount * w);
        }
    }

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
        // A cut body may have lost all of a group.
        sums.map(|sum| (sum / count.max(1) as f64) as f32)
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
