//! Which compliance `A` a contact has, from the prior's columns at the samples' nodes.
//!
//! With a coarse space, `A` is the compliance of `K + kappa M`: the static one less what inertia holds back,
//! `A_k = A - N diag(kappa / (w² (w² + kappa))) N^T` with natural modes `N` of frequency `w`.

use super::ties::RowNodes;
use crate::error::Result;
use crate::prior::{CoarseSpace, PriorTable};

pub(super) const WHAT: &str = "the compliance of a contact";

/// The tables of a solve.
#[derive(Clone, Copy)]
pub struct Compliance<'a> {
    /// Columns.
    pub prior: &'a PriorTable,
    /// Held nodes `[K]`.
    pub held: &'a [bool],
    /// The natural modes, and for each what inertia takes off its part, mm/mN ([`CoarseSpace::inertial_compliance`]); none: static.
    pub inertia: Option<(&'a CoarseSpace, &'a [f32])>,
    /// In place of all that: the compliance of the tissue as it is deformed.
    pub tangent: Option<&'a dyn Tangent>,
}

/// The compliance of deformed tissue at columns of the prior.
pub trait Tangent {
    /// Another number for another tissue, from 1.
    fn generation(&self) -> u64;

    /// The upper triangle of `A [3m,3m]` at `m` columns, ascending, mm/mN.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    fn gather(&self, columns: &[u32], upper: &mut [f64]) -> Result<()>;
}

impl<'a> Compliance<'a> {
    /// That of tissue at rest.
    pub fn at_rest(
        prior: &'a PriorTable,
        held: &'a [bool],
        inertia: Option<(&'a CoarseSpace, &'a [f32])>,
    ) -> Compliance<'a> {
        Compliance {
            prior,
            held,
            inertia,
            tangent: None,
        }
    }

    /// Columns of the nodes of a row with their weights; nodes that do not move are left out.
    pub fn entries(&self, row: impl Into<RowNodes>) -> impl Iterator<Item = (u32, f32)> {
        row.into().into_entries().filter_map(|(node, weight)| {
            let found = self.prior.column_for(self.held, node)?;
            Some((found.0 as u32, weight))
        })
    }
}
