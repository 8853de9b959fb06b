//! The preconditioner of the corrections: two levels, zero at prescribed nodes.
//!
//! `P = w D^-1 + Psi (Psi^T (K + kappa M) Psi)^-1 Psi^T`, `w = 0.4`, with the 3x3 diagonal blocks `D` of `K + kappa M` and the modes
//! less their own response to what they do at the contact, `Psi = Phi - L_C(Phi_C)`. `L_C` is the response of `K + kappa M`
//! (the prior's columns less what inertia holds back), so `Psi^T (K + kappa M) Psi = Phi^T (K + kappa M) Phi -
//! Phi_C^T A_k,CC^-1 Phi_C` holds without a further product.
//!
//! All products with fields go through the prior's block-wise bases: `U^T` once, the modes and columns on coordinates, `U` once.

mod loaded;
mod near;
mod parts;
mod response;

use self::parts::{Basis, Galerkin, Modal, PrescribedContact, WholeLevel};
use super::body::Body;
use super::boundary::Held;
use super::time_step::TimeStep;
use super::whole::WholeModes;
use crate::error::{Error, Result};
use crate::kernels::contact::{ContactFactor, subtract_gram};
use crate::kernels::project::{project_field, row_dots};
use crate::kernels::rows::{RowPlan, decode_rows};
use crate::kernels::{Isa, Pool};
use crate::memory::{self, HeldBytes};
use crate::prior::{CoarseSpace, PriorTable};

/// Weight of the diagonal level; 1.0 and 0.15 are three to seven times worse.
pub(super) const DIAGONAL_WEIGHT: f32 = 0.4;

/// Degrees of freedom in contact for which there is room from the start.
const ROOM: usize = 768;
const WHAT: &str = "the corrections' preconditioner";

/// What every product needs.
#[derive(Clone, Copy)]
pub struct Env<'a> {
    pub isa: Isa,
    pub pool: &'a Pool,
    pub prior: &'a PriorTable,
    pub space: &'a CoarseSpace,
    pub body: &'a Body,
    pub time_step: &'a TimeStep,
    /// Read by then where the step has a load.
    pub whole: Option<&'a WholeModes>,
    /// What holds the body in the step.
    pub held: &'a Held,
}

/// The preconditioner for one set of prescribed nodes, and its buffers.
#[derive(HeldBytes)]
pub struct Preconditioner {
    modal: Modal,
    pub(super) basis: Basis,
    contact: PrescribedContact,
    galerkin: Galerkin,
    /// `U^T r` on the way down, `U^T z` on the way up `[Q]`: every product with a field goes through here.
    pub(super) coordinates: Vec<f32>,
    /// `Phi^T r` and what the coarse level makes of it, in amplitudes of the modes `[r]`.
    on_modes: Vec<f32>,
    solved: Vec<f32>,
    /// Prescribed nodes, ascending.
    nodes: Vec<u32>,
    /// The factors are of `nodes`.
    ready: bool,
    pub(super) whole: WholeLevel,
}

impl Preconditioner {
    /// Buffers; the factors are made at the first [`Preconditioner::prescribe`].
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn new(env: Env<'_>) -> Result<Preconditioner> {
        let kappa = env.time_step.integrator.kappa();
        let count = env.space.count();
        let dofs = 3 * env.prior.contact_nodes.len();
        let room = dofs.min(ROOM);
        let nodes = memory::collected(env.body.mass.len(), 0..env.body.mass.len() as u32, WHAT)?;
        let domain_nodes = {
            let inside = nodes
                .iter()
                .copied()
                .filter(|node| env.prior.in_domain[*node as usize]);
            memory::collected(nodes.len(), inside, WHAT)?
        };
        // `Phi^T (K + kappa M) Phi = G_K + kappa G_M`: both Gram matrices are in the bundle, so another length of step costs no product with a field.
        let galerkin_free = env.space.galerkin(kappa)?;
        Ok(Preconditioner {
            modal: Modal {
                inertial_compliance: env.space.inertial_compliance(kappa)?,
                moved_freely: env.space.moved_freely(kappa)?,
            },
            basis: Basis {
                starts: env.prior.basis_starts()?,
                plan: RowPlan::try_region(&env.prior.basis(), &nodes, false)?,
                domain: RowPlan::try_region(&env.prior.basis(), &domain_nodes, false)?,
                domain_nodes,
            },
            contact: PrescribedContact {
                dofs: memory::room(dofs, WHAT)?,
                columns: memory::room(dofs / 3, WHAT)?,
                compliance: ContactFactor::try_with_capacity(room)?,
                whitened: memory::room(room * count, WHAT)?,
                lost: memory::room(room, WHAT)?,
                natural: memory::room(room * env.space.natural_count(), WHAT)?,
                moved: memory::room(room, WHAT)?,
                forces: memory::room(room, WHAT)?,
                stored: Vec::new(),
                widened: memory::zeros(6 * env.prior.widest_block(), WHAT)?,
            },
            galerkin: Galerkin {
                held: ContactFactor::try_with_capacity(count)?,
                narrow: {
                    let narrow = galerkin_free.iter().map(|&value| value as f32);
                    memory::collected(galerkin_free.len(), narrow, WHAT)?
                },
                free: galerkin_free,
                inverse: env.space.galerkin_inverse(kappa, env.isa)?,
            },
            coordinates: memory::zeros(env.prior.width(), WHAT)?,
            on_modes: memory::zeros(count, WHAT)?,
            solved: memory::zeros(count, WHAT)?,
            nodes,
            ready: false,
            whole: WholeLevel::default(),
        })
    }

    /// Makes room for `order` prescribed degrees of freedom; contacts of up to [`ROOM`] have it.
    fn reserve(&mut self, order: usize, count: usize) -> Result<()> {
        self.contact.compliance.reserve(order)?;
        let more = (order * count).saturating_sub(self.contact.whitened.len());
        memory::reserve(&mut self.contact.whitened, more, WHAT)?;
        self.contact.whitened.resize(order * count, 0.0);
        for (list, wanted) in [
            (
                &mut self.contact.natural,
                order * self.modal.inertial_compliance.len(),
            ),
            (&mut self.contact.lost, order),
            (&mut self.contact.moved, order),
            (&mut self.contact.forces, order),
        ] {
            let more = wanted.saturating_sub(list.len());
            memory::reserve(list, more, WHAT)?;
            list.resize(wanted, 0.0);
        }
        Ok(())
    }

    /// Takes the prescribed nodes (ascending); cheap where they are those of the last call.
    pub fn prescribe(&mut self, env: Env<'_>, nodes: &[u32]) -> Result<()> {
        // The factors depend on which nodes are prescribed, not on where they go.
        if self.ready && self.nodes == nodes {
            return Ok(());
        }
        self.ready = false;
        self.nodes.clear();
        self.nodes.extend_from_slice(nodes);
        self.contact.columns.clear();
        self.contact.dofs.clear();
        for &node in nodes {
            if let Some((column, true)) = env.prior.column_for(&env.held.is, node) {
                self.contact.columns.push(column as u32);
                self.contact
                    .dofs
                    .extend([0, 1, 2].map(|axis| 3 * column as u32 + axis));
            }
        }
        let (order, count) = (self.contact.dofs.len(), env.space.count());
        let bad = |error: crate::kernels::contact::FactorError| {
            Error::bundle("corrections.safetensors", error.to_string())
        };
        self.reserve(order, count)?;
        if order > 0 {
            for (at, &dof) in self.contact.dofs.iter().enumerate() {
                let own = env.space.at_contact(dof as usize);
                for (mode, value) in own[..self.modal.inertial_compliance.len()]
                    .iter()
                    .enumerate()
                {
                    self.contact.natural[mode * order + at] = *value;
                }
                for (to, &from) in self.contact.whitened[at * count..][..count]
                    .iter_mut()
                    .zip(own)
                {
                    *to = f64::from(from);
                }
            }
            let (columns, widened) = (&self.contact.columns, &mut self.contact.widened);
            let (inertial_compliance, natural) =
                (&self.modal.inertial_compliance, &self.contact.natural);
            let lost = &mut self.contact.lost;
            self.contact
                .compliance
                .factor(env.isa, &self.contact.dofs, |upper| {
                    env.prior.gather_compliance(columns, upper, widened);
                    for (at, row) in upper.chunks_exact_mut(order).enumerate() {
                        lose(inertial_compliance, natural, at, lost);
                        for (value, lost) in row[at..].iter_mut().zip(&lost[at..]) {
                            *value -= f64::from(*lost);
                        }
                    }
                })
                .map_err(bad)?;
            self.contact
                .compliance
                .whiten(env.isa, count, &mut self.contact.whitened);
        }
        let (whitened, free) = (&self.contact.whitened, &self.galerkin.free);
        let rows = env.space.rows();
        // `Psi^T (K + kappa M) Psi = Phi^T (K + kappa M) Phi - 1e3 V^T V` with `V = R^-T Phi_C`: the Schur complement of the contact; 1e3 takes mN to µN.
        let less = self.galerkin.held.factor(env.isa, rows, |upper| {
            upper.copy_from_slice(free);
            subtract_gram(env.isa, whitened, count, 1e3, upper);
        });
        if less.is_err() {
            // Not positive: what the tables and a short step leave out can make the contact's part
            // larger than the whole. The matrix without contact is positive, and serves as a
            // preconditioner, too.
            // The contact takes more than there is, by what the tables and a short step leave out: the whole is positive, and does.
            self.galerkin
                .held
                .factor(env.isa, rows, |upper| upper.copy_from_slice(free))
                .map_err(bad)?;
        }
        self.ready = true;
        Ok(())
    }

    /// `z = P r`, both `[K,3]`, µN to mm. `r` must be zero at held and prescribed nodes.
    pub fn apply(&mut self, env: Env<'_>, r: &[f32], z: &mut [f32]) -> Result<()> {
        let (isa, pool) = (env.isa, env.pool);
        let basis = env.prior.basis();
        // Down to coordinates once, the coarse level there, and up once; the diagonal level is added to the field.
        project_field(
            isa,
            pool,
            &basis,
            &self.basis.starts,
            r,
            &mut self.coordinates,
        )?;
        let whole = self.whole_modes(env);
        self.coarse(env, whole.map(|modes| (modes, r)))?;
        decode_rows(isa, pool, &basis, &self.basis.plan, &self.coordinates, z)?;
        if let (Some(modes), Some(solve)) = (whole, &self.whole.solve) {
            solve.add(env.compute(), modes, z)?;
        }
        let blocks = env.time_step.inverse_blocks.iter();
        for ((z, r), [xx, xy, xz, yy, yz, zz]) in z
            .as_chunks_mut::<3>()
            .0
            .iter_mut()
            .zip(r.as_chunks::<3>().0)
            .zip(blocks)
        {
            // The first level, node by node: the inverse of the 3 x 3 block in its six numbers, mm/µN.
            let w = DIAGONAL_WEIGHT;
            z[0] += w * (xx * r[0] + xy * r[1] + xz * r[2]);
            z[1] += w * (xy * r[0] + yy * r[1] + yz * r[2]);
            z[2] += w * (xz * r[0] + yz * r[1] + zz * r[2]);
        }
        // Prescribed and held nodes do not move: on them `P` is zero from both sides, which keeps it symmetric.
        mask(&self.nodes, z);
        mask_held(&env.held.is, z);
        Ok(())
    }

    /// The coarse level in coordinates: `coordinates` of a residual become those of the field that it asks for.
    ///
    /// With whole modes, for the residual there: what is left of their field is theirs to add.
    fn coarse(&mut self, env: Env<'_>, whole: Option<(&WholeModes, &[f32])>) -> Result<()> {
        let (isa, pool) = (env.isa, env.pool);
        let rows = env.space.rows();
        row_dots(
            isa,
            pool,
            env.space.modes(),
            rows,
            &self.coordinates,
            &mut self.on_modes,
        )?;
        if let (Some((modes, r)), Some(own)) = (whole, &mut self.whole.solve) {
            own.solve(env.compute(), modes, r, &self.on_modes)?;
        }
        if !self.contact.dofs.is_empty() {
            self.contact_work(env)?;
        }
        self.solve_coarse(env);
        if let (Some(_), Some(own)) = (whole, &self.whole.solve) {
            own.take_off(&mut self.solved);
        }
        self.spread(env)
    }

    /// `solved` and `forces` from `on_modes = Phi^T r` and `at_contact = W^T r`.
    fn solve_coarse(&mut self, env: Env<'_>) {
        let isa = env.isa;
        if self.contact.dofs.is_empty() {
            self.galerkin
                .held
                .solve(isa, &self.on_modes, &mut self.solved);
            return;
        }
        // Psi^T r = Phi^T r - Phi_C^T A_k,CC^-1 W^T r.
        self.contact
            .compliance
            .solve(isa, &self.contact.moved, &mut self.contact.forces);
        for (force, &dof) in self.contact.forces.iter().zip(&self.contact.dofs) {
            let own = env.space.at_contact(dof as usize);
            for (sum, own) in self.on_modes.iter_mut().zip(own) {
                *sum -= force * own;
            }
        }
        self.galerkin
            .held
            .solve(isa, &self.on_modes, &mut self.solved);
        // Forces that keep the contact where it is, mN.
        for (value, &dof) in self.contact.moved.iter_mut().zip(&self.contact.dofs) {
            let own = env.space.at_contact(dof as usize);
            *value = -inner(own, &self.solved);
        }
        self.contact
            .compliance
            .solve(isa, &self.contact.moved, &mut self.contact.forces);
    }

    /// `at_contact = W^T r` of the columns in contact, from `coordinates = U^T r` and `on_modes = Phi^T r`.
    fn contact_work(&mut self, env: Env<'_>) -> Result<()> {
        env.prior.response.dots(
            env.isa,
            env.pool,
            env.prior
                .stored_dofs(&self.contact.dofs, &mut self.contact.stored)?,
            &self.coordinates,
            &mut self.contact.moved,
        )?;
        for (work, &dof) in self.contact.moved.iter_mut().zip(&self.contact.dofs) {
            let own = env.space.at_contact(dof as usize);
            for ((inertial_compliance, own), on_mode) in self
                .modal
                .inertial_compliance
                .iter()
                .zip(own)
                .zip(&self.on_modes)
            {
                *work -= inertial_compliance * own * on_mode;
            }
        }
        Ok(())
    }
}

/// Row `at` of what inertia takes off the compliance, from its diagonal on: `sum_n held_back_n N_n,at N_n`.
fn lose(inertial_compliance: &[f32], natural: &[f32], at: usize, lost: &mut [f32]) {
    let order = lost.len();
    let lost = &mut lost[at..];
    lost.fill(0.0);
    for (mode, inertial_compliance) in natural.chunks_exact(order).zip(inertial_compliance) {
        let factor = inertial_compliance * mode[at];
        for (lost, value) in lost.iter_mut().zip(&mode[at..]) {
            *lost += factor * value;
        }
    }
}

/// An inner product in lanes.
fn inner(a: &[f32], b: &[f32]) -> f32 {
    let mut lanes = [0.0f32; 16];
    for (a, b) in a.chunks(16).zip(b.chunks(16)) {
        for ((lane, a), b) in lanes.iter_mut().zip(a).zip(b) {
            *lane += a * b;
        }
    }
    lanes.iter().sum()
}

/// Zero at the nodes.
pub(super) fn mask(nodes: &[u32], field: &mut [f32]) {
    for &node in nodes {
        field[3 * node as usize..3 * node as usize + 3].fill(0.0);
    }
}

/// Zero at held nodes.
pub(super) fn mask_held(held: &[bool], field: &mut [f32]) {
    for (row, &held) in field.as_chunks_mut::<3>().0.iter_mut().zip(held) {
        if held {
            *row = [0.0; 3];
        }
    }
}
