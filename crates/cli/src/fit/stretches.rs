//! The terms of laws in principal stretches, Ogden's and those that are two of its terms, by `least_squares`.
//!
//! Unknown are `mu alpha / 2` of each term, at least 0, so that every term adds to the shear modulus and the law is elliptic, and the exponents up to
//! 30: without a bound, terms degenerate to opposite ones that cancel.

use anyhow::{Result, bail};
use elements::Ogden;

use super::least_squares::{self, Cost, Test, Unknown};

/// Exponents stay below this size.
const BOUND: f64 = 30.0;
/// And above this one: a law has no term of exponent 0.
const LEAST: f64 = 0.05;
/// Exponents of the starts; one keeps its sign.
const STARTS: [f64; 6] = [-25.0, -12.0, -4.0, 4.0, 12.0, 25.0];
/// Those of a single exponent where few are followed: the errors of laws that stiffen have a narrow valley.
const CLOSE: [f64; 12] = [
    -25.0, -17.0, -11.0, -7.0, -4.0, -2.0, 2.0, 4.0, 7.0, 11.0, 17.0, 25.0,
];
/// Terms whose part of the shear modulus is smaller are left out.
const NOTHING: f64 = 1e-6;

/// What of a law is asked for.
#[derive(Clone, Debug, PartialEq)]
pub enum Exponents {
    /// Given, a term each.
    Fixed(Vec<f64>),
    /// So many terms, exponents to be found.
    Free(usize),
}

/// All choices of `count` of the starts' exponents.
fn choices(count: usize) -> Vec<Vec<f64>> {
    let all = 1u32 << STARTS.len();
    let chosen = |bits: u32| (0..STARTS.len()).filter(move |at| bits >> at & 1 == 1);
    (0..all)
        .filter(|bits| bits.count_ones() as usize == count)
        .map(|bits| chosen(bits).map(|at| STARTS[at]).collect())
        .collect()
}

/// The best law of all starts.
pub fn best(test: &(impl Test<Ogden> + ?Sized), exponents: &Exponents) -> Result<Ogden> {
    let unit = test.unit();
    let (starts, fixed) = match exponents {
        Exponents::Fixed(list) => (vec![list.clone()], true),
        Exponents::Free(1) if test.cost() == Cost::Large => {
            (CLOSE.map(|alpha| vec![alpha]).into(), false)
        }
        Exponents::Free(count) => (choices(*count), false),
    };
    // Part and exponent of each term in turn.
    let unknowns = |alpha: f64| {
        let exponent = match fixed {
            true => Unknown::fixed(alpha),
            false if alpha < 0.0 => Unknown::between(alpha, [-BOUND, -LEAST]),
            false => Unknown::between(alpha, [LEAST, BOUND]),
        };
        [Unknown::stiffness(), exponent]
    };
    let starts = starts.into_iter();
    let starts = starts.map(|start| start.into_iter().flat_map(unknowns).collect());
    let terms = |constants: &[f64]| -> Vec<[f64; 2]> {
        let pairs = constants.as_chunks::<2>().0.iter();
        pairs
            .map(|[part, alpha]| [2.0 * unit * part / alpha, *alpha])
            .collect()
    };
    let constants = least_squares::best(test, starts.collect(), |constants| {
        Ogden::new(&terms(constants))
    })?;
    let mut terms = terms(&constants);
    let whole: f64 = terms.iter().map(|[mu, alpha]| mu * alpha).sum();
    terms.retain(|[mu, alpha]| mu * alpha > NOTHING * whole);
    terms.sort_by(|a, b| (b[0] * b[1]).total_cmp(&(a[0] * a[1])));
    match Ogden::new(&terms) {
        Some(law) if !terms.is_empty() => Ok(law),
        _ => bail!("no law fits: the shear modulus comes out as zero"),
    }
}

#[cfg(test)]
mod tests {
    use super::{Exponents, best};
    use crate::fit::curve::{Curve, Mode, nominal_stress};
    use elements::Ogden;

    fn curves(law: &Ogden) -> Vec<Curve> {
        let points = |mode, from: f64, to: f64| Curve {
            mode,
            points: (0..=20)
                .map(|k| from + (to - from) * f64::from(k) / 20.0)
                .map(|x| [x, nominal_stress(law, mode, x)])
                .collect(),
        };
        vec![
            points(Mode::Tension, 1.0, 1.1),
            points(Mode::Compression, 1.0, 0.9),
            points(Mode::Shear, 0.0, 0.2),
        ]
    }

    #[test]
    fn a_law_is_found_again_from_its_own_curves() {
        let law = Ogden::new(&[[-157.0, -18.7]]).unwrap();
        let found = best(&curves(&law)[..], &Exponents::Free(1)).unwrap();
        let term = found.terms.iter().next().unwrap();
        assert!((term.alpha + 18.7).abs() < 1e-4, "{found}");
        assert!((term.mu_pa + 157.0).abs() < 1e-2, "{found}");
        let law = Ogden::new(&[[400.0, 2.0], [-100.0, -2.0]]).unwrap();
        let found = best(&curves(&law)[..], &Exponents::Fixed(vec![2.0, -2.0])).unwrap();
        for (term, want) in found.terms.iter().zip([400.0, -100.0]) {
            assert!((term.mu_pa - want).abs() < 1e-3 * want.abs(), "{found}");
        }
    }
}
