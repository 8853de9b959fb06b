//! A frame with a collision field in place of instruments: nodes go where the host says, by the compliance of that time. Nodes that the
//! host has released since the step lose the force that held them.

use crate::contact::vector;
use crate::error::{Error, Result};
use crate::field::ContactSet;
use crate::kernels::Isa;
use crate::kernels::contact::ContactFactor;
use crate::memory::{self, HeldBytes};
use crate::prior::CoarseSpace;
use crate::prior::PriorTable;

/// What the forces at nodes are solved with: the linear response, and what inertia takes off it within the time of the frame.
pub(super) struct ResponseContext<'a> {
    pub isa: Isa,
    pub prior: &'a PriorTable,
    pub space: &'a CoarseSpace,
    /// [`CoarseSpace::inertial_compliance`].
    pub inertial_compliance: &'a [f32],
    pub held: &'a [bool],
}

/// Contact at nodes in a frame.
#[derive(HeldBytes)]
pub(super) struct DrivenNodes {
    pub of_step: Box<Nodes>,
    /// Where the host has them.
    pub now: ContactSet,
}

impl DrivenNodes {
    /// None.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn new() -> Result<DrivenNodes> {
        Ok(DrivenNodes {
            of_step: memory::boxed(Nodes::default(), "contact at nodes")?,
            now: ContactSet::default(),
        })
    }
}

/// The nodes of the step before a frame, and the change of their forces.
#[derive(Default, HeldBytes)]
pub(super) struct Nodes {
    /// Nodes in contact in the step, and the forces on them, mN `[m,3]`.
    pub then: Vec<u32>,
    pub forces: Vec<f32>,
    coupled: Coupled,
    kept: Kept,
    /// Of all columns and of those in contact now.
    pub dofs: Vec<u32>,
    /// The change of the force on each of `dofs` since the step, mN.
    pub change: Vec<f32>,
}

/// The columns of nodes that are in contact now or were in the step, and how they move each other.
#[derive(Default, HeldBytes)]
struct Coupled {
    /// Ascending, and whether a node is in contact now.
    columns: Vec<(u32, bool)>,
    /// The columns alone.
    only: Vec<u32>,
    /// The compliance between all of them `[3n,3n]`, upper triangle, mm/mN.
    upper: Vec<f64>,
    /// Scratch of what is read of the bundle's tables.
    widened: Vec<f32>,
}

/// Those in contact now, whose forces are solved for.
#[derive(Default, HeldBytes)]
struct Kept {
    /// Among [`Nodes::dofs`].
    places: Vec<u32>,
    factor: ContactFactor,
    /// How far each has to go beyond what the released forces do, mm, and the forces that take them there, mN.
    wanted: Vec<f32>,
    solved: Vec<f32>,
}

impl Nodes {
    /// How far of the way that the nodes would have gone at the step's velocities (mm/s) within `tau` they have gone; none where there are none.
    pub fn stretch(
        &self,
        now: &ContactSet,
        last: &[f32],
        velocity: &[f32],
        tau: f64,
    ) -> Option<f32> {
        /// mm².
        const SMALL: f32 = 0.05 * 0.05;
        // Beginning both with the same little: nodes that hardly move say that all of the way is gone.
        let (mut gone, mut wanted, mut known) = (SMALL, SMALL, false);
        for &node in &self.then {
            let Some(to) = now.at(node) else {
                continue;
            };
            let way = vector(velocity, node) * tau as f32;
            gone += way.dot(::contact::Vector::from(to) - vector(last, node));
            wanted += way.length_squared();
            known = true;
        }
        known.then(|| (gone / wanted).clamp(0.0, 1.0))
    }

    /// The change of the forces, in `dofs` and `change`, that takes the nodes from where the tissue is without them, `free`, to where the host
    /// has them now.
    ///
    /// # Errors
    /// [`Error::Bundle`] for a compliance that has no factor, [`Error::OutOfMemory`].
    pub fn solve(
        &mut self,
        means: &ResponseContext<'_>,
        now: &ContactSet,
        free: &[f32],
    ) -> Result<()> {
        const WHAT: &str = "the present state of a scene";
        let own = |node: u32| match means.prior.column_for(means.held, node) {
            Some((column, true)) => Some(column as u32),
            _ => None,
        };
        // All room is asked for before anything is written that lasts.
        let most = now.len() + self.then.len();
        self.coupled.columns.clear();
        memory::fit(&mut self.coupled.columns, most, WHAT)?;
        for list in [
            &mut self.coupled.only,
            &mut self.dofs,
            &mut self.kept.places,
        ] {
            list.clear();
            memory::fit(list, 3 * most, WHAT)?;
        }
        for list in [
            &mut self.change,
            &mut self.kept.wanted,
            &mut self.kept.solved,
        ] {
            list.clear();
            memory::fit(list, 3 * most, WHAT)?;
        }
        memory::fit(
            &mut self.coupled.widened,
            6 * means.prior.widest_block(),
            WHAT,
        )?;
        let there = now.nodes.iter().filter_map(|&node| own(node));
        self.coupled
            .columns
            .extend(there.map(|column| (column, true)));
        for &node in &self.then {
            if now.at(node).is_none()
                && let Some(column) = own(node)
            {
                self.coupled.columns.push((column, false));
            }
        }
        self.coupled.columns.sort_unstable();
        self.coupled
            .only
            .extend(self.coupled.columns.iter().map(|column| column.0));
        let order = 3 * self.coupled.only.len();
        memory::fit(&mut self.coupled.upper, order * order, WHAT)?;
        self.coupled.upper.clear();
        self.coupled.upper.resize(order * order, 0.0);
        let prior = means.prior;
        prior.gather_compliance(
            &self.coupled.only,
            &mut self.coupled.upper,
            &mut self.coupled.widened,
        );
        for column in &self.coupled.only {
            self.dofs.extend([0, 1, 2].map(|axis| 3 * column + axis));
        }
        for i in 0..order {
            let own = means.space.at_contact(self.dofs[i] as usize);
            for j in i..order {
                let other = means.space.at_contact(self.dofs[j] as usize);
                let pairs = means.inertial_compliance.iter().zip(own).zip(other);
                // `A_k = A - N diag(lost) N^T`: within the frame's time inertia holds back what the slow modes would do.
                let lost: f32 = pairs.map(|((lost, a), b)| lost * a * b).sum();
                self.coupled.upper[i * order + j] -= f64::from(lost);
            }
        }
        // What the released nodes were pushed with is taken back, ...
        self.change.resize(order, 0.0);
        for (at, &(column, stays)) in self.coupled.columns.iter().enumerate() {
            let node = prior.contact_nodes[column as usize];
            if !stays && let Ok(row) = self.then.binary_search(&node) {
                let force = &self.forces[3 * row..3 * row + 3];
                for (to, force) in self.change[3 * at..3 * at + 3].iter_mut().zip(force) {
                    *to = -force;
                }
            }
        }
        // ... and the others are pushed to their places.
        let stays = |at: &usize| self.coupled.columns[at / 3].1;
        self.kept
            .places
            .extend((0..order).filter(stays).map(|at| at as u32));
        let upper = &self.coupled.upper;
        let between = |i: usize, j: usize| upper[i.min(j) * order + i.max(j)];
        for &at in &self.kept.places {
            let at = at as usize;
            let node = prior.contact_nodes[self.coupled.only[at / 3] as usize];
            let place = free[3 * node as usize + at % 3];
            let wanted = now.at(node).map_or(place, |to| to[at % 3]);
            let released = (0..order).filter(|other| !self.coupled.columns[other / 3].1);
            let moved: f64 = released
                .map(|other| between(at, other) * f64::from(self.change[other]))
                .sum();
            self.kept.wanted.push(wanted - place - moved as f32);
        }
        // With nothing in contact any more the released forces are all there is.
        let count = self.kept.places.len();
        if count == 0 {
            return Ok(());
        }
        self.kept.factor.reserve(count)?;
        let held = &self.kept.places;
        self.kept
            .factor
            .factor(means.isa, held, |out| {
                for (i, &row) in held.iter().enumerate() {
                    for (j, &column) in held.iter().enumerate().skip(i) {
                        out[i * count + j] = between(row as usize, column as usize);
                    }
                }
            })
            .map_err(|error| Error::bundle("prior.safetensors", error.to_string()))?;
        self.kept.solved.resize(count, 0.0);
        self.kept
            .factor
            .solve(means.isa, &self.kept.wanted, &mut self.kept.solved);
        for (&at, &force) in self.kept.places.iter().zip(&self.kept.solved) {
            self.change[at as usize] = force;
        }
        Ok(())
    }
}
