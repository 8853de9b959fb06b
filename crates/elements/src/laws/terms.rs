//! The terms of a law in principal stretches: a short list that is copied with its material.

use serde::{Deserialize, Serialize};

/// Terms of a law at most.
pub const MOST_TERMS: usize = 6;

/// One term `mu / alpha (l1^alpha + l2^alpha + l3^alpha - 3)`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Term {
    /// `mu`, Pa; of the sign of `alpha`.
    pub mu_pa: f64,
    /// `alpha`, no unit.
    pub alpha: f64,
}

/// Up to [`MOST_TERMS`] terms; in files a list.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<Term>", into = "Vec<Term>")]
pub struct Terms {
    /// Those beyond `count` are zero.
    all: [Term; MOST_TERMS],
    count: usize,
}

impl Terms {
    /// `None` for more than [`MOST_TERMS`].
    pub fn new(terms: impl IntoIterator<Item = Term>) -> Option<Self> {
        let mut list = Self::default();
        for term in terms {
            *list.all.get_mut(list.count)? = term;
            list.count += 1;
        }
        Some(list)
    }

    /// The terms in their order.
    pub fn iter(&self) -> std::slice::Iter<'_, Term> {
        self.all[..self.count].iter()
    }

    /// How many.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }
}

impl TryFrom<Vec<Term>> for Terms {
    type Error = String;

    fn try_from(terms: Vec<Term>) -> Result<Self, String> {
        let count = terms.len();
        Self::new(terms).ok_or_else(|| format!("{count} terms; at most {MOST_TERMS}"))
    }
}

impl From<Terms> for Vec<Term> {
    fn from(terms: Terms) -> Self {
        terms.iter().copied().collect()
    }
}
