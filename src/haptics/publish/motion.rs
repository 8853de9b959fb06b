//! How the tissue goes on after a step: what support groups that move carry it by, and the natural modes.
//!
//! With the columns `w` of the groups ([`Group`]) and the velocity of their nodes, `v_b = sum_j w_j (1/n) sum_B b_j v`. Samples go on at `v_b`, and the modes
//! swing about that: their velocity is that of `v - v_b`, and what drives them loses the damping of `v_b`.

use super::stepped::Stepped;
use crate::corrections::Group;
use crate::error::Result;
use crate::kernels::project::{project_field, row_dots};
use crate::memory::{self, HeldBytes};

const WHAT: &str = "the haptics of a scene";
/// What groups carry is followed for as many steps.
pub(super) const FOLLOWED_STEPS: f64 = 2.0;

/// Groups that move in a published state.
#[derive(Default, HeldBytes)]
pub(super) struct Carried {
    amounts: Vec<(usize, [f32; Group::MOST_COLUMNS])>,
}

impl Carried {
    /// Finds them at velocities `[K,3]`; what is let go, a bit each, carries nothing.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn look(&mut self, groups: &[Group], let_go: u64, velocity: &[f32]) -> Result<()> {
        self.amounts.clear();
        memory::fit(&mut self.amounts, groups.len(), WHAT)?;
        let rows = velocity.as_chunks::<3>().0;
        for (at, group) in groups.iter().enumerate() {
            let rests = |node: &u32| rows[*node as usize] == [0.0; 3];
            if let_go >> at & 1 != 0 || !group.has_lift() || group.nodes.iter().all(rests) {
                continue;
            }
            let amounts = group.amounts(|index| rows[group.nodes[index] as usize]);
            self.amounts.push((at, amounts));
        }
        Ok(())
    }

    /// `v_b` of a node, mm/s.
    pub fn velocity(&self, groups: &[Group], node: u32) -> [f32; 3] {
        let mut v = [0.0; 3];
        for (at, amounts) in &self.amounts {
            groups[*at].add(amounts, node, &mut v);
        }
        v
    }
}

/// A field of which the modes take their part.
#[derive(Clone, Copy)]
struct Field<'a> {
    /// `[K,3]`.
    of: &'a [f32],
    /// What is added to it `[K,3]`; empty for nothing.
    more: &'a [f32],
    /// Whether it is multiplied with the mass.
    by_mass: bool,
    /// Times the mass and `v_b`: what it loses.
    less: f32,
}

/// What the modes' part of a field is made with.
#[derive(HeldBytes)]
pub(super) struct ModalRoom {
    /// Where the basis of each block starts.
    pub starts: Vec<usize>,
    /// Mass of the natural modes, g, and the list `0..m` of their rows.
    pub masses: Vec<f32>,
    pub rows: Vec<u32>,
    /// A field `[K,3]` that is projected on the modes, and its block coordinates `[Q]`.
    pub field: Vec<f32>,
    pub coordinates: Vec<f32>,
}

/// Velocity and drive of each natural mode: `N^T M (v - v_b) / m` and `N^T (f - alpha M v_b) / m`.
///
/// # Errors
/// [`crate::Error::OutOfMemory`]; [`crate::Error::Panic`] of a worker.
pub(super) fn modal(
    step: &Stepped<'_>,
    carried: &mut Carried,
    room: &mut ModalRoom,
    [velocity, drive]: [&mut [f32]; 2],
) -> Result<()> {
    let (body, groups) = (&step.corrections.body, step.corrections.groups.as_slice());
    carried.look(groups, step.let_go, &step.motion.velocity)?;
    let mut project = |field: Field<'_>, out: &mut [f32]| -> Result<()> {
        let rows = room.field.as_chunks_mut::<3>().0.iter_mut();
        for (node, (to, from)) in rows.zip(field.of.as_chunks::<3>().0).enumerate() {
            let mass = body.mass[node];
            let own = if field.by_mass { mass } else { 1.0 };
            let base = carried.velocity(groups, node as u32);
            *to = match body.held.is[node] {
                true => [0.0; 3],
                false => [0, 1, 2].map(|k| {
                    let more = field.more.get(3 * node + k).copied().unwrap_or(0.0);
                    own * from[k] + more - field.less * mass * base[k]
                }),
            };
        }
        let (isa, pool, q) = (step.compute.isa, step.compute.pool, &mut *room.coordinates);
        project_field(isa, pool, &step.prior.basis(), &room.starts, &room.field, q)?;
        row_dots(
            isa,
            pool,
            step.corrections.space.modes(),
            &room.rows,
            q,
            out,
        )?;
        for (out, mass) in out.iter_mut().zip(&room.masses) {
            *out /= mass;
        }
        Ok(())
    };
    let moves = Field {
        of: &step.motion.velocity,
        more: &[],
        by_mass: true,
        less: 1.0,
    };
    let pushes = Field {
        of: &step.motion.inertia,
        // What acts beside contact goes on as it was, and drives nothing.
        more: &step.motion.load,
        by_mass: false,
        less: step.integrator.damping_per_s as f32,
    };
    project(moves, velocity)?;
    project(pushes, drive)
}
