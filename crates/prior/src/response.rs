//! The contact solve: collision field -> contact forces -> linear response in block coordinates.
//!
//! 1. Each contact node acts on a column of the tables: its own, or the nearest one.
//! 2. The compliance of these columns, `A_CC [3m,3m]`, is gathered and factored; while the same
//!    columns are in contact the factor is kept, and a step costs two triangular solves.
//! 3. `f = A_CC^-1 c`, and `q = sum_i f_i response[i]` gives the field where it is wanted.

use super::table::PriorTable;
use field::error::{Error, Result};
use field::memory::{self, HeldBytes};
use kernels::contact::ContactFactor;
use kernels::respond::accumulate_rows;
use kernels::rows::Stored;
use kernels::{Isa, Pool};

/// Contact nodes for which the factor has room from the start; larger sets allocate once. The
/// factor of 256 nodes has 4.7 MB in f64.
const ROOM: usize = 256;

/// What a solve met.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SolveReport {
    /// A contact node is held, or outside of the domain and without a column of its own.
    pub outside: bool,
    /// The contact block was near singular and a Tikhonov term was added.
    pub regularised: bool,
}

/// Contact forces, and the factor that is kept while the contact nodes stay the same.
#[derive(Debug, HeldBytes)]
pub struct ContactResponse {
    factored: Factored,
    /// Columns of the last solve, ascending, each once `[m]`.
    pub(super) columns: Vec<u32>,
    /// Their degrees of freedom, `3 column + axis` `[3m]`: what the factor is known by.
    rows: Vec<u32>,
    /// The rows of the tables that they are.
    stored: Vec<u32>,
    /// What is imposed on them, mm `[3m]`: of each column its own node's, or the mean of those that borrow it.
    values: Vec<f32>,
    /// Room of the compliance's far blocks: six rows of the widest block's rank.
    widened: Vec<f32>,
    /// What answers them, mN `[3m]`; of the last solve until the next.
    pub(super) forces: Vec<f32>,
    /// Zeros but while [`ContactResponse::solve`] collects, so that a call costs what it is given and not what the table
    /// has.
    pub(super) imposed: Imposed,
}

/// The factor of the compliance of some rows.
#[derive(Debug, HeldBytes)]
struct Factored {
    /// Of the compliance of `rows`; of nothing where they are empty.
    factor: ContactFactor,
    /// What the factor was made of. They are cleared before a new one is made, so that one that could not be made is made
    /// anew.
    rows: Vec<u32>,
    /// Whether a Tikhonov term was added, which each solve with the factor reports again.
    regularised: bool,
}

/// What nodes impose on their columns; by column, zero between calls.
#[derive(Debug, HeldBytes)]
pub(super) struct Imposed {
    /// Sum of the displacements, and how many they are.
    sum: Vec<[f32; 3]>,
    pub count: Vec<u32>,
    /// Whether the column's own node is among them.
    pub own: Vec<bool>,
}

impl ContactResponse {
    /// Buffers for a table.
    /// All lists have room for every column of the table at once, so that no solve allocates but
    /// for a larger factor.
    pub fn new(table: &PriorTable) -> Result<ContactResponse> {
        const WHAT: &str = "the contact solve";
        let columns = table.contact_nodes.len();
        Ok(ContactResponse {
            factored: Factored {
                factor: ContactFactor::try_with_capacity(3 * columns.min(ROOM))?,
                rows: memory::room(3 * columns, WHAT)?,
                regularised: false,
            },
            columns: memory::room(columns, WHAT)?,
            rows: memory::room(3 * columns, WHAT)?,
            stored: memory::room(3 * columns, WHAT)?,
            values: memory::room(3 * columns, WHAT)?,
            widened: memory::zeros(6 * table.widest_block(), WHAT)?,
            forces: memory::room(3 * columns, WHAT)?,
            imposed: Imposed {
                sum: memory::filled(columns, [0.0; 3], WHAT)?,
                count: memory::filled(columns, 0, WHAT)?,
                own: memory::filled(columns, false, WHAT)?,
            },
        })
    }

    /// Solves for the forces. A node without a column of its own lends its displacement to the nearest column (the
    /// mean of all that borrow it); a column's own node goes before borrowers; held nodes are left out.
    /// `nodes [n]` and `vectors [n,3]`, mm, in the order of the host; the sum over borrowers runs
    /// in this order. `held [K]` says which nodes the body is fastened at.
    ///
    /// # Errors
    /// [`Error::Bundle`] where the compliance of these columns has no factor,
    /// [`Error::OutOfMemory`].
    pub fn solve(
        &mut self,
        isa: Isa,
        table: &PriorTable,
        held: &[bool],
        nodes: &[u32],
        vectors: &[f32],
    ) -> Result<SolveReport> {
        let mut report = SolveReport::default();
        self.columns.clear();
        for (&node, c) in nodes.iter().zip(vectors.chunks_exact(3)) {
            let Some((slot, own)) = table.column_for(held, node) else {
                report.outside = true;
                continue;
            };
            report.outside |= !own && !table.in_domain[node as usize];
            if self.imposed.count[slot] == 0 {
                self.columns.push(slot as u32);
            }
            // The own node has said what is imposed; borrowers of this column change nothing.
            if self.imposed.own[slot] {
                continue;
            }
            if own {
                self.imposed.own[slot] = true;
                self.imposed.sum[slot] = [c[0], c[1], c[2]];
                self.imposed.count[slot] = 1;
            } else {
                let sum = &mut self.imposed.sum[slot];
                *sum = [sum[0] + c[0], sum[1] + c[1], sum[2] + c[2]];
                self.imposed.count[slot] += 1;
            }
        }
        // Ascending, so that one set of columns has one factor, in whichever order the host names
        // it.
        self.columns.sort_unstable();
        self.rows.clear();
        self.values.clear();
        for &column in &self.columns {
            let slot = column as usize;
            for axis in 0..3 {
                self.rows.push(3 * column + axis as u32);
                self.values
                    .push(self.imposed.sum[slot][axis] / self.imposed.count[slot] as f32);
            }
            self.imposed.sum[slot] = [0.0; 3];
            self.imposed.count[slot] = 0;
            self.imposed.own[slot] = false;
        }
        self.stored.clear();
        self.stored
            .extend(self.rows.iter().map(|row| table.stored_dof(*row)));
        if self.rows != self.factored.rows {
            // Cleared first: if the factor fails, the next call with these rows must not take it
            // for made.
            self.factored.rows.clear();
            self.factored.regularised = false;
            if !self.rows.is_empty() {
                self.factored.factor.reserve(self.rows.len())?;
                let made = self
                    .factored
                    .factor
                    .factor(isa, &self.rows, |upper| {
                        table.gather_compliance(&self.columns, upper, &mut self.widened);
                    })
                    .map_err(|error| Error::bundle("prior.safetensors", error.to_string()))?;
                self.factored.regularised = made.regularised();
            }
            self.factored.rows.extend_from_slice(&self.rows);
        }
        report.regularised = self.factored.regularised && !self.rows.is_empty();
        self.forces.clear();
        self.forces.resize(self.rows.len(), 0.0);
        if !self.rows.is_empty() {
            self.factored
                .factor
                .solve(isa, &self.values, &mut self.forces);
        }
        Ok(report)
    }

    /// Contact forces of the last solve, mN, three a column.
    pub fn forces(&self) -> &[f32] {
        &self.forces
    }

    /// The field of the last solve in block coordinates, `q = sum_i f_i response[i]`.
    /// The forces stay those of the last [`ContactResponse::solve`]. Zero without contact.
    pub fn field(&self, isa: Isa, pool: &Pool, table: &PriorTable, q: &mut [f32]) -> Result<()> {
        if self.rows.is_empty() || q.is_empty() {
            q.fill(0.0);
            return Ok(());
        }
        let forces = (self.stored.as_slice(), self.forces.as_slice());
        table.response.accumulate(isa, pool, forces, false, q)
    }

    /// The forces through a table of `[3D,n]`, for instance `force_to_z`.
    /// `force_to_z` and `force_to_p` feed the learned map; `out [n]`.
    pub fn expand(&self, isa: Isa, pool: &Pool, table: Stored<'_>, out: &mut [f32]) -> Result<()> {
        if self.rows.is_empty() || out.is_empty() {
            out.fill(0.0);
            return Ok(());
        }
        let (rows, forces) = (&self.stored, &self.forces);
        Ok(accumulate_rows(isa, pool, table, rows, forces, false, out)?)
    }
}
