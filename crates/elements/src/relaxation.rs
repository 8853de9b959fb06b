//! Relaxation: a generalised Maxwell body (Prony series) on the stress without change of volume.
//!
//! Of the stress of the law, `S_iso` (second Piola-Kirchhoff), each branch loses its share `g_i` with the time constant `tau_i`:
//!
//! ```text
//! S(t) = S_vol + g_inf S_iso + sum_i q_i        dq_i/dt + q_i / tau_i = g_i dS_iso/dt        g_inf = 1 - sum_i g_i
//! q_i <- e_i q_i + g_i b_i (S_iso' - S_iso)     e_i = exp(-h / tau_i)    b_i = (1 - e_i) tau_i / h
//! ```
//!
//! The second line is exact where `S_iso` changes at a constant rate within a step `h` (Simo 1987). Over a step the law has the modulus
//! `g(h) = g_inf + sum_i g_i b_i`; the rest is known before it.

use crate::fault::MaterialError;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Branches of a material at most.
pub const MOST_BRANCHES: usize = 6;
/// Shares of all branches together, at most: what is left carries a load that lasts.
const MOST_LOST: f64 = 0.999;

/// One Maxwell branch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Branch {
    /// `g`: the part of the stress that it loses.
    pub share: f64,
    /// `tau`, s.
    pub tau_s: f64,
}

/// Up to [`MOST_BRANCHES`]; in files a list. Without any the tissue is elastic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<Branch>", into = "Vec<Branch>")]
pub struct Relaxation {
    /// Those beyond `count` are zero.
    all: [Branch; MOST_BRANCHES],
    count: usize,
}

impl Relaxation {
    /// `None` for more than [`MOST_BRANCHES`].
    pub fn new(branches: impl IntoIterator<Item = Branch>) -> Option<Self> {
        let mut list = Self::default();
        for branch in branches {
            *list.all.get_mut(list.count)? = branch;
            list.count += 1;
        }
        Some(list)
    }

    /// From `SHARE,TAU_S[,SHARE,TAU_S...]`.
    ///
    /// # Errors
    /// What is wrong with the text, or with the branches.
    pub fn parse(text: &str) -> Result<Self, String> {
        let numbers: Result<Vec<f64>, String> = (text.split(','))
            .map(|part| {
                let part = part.trim();
                (part.parse()).map_err(|_| format!("relaxation `{text}`: `{part}` is not a number"))
            })
            .collect();
        let (pairs, odd) = {
            let numbers = numbers?;
            let (pairs, odd) = numbers.as_chunks::<2>();
            (pairs.to_vec(), !odd.is_empty())
        };
        if odd {
            return Err(format!(
                "relaxation `{text}` has an odd count of numbers; use SHARE,TAU_S[,SHARE,TAU_S...], as 0.45,0.5,0.365,50"
            ));
        }
        let count = pairs.len();
        let branches = pairs
            .into_iter()
            .map(|[share, tau_s]| Branch { share, tau_s });
        let own = Self::new(branches).ok_or_else(|| {
            format!("relaxation `{text}` has {count} branches; at most {MOST_BRANCHES}")
        })?;
        match own.fault() {
            None => Ok(own),
            Some(fault) => Err(format!(
                "{} is {}; it must be {}",
                fault.field, fault.value, fault.wanted
            )),
        }
    }

    /// The branches in their order.
    pub fn iter(&self) -> std::slice::Iter<'_, Branch> {
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

    /// `g_inf`: the part of the stress that lasts.
    pub fn lasting(&self) -> f64 {
        1.0 - self.iter().map(|branch| branch.share).sum::<f64>()
    }

    /// `g(h)`: the modulus of a step of `h` seconds over that of the law.
    pub fn over(&self, h: f64) -> f64 {
        self.lasting() + self.iter().map(|branch| branch.gain(h)).sum::<f64>()
    }

    /// `g(t)`: the part of the stress of a strain held since `t` seconds.
    pub fn after(&self, t: f64) -> f64 {
        let left = self.iter().map(|branch| branch.share * branch.decay(t));
        self.lasting() + left.sum::<f64>()
    }

    /// The constant that is not admitted.
    pub(crate) fn fault(&self) -> Option<MaterialError> {
        for (at, branch) in self.iter().enumerate() {
            if !(branch.share > 0.0 && branch.share <= MOST_LOST) {
                let field = format!("relaxation[{at}].share");
                return MaterialError::some(field, branch.share, "above 0 and at most 0.999");
            }
            if !(branch.tau_s > 0.0 && branch.tau_s <= 1e9) {
                let field = format!("relaxation[{at}].tau_s");
                return MaterialError::some(field, branch.tau_s, "positive and at most 1e9 s");
            }
        }
        let lost = 1.0 - self.lasting();
        if lost > MOST_LOST {
            let wanted =
                "at most 0.999: the sum of the shares, of which the rest carries a load that lasts";
            return MaterialError::some("relaxation", lost, wanted);
        }
        None
    }
}

impl Branch {
    /// `e = exp(-h / tau)`.
    pub fn decay(&self, h: f64) -> f64 {
        libm::exp(-h / self.tau_s)
    }

    /// `g b`: what it takes of a change of the stress within `h` seconds.
    pub fn gain(&self, h: f64) -> f64 {
        let x = h / self.tau_s;
        let mean = if x > 0.0 { -libm::expm1(-x) / x } else { 1.0 };
        self.share * mean
    }
}

impl TryFrom<Vec<Branch>> for Relaxation {
    type Error = String;

    fn try_from(branches: Vec<Branch>) -> Result<Self, String> {
        let count = branches.len();
        Self::new(branches).ok_or_else(|| format!("{count} branches; at most {MOST_BRANCHES}"))
    }
}

impl From<Relaxation> for Vec<Branch> {
    fn from(own: Relaxation) -> Self {
        own.iter().copied().collect()
    }
}

impl fmt::Display for Relaxation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (at, branch) in self.iter().enumerate() {
            let comma = if at > 0 { "," } else { "" };
            write!(f, "{comma}{},{}", branch.share, branch.tau_s)?;
        }
        Ok(())
    }
}
