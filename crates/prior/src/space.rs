//! The coarse space of the corrections' preconditioner (`corrections.safetensors` of `docs/reference/formats.md`): modes `Phi` in the block
//! coordinates of the prior, their stiffness and mass, the first of them natural modes.
//!
//! With `kappa = 9/(4h²) + 3 alpha/(2h)` of BDF2, `K + kappa M` takes the place of the stiffness everywhere. Its compliance at the
//! contact is the static one less what inertia holds back, `A_k = A - N diag(kappa / (w² (w² + kappa))) N^T` with
//! natural modes `N` of frequency `w`.
//!
//! The preconditioner solves on these modes exactly. Nothing here depends on the state: `K` and `M`
//! are those of the body at rest, so the tables are made once, and scenes share them.

mod cut;

use std::sync::{Arc, Mutex, PoisonError};

use super::numbers::Numbers;
use super::table::PriorTable;
use bundle::TensorFile;
use field::error::{Error, Result};
use field::memory::{self, HeldBytes};
use kernels::Isa;
use kernels::contact::ContactFactor;
use kernels::rows::Stored;

const WHAT: &str = "the modes of the corrections";
/// Most modes that a file may hold: the Galerkin matrix is dense, `[r,r]`, and is factored.
const LIMIT: usize = 1024;

/// The modes and what the elements and the mass make of them.
#[derive(Debug, HeldBytes)]
pub struct CoarseSpace {
    /// `[r,Q]`, each of Euclidean length 1 as a field.
    #[held(own)]
    modes: Arc<Numbers>,
    /// `0..r`, as a row list.
    rows: Vec<u32>,
    /// `Phi^T K Phi [r,r]`, µN/mm.
    stiffness: Vec<f32>,
    /// `Phi^T M Phi [r,r]`, g.
    mass: Vec<f32>,
    /// Angular frequency of the natural modes, which are the first rows of `modes`, rad/s.
    frequency: Vec<f32>,
    /// Modes at the contact degrees of freedom of the tables `[3D,r]`, and at those that a cut has added behind them.
    #[held(own)]
    at_contact: Arc<Vec<f32>>,
    at_added: Vec<f32>,
    /// Inverses of the Galerkin matrix that cut bodies have asked for, by the bits of kappa: the intact body's products serve all that have lost nothing.
    #[held(skip)]
    inverses: Arc<Mutex<Inverses>>,
    /// Whether inverses are kept: in the space of a cut body, since each further cut makes a space anew and asks again.
    keeps: bool,
    /// Of the kernels that read the modes.
    #[held(skip)]
    isa: Isa,
}

/// Bits of kappa, and the inverse `[r,r]`, mm/µN. A scene has few lengths of step, so the list stays short.
type Inverses = Vec<(u64, Vec<f32>)>;

impl CoarseSpace {
    /// Reads and checks the tables for a prior.
    /// Their diagonals must be positive; whether `K + kappa M` has a factor shows when one is made.
    pub fn parse(file: &TensorFile, prior: &PriorTable, isa: Isa) -> Result<CoarseSpace> {
        let modes = file.f16("modes", &[None, Some(prior.width())])?;
        let count = modes.len() / prior.width().max(1);
        if count == 0 || count > LIMIT {
            return Err(file.bad("modes", format!("must hold 1 to {LIMIT} modes")));
        }
        let square = [Some(count), Some(count)];
        let (stiffness, mass) = (file.f32("stiffness", &square)?, file.f32("mass", &square)?);
        for (name, table) in [("stiffness", &stiffness), ("mass", &mass)] {
            if let Some(at) = (0..count).find(|&i| table[i * (count + 1)] <= 0.0) {
                return Err(file.bad(name, format!("diagonal element {at} is not positive")));
            }
        }
        let frequency = file.f32("frequency", &[None])?;
        if frequency.len() > count {
            return Err(file.bad("frequency", "names more natural modes than there are modes"));
        }
        if let Some(at) = frequency.iter().position(|&omega| omega <= 0.0) {
            return Err(file.bad("frequency", format!("element {at} is not positive")));
        }
        let mut space = CoarseSpace {
            at_contact: Arc::default(),
            at_added: Vec::new(),
            inverses: Arc::default(),
            keeps: false,
            isa,
            rows: memory::collected(count, 0..count as u32, WHAT)?,
            modes: Arc::new(Numbers::of_f16(modes)?),
            stiffness,
            mass,
            frequency,
        };
        space.at_contact = Arc::new(space.restricted(prior)?);
        Ok(space)
    }

    /// Rows of the modes at the contact nodes.
    fn restricted(&self, prior: &PriorTable) -> Result<Vec<f32>> {
        let (count, width) = (self.rows.len(), prior.width());
        let mut rows = memory::zeros(3 * prior.contact_nodes.len() * count, WHAT)?;
        for (at, row) in rows.chunks_exact_mut(count.max(1)).enumerate() {
            let (node, axis) = (prior.contact_nodes[at / 3], at % 3);
            for (mode, value) in row.iter_mut().enumerate() {
                *value = prior.value_at(node, axis, |at| self.modes.at(mode * width + at));
            }
        }
        Ok(rows)
    }

    /// The set whose kernels read the modes.
    pub fn isa(&self) -> Isa {
        self.isa
    }

    /// The block coordinates `[Q]` of a mode.
    pub fn read_mode(&self, mode: usize, q: &mut [f32]) {
        let first = mode * q.len();
        for (at, q) in q.iter_mut().enumerate() {
            *q = self.modes.at(first + at);
        }
    }

    /// `Phi^T M Phi [r,r]`, g.
    pub fn mass(&self) -> &[f32] {
        &self.mass
    }

    /// Modes, `r`.
    pub fn count(&self) -> usize {
        self.rows.len()
    }

    /// Natural modes, the first of all.
    pub fn natural_count(&self) -> usize {
        self.frequency.len()
    }

    /// `[r,Q]`, as the kernels take it.
    pub fn modes(&self) -> Stored<'_> {
        self.modes.stored()
    }

    /// `0..r`.
    pub fn rows(&self) -> &[u32] {
        &self.rows
    }

    /// Modes at contact dof `dof`, `[r]`.
    pub fn at_contact(&self, dof: usize) -> &[f32] {
        let at = dof * self.count()..(dof + 1) * self.count();
        let own = self.at_contact.len();
        match at.start < own {
            true => &self.at_contact[at],
            false => &self.at_added[at.start - own..at.end - own],
        }
    }

    /// Frequency (rad/s) and mass (g) of each natural mode.
    ///
    /// # Errors
    /// [`field::Error::OutOfMemory`].
    /// Natural modes are orthogonal in `M`, so the diagonal of its product is the mass of each.
    pub fn natural(&self) -> Result<Vec<(f32, f32)>> {
        let count = self.count();
        let frequencies = self.frequency.iter().enumerate();
        let masses = frequencies.map(|(i, &omega)| (omega, self.mass[i * (count + 1)]));
        memory::collected(self.natural_count(), masses, WHAT)
    }

    /// For each natural mode `kappa / (m w² (w² + kappa))`: what inertia takes off its part of the compliance, mm/mN.
    ///
    /// # Errors
    /// [`field::Error::OutOfMemory`].
    pub fn inertial_compliance(&self, kappa: f64) -> Result<Vec<f32>> {
        memory::collected(self.natural_count(), self.holds_back(kappa), WHAT)
    }

    /// The same, mode by mode.
    /// The factor 1e3 turns mm/µN, in which the mass is g and time s, into mm/mN.
    pub fn holds_back(&self, kappa: f64) -> impl Iterator<Item = f32> {
        let count = self.count();
        let frequencies = self.frequency.iter().enumerate();
        frequencies.map(move |(i, &omega)| {
            let square = f64::from(omega).powi(2);
            let mass = f64::from(self.mass[i * (count + 1)]);
            (1e3 * kappa / (mass * square * (square + kappa))) as f32
        })
    }

    /// For each natural mode `1 / (m (w² + kappa))`: what a force on it moves, mm/µN.
    ///
    /// # Errors
    /// [`field::Error::OutOfMemory`].
    pub fn moved_freely(&self, kappa: f64) -> Result<Vec<f32>> {
        let count = self.count();
        let frequencies = self.frequency.iter().enumerate();
        let moved = frequencies.map(|(i, &omega)| {
            let mass = f64::from(self.mass[i * (count + 1)]);
            (1.0 / (mass * (f64::from(omega).powi(2) + kappa))) as f32
        });
        memory::collected(self.natural_count(), moved, WHAT)
    }

    /// The inverse of [`CoarseSpace::galerkin`], mm/µN.
    ///
    /// # Errors
    /// [`field::Error::Bundle`] where it has none, [`field::Error::OutOfMemory`].
    pub fn galerkin_inverse(&self, kappa: f64, isa: Isa) -> Result<Vec<f32>> {
        if !self.keeps {
            return self.inverse(kappa, isa);
        }
        let mut kept = self.inverses.lock().unwrap_or_else(PoisonError::into_inner);
        // By bits: the same step gives the same kappa, and no comparison with a tolerance could
        // give another scene's inverse.
        if let Some((_, known)) = kept.iter().find(|own| own.0 == kappa.to_bits()) {
            return memory::copied(known, WHAT);
        }
        let made = self.inverse(kappa, isa)?;
        let copy = memory::copied(&made, WHAT)?;
        memory::push(&mut kept, (kappa.to_bits(), copy), WHAT)?;
        Ok(made)
    }

    /// The same, made anew: a Cholesky factor in f64, and a solve for each column of the unit matrix. The matrix is
    /// symmetric, so rows and columns are one.
    fn inverse(&self, kappa: f64, isa: Isa) -> Result<Vec<f32>> {
        let (count, galerkin) = (self.count(), self.galerkin(kappa)?);
        let mut factor = ContactFactor::try_with_capacity(count)?;
        factor
            .factor(isa, &self.rows, |upper| upper.copy_from_slice(&galerkin))
            .map_err(|error| Error::bundle("corrections.safetensors", error.to_string()))?;
        let mut inverse = memory::zeros(count * count, WHAT)?;
        let mut unit = memory::zeros(count, WHAT)?;
        for (at, row) in inverse.chunks_exact_mut(count).enumerate() {
            unit[at] = 1.0;
            factor.solve(isa, &unit, row);
            unit[at] = 0.0;
        }
        Ok(inverse)
    }

    /// `Phi^T (K + kappa M) Phi [r,r]`, µN/mm.
    pub fn galerkin(&self, kappa: f64) -> Result<Vec<f64>> {
        let pairs = self.stiffness.iter().zip(&self.mass);
        let values = pairs.map(|(&k, &m)| f64::from(k) + kappa * f64::from(m));
        memory::collected(
            self.stiffness.len(),
            values,
            "the corrections' preconditioner",
        )
    }
}
