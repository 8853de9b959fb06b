//! What fibres add to the stress, the energy and the tangent of their matrix, in f64 ([`crate::Fibred`] has the equations).
//!
//! With `C = F^T F` and the direction `a` at rest, `x = a . C a - a . a` is zero at rest and
//! positive where the fibres are longer. Their energy density `psi(x)` is zero for `x <= 0`: fibres
//! pull and do not push. Where an element has no direction, `a = 0`, nothing is added.

use crate::laws::Fibred;
use crate::vector::dot;

/// The fibres of a deformed element.
#[derive(Clone, Copy)]
pub(crate) struct Stretched {
    /// Their direction at rest.
    pub a: [f64; 3],
    /// `F a`.
    pub image: [f64; 3],
    /// `|F a|² - |a|²`.
    pub x: f64,
}

impl Stretched {
    /// Of a deformation gradient, rows; none where there is no direction.
    pub fn of(f: &[[f64; 3]; 3], a: [f64; 3]) -> Option<Self> {
        let own = dot(a, a);
        if own == 0.0 {
            return None;
        }
        let image = f.map(|row| dot(row, a));
        let x = dot(image, image) - own;
        Some(Self { a, image, x })
    }
}

/// Adds `2 psi'(x) F a (x) a`, Pa.
pub(crate) fn add_stress(
    fibres: &Fibred,
    own: Option<Stretched>,
    shear_pa: f64,
    out: &mut [[f64; 3]; 3],
) {
    let Some(Stretched { a, image, x }) = own.filter(|own| own.x > 0.0) else {
        return;
    };
    let pull = 2.0 * shear_pa * fibres.pull(x);
    for (row, image) in out.iter_mut().zip(image) {
        for (sum, a) in row.iter_mut().zip(a) {
            *sum += pull * image * a;
        }
    }
}

/// `psi / mu`.
pub(crate) fn energy(fibres: &Fibred, own: Option<Stretched>) -> f64 {
    own.map_or(0.0, |own| fibres.stored(own.x))
}

/// Adds `2 psi' delta_ik a_j a_l + 4 psi'' (F a)_i a_j (F a)_k a_l`, Pa, in row `3 i + j`, column `3 k + l`.
///
/// The first part is the pull, which turns with the tissue; the second is how the pull rises with
/// the stretch.
pub(crate) fn add_tangent(
    fibres: &Fibred,
    own: Option<Stretched>,
    shear_pa: f64,
    out: &mut [[f64; 9]; 9],
) {
    let Some(Stretched { a, image, x }) = own.filter(|own| own.x > 0.0) else {
        return;
    };
    let (pull, rise) = (
        2.0 * shear_pa * fibres.pull(x),
        4.0 * shear_pa * fibres.rise(x),
    );
    for (row, sums) in out.iter_mut().enumerate() {
        let (i, j) = (row / 3, row % 3);
        for (column, sum) in sums.iter_mut().enumerate() {
            let (k, l) = (column / 3, column % 3);
            let turned = if i == k { pull } else { 0.0 };
            *sum += (turned + rise * image[i] * image[k]) * a[j] * a[l];
        }
    }
}

/// Adds the stiffness that fibres give an element of this `volume` between its corners, µN/mm.
///
/// The tangent of [`add_tangent`], contracted with the gradients of two corners' shape functions:
/// of `g_m` only `g_m . a` is left. `gradients` are 1/mm at rest, `volume` mm³; rows and columns
/// are `3 corner + axis`.
pub(crate) fn add_stiffness(
    fibres: &Fibred,
    own: Option<Stretched>,
    (shear_pa, volume): (f64, f64),
    gradients: [[f64; 3]; 4],
    out: &mut [[f64; 12]; 12],
) {
    let Some(Stretched { a, image, x }) = own.filter(|own| own.x > 0.0) else {
        return;
    };
    let along = gradients.map(|g| dot(g, a));
    let (pull, rise) = (
        2.0 * shear_pa * volume * fibres.pull(x),
        4.0 * shear_pa * volume * fibres.rise(x),
    );
    for (first, g) in along.into_iter().enumerate() {
        for (second, h) in along.into_iter().enumerate() {
            for i in 0..3 {
                for k in 0..3 {
                    let turned = if i == k { pull } else { 0.0 };
                    out[3 * first + i][3 * second + k] +=
                        (turned + rise * image[i] * image[k]) * g * h;
                }
            }
        }
    }
}

/// Adds the stress that fibres of several directions have at one deformation gradient, Pa: with their mean structure tensor `M = sum v a (x) a / sum v` they pull
/// as one family whose `x` is its mean, `(C : M - tr M) / tr M`. Of one direction it is that of its elements.
pub fn add_mean_stress(
    fibres: &Fibred,
    f: &[[f64; 3]; 3],
    (structure, shear_pa): (&[[f64; 3]; 3], f64),
    out: &mut [[f64; 3]; 3],
) {
    let trace = structure[0][0] + structure[1][1] + structure[2][2];
    if trace <= 0.0 {
        return;
    }
    let image = f.map(|row| structure.map(|column| dot(row, column)));
    let square: f64 = (0..3).map(|i| dot(f[i], image[i])).sum();
    let x = (square - trace) / trace;
    if x <= 0.0 {
        return;
    }
    let pull = 2.0 * shear_pa * fibres.pull(x);
    for (row, image) in out.iter_mut().zip(image) {
        for (sum, value) in row.iter_mut().zip(image) {
            *sum += pull * value;
        }
    }
}
