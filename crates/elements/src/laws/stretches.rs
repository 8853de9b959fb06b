//! A law in principal stretches as a function of their logarithms: what stress, energy and tangent in f64 are made of.
//!
//! `phi(y) = e^y` up to the cap `m`, then its tangent `e^m (1 + y - m)`.

use super::terms::Terms;

/// Terms over the shear modulus, so that `sum mu alpha / 2` is one, and the cap `m`.
#[derive(Clone, Copy, Debug)]
pub struct Stretches {
    pub terms: Terms,
    pub cap: f64,
    /// How the term of exponent 2 rises with `I1 = l1² + l2² + l3²`; 0 of a law whose terms do not change with the shape.
    pub slope: f64,
}

impl Stretches {
    /// `sum mu (phi(alpha s) - 1)`: a principal stress but for a pressure, at the logarithm `s` of a stretch without change of volume.
    pub fn pull(&self, s: f64) -> f64 {
        self.sum(|mu, alpha| mu * phi_less_one(alpha * s, self.cap))
    }

    /// Its derivative by `s`, `sum mu alpha phi'(alpha s)`.
    pub fn rise(&self, s: f64) -> f64 {
        self.sum(|mu, alpha| mu * alpha * libm::exp((alpha * s).min(self.cap)))
    }

    /// `w` of three logarithms, whose sum is zero.
    pub fn energy(&self, s: [f64; 3]) -> f64 {
        self.sum(|mu, alpha| {
            mu / alpha * s.map(|s| integral(alpha * s, self.cap)).iter().sum::<f64>()
        })
    }

    /// Coefficients of `c1 D + c2 D²`, the part of `sum mu (1 + D)^(alpha / 2)` that a traceless `D` close to zero gives, to fourth order:
    /// from the second and the third invariant of `D`, and the logarithm of `det (1 + D)`.
    pub fn series(&self, j2: f64, j3: f64, log: f64) -> [f64; 2] {
        let mut out = [0.0; 2];
        for term in self.terms.iter() {
            let p = 0.5 * term.alpha;
            let c = term.mu_pa * libm::exp(-p / 3.0 * log);
            let second = p * (p - 1.0) / 2.0;
            let third = second * (p - 2.0) / 3.0;
            let fourth = third * (p - 3.0) / 4.0;
            out[0] += c * (p + third * j2 + fourth * j3);
            out[1] += c * (second + fourth * j2);
        }
        out
    }

    fn sum(&self, of: impl Fn(f64, f64) -> f64) -> f64 {
        let terms = self.terms.iter();
        terms.map(|term| of(term.mu_pa, term.alpha)).sum()
    }
}

/// `phi(y) - 1`.
fn phi_less_one(y: f64, cap: f64) -> f64 {
    if y > cap {
        libm::exp(cap) * (1.0 + y - cap) - 1.0
    } else {
        libm::expm1(y)
    }
}

/// `int_0^y phi`.
fn integral(y: f64, cap: f64) -> f64 {
    if y > cap {
        let beyond = y - cap;
        libm::expm1(cap) + libm::exp(cap) * beyond * (1.0 + 0.5 * beyond)
    } else {
        libm::expm1(y)
    }
}
