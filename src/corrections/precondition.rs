//! The preconditioner of the corrections: two levels, zero at prescribed nodes.
//!
//! `P = w D^-1 + Psi (Psi^T (K + kappa M) Psi)^-1 Psi^T`, `w = 0.4`, with the 3x3 diagonal blocks `D` of `K + kappa M` and the modes
//! less their own response to what they do at the contact, `Psi = Phi - L_C(Phi_C)`. `L_C` is the response of `K + kappa M`
//! (the prior's columns less what inertia holds back), so `Psi^T (K + kappa M) Psi = Phi^T (K + kappa M) Phi -
//! Phi_C^T A_k,CC^-1 Phi_C` holds without a further product.
//!
//! Under loads the touched nodes move: the responses `W` to forces on them join the modes in the coarse space, whose Galerkin inverse
//! is `Psi (..)^-1 Psi^T + W A_k,CC^-1 W^T`. Without them the tissue's stiffening under a tool takes tens of iterations.
//!
//! All products with fields go through the prior's block-wise bases: `U^T` once, the modes and columns on coordinates, `U` once.

mod response;

use super::body::Body;
use super::pace::Pace;
use super::space::CoarseSpace;
use crate::error::{Error, Result};
use crate::kernels::contact::ContactFactor;
use crate::kernels::project::{project_field, row_dots};
use crate::kernels::rows::{RowPlan, decode_rows};
use crate::kernels::{Isa, Pool};
use crate::memory;
use crate::prior::PriorTable;

/// Weight of the diagonal level; 1.0 and 0.15 are three to seven times worse.
const DIAGONAL_WEIGHT: f32 = 0.4;

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
    pub pace: &'a Pace,
}

pub(super) fn pooled<T>(result: std::result::Result<T, crate::kernels::PoolError>) -> Result<T> {
    result.map_err(|error| Error::Panic(error.to_string()))
}

/// The preconditioner for one set of prescribed nodes, and its buffers.
pub struct Preconditioner {
    held_back: Vec<f32>,
    /// `1 / (m (w² + kappa))` of each natural mode, mm/µN.
    #[cfg(feature = "contact")]
    moved_freely: Vec<f32>,
    starts: Vec<usize>,
    plan: RowPlan,
    /// Contact dofs with columns, as rows of the prior's tables.
    dofs: Vec<u32>,
    columns: Vec<u32>,
    /// Prescribed nodes, ascending.
    nodes: Vec<u32>,
    /// `A_k,CC`.
    compliance: ContactFactor,
    /// `A_k,CC^-1 Phi_C [3m,r]`, mN/mm.
    through: Vec<f32>,
    galerkin: ContactFactor,
    galerkin_free: Vec<f64>,
    widened: Vec<f32>,
    coordinates: Vec<f32>,
    on_modes: Vec<f32>,
    solved: Vec<f32>,
    at_contact: Vec<f32>,
    forces: Vec<f32>,
    /// The nodes are loaded, not prescribed: they move.
    loaded: bool,
    ready: bool,
}

impl Preconditioner {
    /// Buffers; the factors are made at the first [`Preconditioner::prescribe`].
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn new(env: Env<'_>) -> Result<Preconditioner> {
        let kappa = env.pace.integrator.kappa();
        let count = env.space.count();
        let dofs = 3 * env.prior.contact_nodes.len();
        let room = dofs.min(ROOM);
        let nodes = memory::collected(env.body.mass.len(), 0..env.body.mass.len() as u32, WHAT)?;
        Ok(Preconditioner {
            held_back: env.space.held_back(kappa),
            #[cfg(feature = "contact")]
            moved_freely: env.space.moved_freely(kappa),
            starts: env.prior.basis_starts(),
            plan: RowPlan::try_region(&env.prior.basis(), &nodes, false)?,
            dofs: memory::room(dofs, WHAT)?,
            columns: memory::room(dofs / 3, WHAT)?,
            nodes,
            compliance: ContactFactor::try_with_capacity(room)?,
            through: memory::room(room * count, WHAT)?,
            galerkin: ContactFactor::try_with_capacity(count)?,
            galerkin_free: env.space.galerkin(kappa)?,
            widened: memory::zeros(6 * env.prior.widest_block(), WHAT)?,
            coordinates: memory::zeros(env.prior.width(), WHAT)?,
            on_modes: memory::zeros(count, WHAT)?,
            solved: memory::zeros(count, WHAT)?,
            at_contact: memory::room(room, WHAT)?,
            forces: memory::room(room, WHAT)?,
            loaded: false,
            ready: false,
        })
    }

    /// Makes room for `order` prescribed degrees of freedom; contacts of up to [`ROOM`] have it.
    fn reserve(&mut self, order: usize, count: usize) -> Result<()> {
        self.compliance.reserve(order)?;
        for (list, wanted) in [
            (&mut self.through, order * count),
            (&mut self.at_contact, order),
            (&mut self.forces, order),
        ] {
            let more = wanted.saturating_sub(list.len());
            memory::reserve(list, more, WHAT)?;
            list.resize(wanted, 0.0);
        }
        Ok(())
    }

    /// Takes the prescribed nodes (ascending); cheap where they are those of the last call.
    pub fn prescribe(&mut self, env: Env<'_>, nodes: &[u32]) -> Result<()> {
        self.take(env, nodes, false)
    }

    /// Takes nodes that loads act on (ascending): the responses to forces on them join the modes in the coarse space.
    #[cfg(feature = "contact")]
    pub fn engage(&mut self, env: Env<'_>, nodes: &[u32]) -> Result<()> {
        self.take(env, nodes, true)
    }

    fn take(&mut self, env: Env<'_>, nodes: &[u32], loaded: bool) -> Result<()> {
        if self.ready && self.nodes == nodes {
            self.loaded = loaded;
            return Ok(());
        }
        self.ready = false;
        self.loaded = loaded;
        self.nodes.clear();
        self.nodes.extend_from_slice(nodes);
        self.columns.clear();
        self.dofs.clear();
        for &node in nodes {
            if let Some((column, true)) = env.prior.column_for(&env.body.held, node) {
                self.columns.push(column as u32);
                self.dofs
                    .extend([0, 1, 2].map(|axis| 3 * column as u32 + axis));
            }
        }
        let (order, count) = (self.dofs.len(), env.space.count());
        let bad = |error: crate::kernels::contact::FactorError| {
            Error::bundle("corrections.safetensors", error.to_string())
        };
        self.reserve(order, count)?;
        if order > 0 {
            let (columns, dofs, widened) = (&self.columns, &self.dofs, &mut self.widened);
            let held_back = &self.held_back;
            self.compliance
                .factor(env.isa, dofs, |upper| {
                    env.prior.gather_compliance(columns, upper, widened);
                    for (i, &row) in dofs.iter().enumerate() {
                        let own = env.space.at_contact(row as usize);
                        for (j, &column) in dofs.iter().enumerate().skip(i) {
                            let other = env.space.at_contact(column as usize);
                            let lost: f32 = held_back
                                .iter()
                                .zip(own)
                                .zip(other)
                                .map(|((d, a), b)| d * a * b)
                                .sum();
                            upper[i * order + j] -= f64::from(lost);
                        }
                    }
                })
                .map_err(bad)?;
            for mode in 0..count {
                for (value, &dof) in self.at_contact.iter_mut().zip(&self.dofs) {
                    *value = env.space.at_contact(dof as usize)[mode];
                }
                self.compliance
                    .solve(env.isa, &self.at_contact, &mut self.forces);
                for (row, &force) in self.through.chunks_exact_mut(count).zip(&self.forces) {
                    row[mode] = force;
                }
            }
        }
        let (dofs, through, free) = (&self.dofs, &self.through, &self.galerkin_free);
        self.galerkin
            .factor(env.isa, env.space.rows(), |upper| {
                upper.copy_from_slice(free);
                for (&dof, through) in dofs.iter().zip(through.chunks_exact(count)) {
                    let own = env.space.at_contact(dof as usize);
                    for (row, &own) in upper.chunks_exact_mut(count).zip(own) {
                        let own = 1e3 * f64::from(own);
                        for (value, &through) in row.iter_mut().zip(through) {
                            *value -= own * f64::from(through);
                        }
                    }
                }
            })
            .map_err(bad)?;
        self.ready = true;
        Ok(())
    }

    /// `z = P r`, both `[K,3]`, µN to mm. `r` must be zero at held and prescribed nodes.
    pub fn apply(&mut self, env: Env<'_>, r: &[f32], z: &mut [f32]) -> Result<()> {
        let (isa, pool) = (env.isa, env.pool);
        let basis = env.prior.basis();
        pooled(project_field(
            isa,
            pool,
            &basis,
            &self.starts,
            r,
            &mut self.coordinates,
        ))?;
        let modes = env.space.modes();
        let rows = env.space.rows();
        pooled(row_dots(
            isa,
            pool,
            modes,
            rows,
            &self.coordinates,
            &mut self.on_modes,
        ))?;
        self.contact_work(env)?;
        // Psi^T r.
        for (force, through) in self
            .at_contact
            .iter()
            .zip(self.through.chunks_exact(rows.len()))
        {
            for (sum, &through) in self.on_modes.iter_mut().zip(through) {
                *sum -= force * through;
            }
        }
        self.galerkin.solve(isa, &self.on_modes, &mut self.solved);
        // Forces at the contact, mN: those that keep it where it is, and under loads what it lacks besides.
        if self.loaded && !self.dofs.is_empty() {
            self.compliance
                .solve(isa, &self.at_contact, &mut self.forces);
            self.forces.iter_mut().for_each(|force| *force *= 1e-3);
        } else {
            self.forces.fill(0.0);
        }
        for (force, through) in self
            .forces
            .iter_mut()
            .zip(self.through.chunks_exact(rows.len()))
        {
            *force -= through
                .iter()
                .zip(&self.solved)
                .map(|(t, y)| t * y)
                .sum::<f32>();
        }
        self.spread(env)?;
        pooled(decode_rows(
            isa,
            pool,
            &basis,
            &self.plan,
            &self.coordinates,
            z,
        ))?;
        let blocks = env.pace.inverse_blocks.iter();
        for ((z, r), [xx, xy, xz, yy, yz, zz]) in z
            .as_chunks_mut::<3>()
            .0
            .iter_mut()
            .zip(r.as_chunks::<3>().0)
            .zip(blocks)
        {
            let w = DIAGONAL_WEIGHT;
            z[0] += w * (xx * r[0] + xy * r[1] + xz * r[2]);
            z[1] += w * (xy * r[0] + yy * r[1] + yz * r[2]);
            z[2] += w * (xz * r[0] + yz * r[1] + zz * r[2]);
        }
        if !self.loaded {
            mask(&self.nodes, z);
        }
        mask_held(&env.body.held, z);
        Ok(())
    }

    /// `at_contact = W^T r` of the columns in contact, from `coordinates = U^T r` and `on_modes = Phi^T r`.
    fn contact_work(&mut self, env: Env<'_>) -> Result<()> {
        pooled(row_dots(
            env.isa,
            env.pool,
            env.prior.response.stored(),
            &self.dofs,
            &self.coordinates,
            &mut self.at_contact,
        ))?;
        for (work, &dof) in self.at_contact.iter_mut().zip(&self.dofs) {
            let own = env.space.at_contact(dof as usize);
            for ((held_back, own), on_mode) in self.held_back.iter().zip(own).zip(&self.on_modes) {
                *work -= held_back * own * on_mode;
            }
        }
        Ok(())
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        let lists = self.through.capacity()
            + self.dofs.capacity()
            + self.columns.capacity()
            + self.nodes.capacity()
            + self.widened.len()
            + self.coordinates.len()
            + self.at_contact.capacity()
            + self.forces.capacity();
        4 * lists
            + 8 * self.galerkin_free.len()
            + self.compliance.memory_bytes()
            + self.galerkin.memory_bytes()
            + self.plan.memory_bytes()
    }
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
