//! Whole modes: what the body does under a load that acts everywhere and the prior's block bases do not hold.
//!
//! The bases are made of responses to contact in the domain. What contact hardly moves (the other hemisphere of a brain) they cannot swing, and
//! the modes of the corrections, which live in them, neither. So a bundle may have natural modes as whole fields `V [m,3K]`, less what `Phi` has
//! of them. With `A = K + kappa M` the coarse level of a step without contact is that of both together,
//!
//! ```text
//! X = G^-1 Phi^T A V        V' = V - Phi X        S = V'^T A V' = V^T A V - (Phi^T A V)^T X
//! [Phi V] (([Phi V]^T A [Phi V])^-1 [Phi V]^T = Phi G^-1 Phi^T + V' S^-1 V'^T
//! ```

use std::sync::Arc;

use crate::bundle::TensorFile;
use crate::error::{Error, Result};
use crate::kernels::Compute;
use crate::kernels::contact::ContactFactor;
use crate::kernels::vectors::{PartialSums, add_scaled, dots};
use crate::memory::{self, HeldBytes};
use crate::prior::{CoarseSpace, LostElements};

const WHAT: &str = "the whole modes of the corrections";
/// Fields of a pass: a residual is read once for eight of them.
const AT_ONCE: usize = 8;
/// Most modes that a file may hold: each is a field of the whole body.
const LIMIT: usize = 256;

/// The tables of a bundle.
#[derive(HeldBytes)]
pub struct WholeModes {
    /// `V [m,3K]`, zero at held nodes; a cut body has those of the intact one.
    #[held(own)]
    fields: Arc<Vec<f32>>,
    /// Of each copy of a node of a cut body: the node that it stems from, whose values it has.
    parents: Vec<u32>,
    /// `Phi^T K V [r,m]`, µN/mm, and `Phi^T M V`, g.
    cross: [Vec<f32>; 2],
    /// `V^T K V [m,m]` and `V^T M V`.
    own: [Vec<f32>; 2],
}

impl WholeModes {
    /// Reads and checks the file for a body of `nodes` nodes.
    pub fn parse(file: &TensorFile, nodes: usize, space: &CoarseSpace) -> Result<WholeModes> {
        let stored = file.f16("modes", &[None, Some(3 * nodes)])?;
        let count = stored.len() / (3 * nodes).max(1);
        if count == 0 || count > LIMIT {
            return Err(file.bad("modes", format!("must hold 1 to {LIMIT} modes")));
        }
        let cross = [Some(space.count()), Some(count)];
        let own = [Some(count); 2];
        let values = stored.iter().map(|value| value.to_f32());
        Ok(WholeModes {
            fields: Arc::new(memory::collected(stored.len(), values, WHAT)?),
            parents: Vec::new(),
            cross: [
                file.f32("cross_stiffness", &cross)?,
                file.f32("cross_mass", &cross)?,
            ],
            own: [file.f32("stiffness", &own)?, file.f32("mass", &own)?],
        })
    }

    /// Those of a body that the modes' own was cut to: the products with what elements have lost are taken off.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn cut(&self, parents: &[u32], lost: &LostElements) -> Result<WholeModes> {
        let (own, coarse, len) = (self.count(), lost.modes, self.fields.len() / self.count());
        let values = |node: u32, axis: usize| {
            let at = 3 * node as usize + axis;
            (0..own).map(move |mode| self.fields[mode * len + at])
        };
        let copies = |tables: &[Vec<f32>; 2]| -> Result<[Vec<f32>; 2]> {
            let [stiffness, mass] = tables;
            Ok([
                memory::copied(stiffness, WHAT)?,
                memory::copied(mass, WHAT)?,
            ])
        };
        let mut cut = WholeModes {
            fields: Arc::clone(&self.fields),
            parents: memory::copied(parents, WHAT)?,
            cross: copies(&self.cross)?,
            own: copies(&self.own)?,
        };
        // `dK V` and the masses at the free corners.
        let (mut forces, masses) = lost.on_fields(own, values)?;
        // Table 0 is the stiffness, table 1 the mass: forces of the lost elements, then their masses times the fields.
        for table in 0..2 {
            for (at, row) in forces.chunks_exact_mut(own).enumerate() {
                let (node, axis) = (lost.nodes[at / 3], at % 3);
                if table == 1 {
                    let mass = masses[at / 3];
                    let scaled = values(node, axis).map(|value| mass * value);
                    row.iter_mut().zip(scaled).for_each(|(to, from)| *to = from);
                }
                let phi = &lost.rows[at * coarse..][..coarse];
                for (phi, out) in phi.iter().zip(cut.cross[table].chunks_exact_mut(own)) {
                    out.iter_mut()
                        .zip(&*row)
                        .for_each(|(out, f)| *out -= phi * f);
                }
                for (v, out) in values(node, axis).zip(cut.own[table].chunks_exact_mut(own)) {
                    out.iter_mut().zip(&*row).for_each(|(out, f)| *out -= v * f);
                }
            }
        }
        Ok(cut)
    }

    /// How many whole modes there are.
    pub(super) fn count(&self) -> usize {
        self.own[0].len().isqrt()
    }

    /// Room for `count` modes of `len` numbers, of which the first are those of `known`; products with the others are zero.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub(super) fn with_room(
        len: usize,
        coarse: usize,
        count: usize,
        known: Option<&WholeModes>,
    ) -> Result<WholeModes> {
        let mut fields = memory::room(count * len, WHAT)?;
        let tables = |rows: usize| -> Result<[Vec<f32>; 2]> {
            let table = || memory::zeros(rows * count, WHAT);
            Ok([table()?, table()?])
        };
        let (mut cross, mut own) = (tables(coarse)?, tables(count)?);
        if let Some(known) = known {
            fields.extend_from_slice(&known.fields);
            let width = known.count();
            for (to, from) in
                (cross.iter_mut().zip(&known.cross)).chain(own.iter_mut().zip(&known.own))
            {
                for (to, from) in to.chunks_exact_mut(count).zip(from.chunks_exact(width)) {
                    to[..width].copy_from_slice(from);
                }
            }
        }
        Ok(WholeModes {
            fields: Arc::new(fields),
            parents: Vec::new(),
            cross,
            own,
        })
    }

    /// Adds a field, for which there is room.
    pub(super) fn push(&mut self, field: &[f32]) {
        if let Some(fields) = Arc::get_mut(&mut self.fields) {
            fields.extend_from_slice(field);
        }
    }

    /// Takes the products of mode `at` with those before it and with itself: `product [3K]` is that of `K` (table 0) or `M` with its field, `on_modes` what it has
    /// of `Phi`.
    pub(super) fn take_products(
        &mut self,
        table: usize,
        at: usize,
        product: &[f32],
        on_modes: &[f32],
    ) {
        let count = self.count();
        for (row, value) in self.cross[table].chunks_exact_mut(count).zip(on_modes) {
            row[at] = *value;
        }
        for (other, field) in self.fields.chunks_exact(product.len()).enumerate() {
            let sum: f64 = (field.iter().zip(product))
                .map(|(v, product)| f64::from(*v) * f64::from(*product))
                .sum();
            self.own[table][at * count + other] = sum as f32;
            self.own[table][other * count + at] = sum as f32;
        }
    }

    /// Numbers of a field of the intact body, `3K`.
    fn len(&self) -> usize {
        self.fields.len() / self.count()
    }

    /// The place of each copy's parent, behind the fields' own numbers.
    fn copies(&self) -> impl Iterator<Item = usize> {
        self.parents.iter().map(|parent| 3 * *parent as usize)
    }
}

/// What a length of step makes of them, and buffers.
#[derive(HeldBytes)]
pub(super) struct WholeSolve {
    /// `X [r,m]`.
    cross: Vec<f32>,
    /// `0..m`, and the factor of `S`.
    rows: Vec<u32>,
    schur: ContactFactor,
    work: Vec<f32>,
    amounts: Vec<f32>,
    /// `V'` at some nodes, spread over all: by degree of freedom, then mode; empty where nobody has asked.
    sampled: Vec<f32>,
    partial: PartialSums,
}

impl WholeSolve {
    /// For `K + kappa M` and the modes `Phi` of `space`.
    pub fn new(
        compute: Compute<'_>,
        modes: &WholeModes,
        space: &CoarseSpace,
        kappa: f64,
    ) -> Result<WholeSolve> {
        let (own, coarse) = (modes.count(), space.count());
        // `X = G^-1 Phi^T A V`, summed in f64, since `S` below is a difference.
        let inverse = space.galerkin_inverse(kappa, compute.isa)?;
        let joined = |tables: &[Vec<f32>; 2], at: usize| {
            f64::from(tables[0][at]) + kappa * f64::from(tables[1][at])
        };
        let mut cross = memory::zeros(coarse * own, WHAT)?;
        for (row, inverse) in cross
            .chunks_exact_mut(own)
            .zip(inverse.chunks_exact(coarse))
        {
            for (column, value) in row.iter_mut().enumerate() {
                let products = inverse.iter().enumerate();
                let sum: f64 = products
                    .map(|(i, g)| f64::from(*g) * joined(&modes.cross, i * own + column))
                    .sum();
                *value = sum as f32;
            }
        }
        let rows = memory::collected(own, 0..own as u32, WHAT)?;
        let mut schur = ContactFactor::try_with_capacity(own)?;
        schur
            .factor(compute.isa, &rows, |upper| {
                for i in 0..own {
                    for j in i..own {
                        let lost: f64 = (0..coarse)
                            .map(|row| {
                                joined(&modes.cross, row * own + i)
                                    * f64::from(cross[row * own + j])
                            })
                            .sum();
                        upper[i * own + j] = joined(&modes.own, i * own + j) - lost;
                    }
                }
            })
            .map_err(|error| Error::bundle("whole.safetensors", error.to_string()))?;
        let len = modes.len();
        Ok(WholeSolve {
            cross,
            rows,
            schur,
            work: memory::zeros(own, WHAT)?,
            amounts: memory::zeros(own, WHAT)?,
            sampled: Vec::new(),
            partial: PartialSums::with_room(len, AT_ONCE)?,
        })
    }

    /// `S^-1 V'^T r` from `r [K,3]` and `Phi^T r`.
    pub fn solve(
        &mut self,
        compute: Compute<'_>,
        modes: &WholeModes,
        r: &[f32],
        on_modes: &[f32],
    ) -> Result<()> {
        self.project(compute, modes, r)?;
        self.finish(compute, on_modes);
        Ok(())
    }

    /// `V^T r`, to be finished.
    pub fn project(&mut self, compute: Compute<'_>, modes: &WholeModes, r: &[f32]) -> Result<()> {
        // Copies of nodes lie behind the body's own: they have the values of their parents in each mode.
        let (r, copies) = r.split_at(modes.len());
        let mut views = [r; AT_ONCE];
        let mut sums = [0.0; AT_ONCE];
        let fields = modes.fields.chunks(AT_ONCE * r.len());
        for (fields, work) in fields.zip(self.work.chunks_mut(AT_ONCE)) {
            for (view, field) in views.iter_mut().zip(fields.chunks_exact(r.len())) {
                *view = field;
            }
            let count = work.len();
            let sums = &mut sums[..count];
            dots(
                compute.isa,
                compute.pool,
                &views[..count],
                r,
                &mut self.partial,
                sums,
            )?;
            for (work, sum) in work.iter_mut().zip(sums) {
                *work = *sum as f32;
            }
            for (work, field) in work.iter_mut().zip(fields.chunks_exact(r.len())) {
                for (own, at) in copies.as_chunks::<3>().0.iter().zip(modes.copies()) {
                    *work += (0..3).map(|k| own[k] * field[at + k]).sum::<f32>();
                }
            }
        }
        Ok(())
    }

    /// Takes a force on a node, µN, off the residual that has been projected.
    pub fn take_force(&mut self, modes: &WholeModes, node: u32, force: [f32; 3]) {
        let at = match (3 * node as usize).checked_sub(modes.len()) {
            Some(copy) => 3 * modes.parents[copy / 3] as usize,
            None => 3 * node as usize,
        };
        let fields = modes.fields.chunks_exact(modes.len());
        for (work, field) in self.work.iter_mut().zip(fields) {
            *work -= (0..3).map(|k| force[k] * field[at + k]).sum::<f32>();
        }
    }

    /// `S^-1 V'^T r` from what has been projected and `Phi^T r`.
    pub fn finish(&mut self, compute: Compute<'_>, on_modes: &[f32]) {
        // `V' = V - Phi X`: what `V` has of the modes is theirs.
        for (row, on_mode) in self.cross.chunks_exact(self.rows.len()).zip(on_modes) {
            for (work, x) in self.work.iter_mut().zip(row) {
                *work -= x * on_mode;
            }
        }
        self.schur.solve(compute.isa, &self.work, &mut self.amounts);
    }

    /// The amounts of one of `V'` alone.
    pub fn pick(&mut self, mode: usize) {
        self.amounts.fill(0.0);
        self.amounts[mode] = 1.0;
    }

    /// What a residual asks for leads up: its opposite.
    pub fn turn(&mut self) {
        self.amounts
            .iter_mut()
            .for_each(|amount| *amount = -*amount);
    }

    /// `V'` at the sampled nodes, for who makes it.
    pub fn sampled(&mut self) -> &mut Vec<f32> {
        &mut self.sampled
    }

    /// How far the amounts of the last solve move a sampled node along an axis, at most, mm; without bounds where there are none.
    pub fn most_mm(&self) -> f32 {
        let rows = self.sampled.chunks_exact(self.amounts.len().max(1));
        let moves = rows.map(|row| {
            let products = row.iter().zip(&self.amounts);
            products.map(|(v, amount)| v * amount).sum::<f32>().abs()
        });
        match self.sampled.is_empty() {
            true => f32::INFINITY,
            false => moves.fold(0.0, f32::max),
        }
    }

    /// Takes what `V'` has of the modes `Phi` in the last solve off their amounts.
    pub fn take_off(&self, solved: &mut [f32]) {
        for (row, solved) in self.cross.chunks_exact(self.rows.len()).zip(solved) {
            for (amount, x) in self.amounts.iter().zip(row) {
                *solved -= x * amount;
            }
        }
    }

    /// `z += V S^-1 V'^T r` of the last solve.
    pub fn add(&self, compute: Compute<'_>, modes: &WholeModes, z: &mut [f32]) -> Result<()> {
        let (z, copies) = z.split_at_mut(modes.len());
        let empty: &[f32] = &[];
        let mut views = [empty; AT_ONCE];
        let fields = modes.fields.chunks(AT_ONCE * z.len());
        for (fields, amounts) in fields.zip(self.amounts.chunks(AT_ONCE)) {
            for (view, field) in views.iter_mut().zip(fields.chunks_exact(z.len())) {
                *view = field;
            }
            add_scaled(
                compute.isa,
                compute.pool,
                &views[..amounts.len()],
                amounts,
                z,
            )?;
            for (field, amount) in fields.chunks_exact(z.len()).zip(amounts) {
                for (own, at) in copies.as_chunks_mut::<3>().0.iter_mut().zip(modes.copies()) {
                    (0..3).for_each(|k| own[k] += amount * field[at + k]);
                }
            }
        }
        Ok(())
    }
}
