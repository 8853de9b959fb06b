//! The element law on batches of 16 tetrahedra: displacements in, nodal forces added.
//!
//! With `F = I + sum_a (u_a - u_0) (x) dN_a/dX` the first Piola stress of the
//! neo-Hookean law is
//! `P = mu J^(-2/3) F + [kappa (J - 1) - mu/3 J^(-5/3) I1] cof F`
//! and a corner's force is `f_a = -V P dN_a/dX`. `J^(-1/3)` comes from an integer
//! guess and two polynomial corrections, to f32 accuracy, without log or division.
//!
//! A block of batches goes through three short loops (deformation, stress, forces)
//! with a buffer between them: the iterations of each are independent and overlap,
//! where one long loop would wait for its own cube root.
//!
//! No closures here or in `lanes`: a closure does not take on its caller's
//! instruction set, and every vector operation in it would become a call.

use super::lanes::{Lanes, WIDTH};
use super::partition::Batch;

/// Batches that go through the loops together; their tensors fill 5 kB of the first-level cache.
const BLOCK: usize = 8;

/// Moduli in the solver's units, Pa.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Law {
    pub shear: f32,
    pub bulk: f32,
}

/// Floating-point operations of one element in [`add_forces`], a fused multiply-add counted as two:
/// differences 9, F 48, cofactors 27, det 5, invariant 17, root 21, coefficients 11, stress 27, forces 54, adds 24.
pub(crate) const FLOPS_PER_ELEMENT: usize = 243;

/// `x^(-1/3)` for positive `x`, relative error about 1e-7.
#[inline(always)]
pub(crate) unsafe fn inverse_cube_root<L: Lanes>(x: L) -> L {
    unsafe {
        let one = L::splat(1.0);
        let y = x.inverse_cube_root_guess();
        // y (1 - e)^(-1/3) with e = 1 - x y^3: third order, then first order.
        let e = y.mul(y).neg_mul_add(y.mul(x), one);
        let series = e
            .mul_add(L::splat(14.0 / 81.0), L::splat(2.0 / 9.0))
            .mul_add(e, L::splat(1.0 / 3.0));
        let y = y.mul(e).mul_add(series, y);
        let e = y.mul(y).neg_mul_add(y.mul(x), one);
        y.mul(e).mul_add(L::splat(1.0 / 3.0), y)
    }
}

/// A second-order tensor of 16 elements, row-major, and one scalar.
#[repr(C, align(64))]
#[derive(Clone, Copy)]
struct Tensors {
    entry: [[f32; WIDTH]; 9],
    /// Mean of the corners' fourth component: nodal pressure, where it is used.
    scalar: [f32; WIDTH],
}

const EMPTY: Tensors = Tensors {
    entry: [[0.0; WIDTH]; 9],
    scalar: [0.0; WIDTH],
};

/// Deformation gradients of the elements of a batch from lane `first` on.
#[inline(always)]
unsafe fn deformation<L: Lanes>(
    batch: &Batch,
    first: usize,
    nodes: *const [f32; 4],
    out: &mut Tensors,
) {
    unsafe {
        let zero = L::splat(0.0);
        let origin = L::gather(nodes, batch.corners[0].as_ptr().add(first));
        let mut f = [[zero; 3]; 3];
        let mut scalar = origin[3];
        for i in 0..3 {
            f[i][i] = L::splat(1.0);
        }
        for a in 0..3 {
            let corner = L::gather(nodes, batch.corners[a + 1].as_ptr().add(first));
            scalar = scalar.add(corner[3]);
            for i in 0..3 {
                let difference = corner[i].sub(origin[i]);
                for j in 0..3 {
                    let slope = L::load(batch.gradient[3 * a + j].as_ptr().add(first));
                    f[i][j] = difference.mul_add(slope, f[i][j]);
                }
            }
        }
        for i in 0..3 {
            for j in 0..3 {
                f[i][j].store(out.entry[3 * i + j].as_mut_ptr().add(first));
            }
        }
        scalar
            .mul(L::splat(0.25))
            .store(out.scalar.as_mut_ptr().add(first));
    }
}

#[inline(always)]
unsafe fn cross<L: Lanes>(a: [L; 3], b: [L; 3]) -> [L; 3] {
    unsafe {
        [
            a[2].neg_mul_add(b[1], a[1].mul(b[2])),
            a[0].neg_mul_add(b[2], a[2].mul(b[0])),
            a[1].neg_mul_add(b[0], a[0].mul(b[1])),
        ]
    }
}

/// Loads `F`; returns it, its cofactor matrix and its determinant.
#[inline(always)]
unsafe fn cofactors<L: Lanes>(tensors: &Tensors, first: usize) -> ([[L; 3]; 3], [[L; 3]; 3], L) {
    unsafe {
        let mut f = [[L::splat(0.0); 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                f[i][j] = L::load(tensors.entry[3 * i + j].as_ptr().add(first));
            }
        }
        let cofactor = [cross(f[1], f[2]), cross(f[2], f[0]), cross(f[0], f[1])];
        let determinant = f[0][2].mul_add(
            cofactor[0][2],
            f[0][1].mul_add(cofactor[0][1], f[0][0].mul(cofactor[0][0])),
        );
        (f, cofactor, determinant)
    }
}

/// Replaces `F` by `-V P`; returns det F.
#[inline(always)]
unsafe fn stress<L: Lanes, const AVERAGED: bool>(
    batch: &Batch,
    first: usize,
    tensors: &mut Tensors,
    law: Law,
) -> L {
    unsafe {
        let (f, cofactor, determinant) = cofactors::<L>(tensors, first);
        let root = inverse_cube_root(determinant.max(L::splat(1e-3)));
        let root2 = root.mul(root);
        // Three sums of three: a shorter chain than one of nine.
        let mut invariant = L::splat(0.0);
        for row in f {
            let part = row[2].mul_add(row[2], row[1].mul_add(row[1], row[0].mul(row[0])));
            invariant = invariant.add(part);
        }
        let volume = L::load(batch.volume.as_ptr().add(first));
        let deviatoric = volume.mul(L::splat(-law.shear)).mul(root2);
        let pressure = if AVERAGED {
            L::load(tensors.scalar.as_ptr().add(first)).mul(volume)
        } else {
            volume
                .mul(L::splat(law.bulk))
                .mul(determinant.sub(L::splat(1.0)))
        };
        let inverse = root2.mul(root).mul(L::splat(-1.0 / 3.0));
        let spherical = deviatoric.mul(inverse).mul(invariant).sub(pressure);
        for i in 0..3 {
            for j in 0..3 {
                spherical
                    .mul_add(cofactor[i][j], deviatoric.mul(f[i][j]))
                    .store(tensors.entry[3 * i + j].as_mut_ptr().add(first));
            }
        }
        determinant
    }
}

/// Adds `-V P dN_a/dX` to the corners.
#[inline(always)]
unsafe fn scatter<L: Lanes>(batch: &Batch, first: usize, tensors: &Tensors, forces: *mut [f32; 4]) {
    unsafe {
        let zero = L::splat(0.0);
        let mut sum = [zero; 4];
        for a in 0..3 {
            let slope: *const f32 = batch.gradient[3 * a].as_ptr().add(first);
            let mut force = [zero; 4];
            for i in 0..3 {
                let row = tensors.entry[3 * i].as_ptr().add(first);
                force[i] = L::load(row).mul(L::load(slope));
                for j in 1..3 {
                    let entry = L::load(row.add(j * WIDTH));
                    force[i] = entry.mul_add(L::load(slope.add(j * WIDTH)), force[i]);
                }
                sum[i] = sum[i].sub(force[i]);
            }
            L::scatter_add(forces, batch.corners[a + 1].as_ptr().add(first), force);
        }
        L::scatter_add(forces, batch.corners[0].as_ptr().add(first), sum);
    }
}

/// Adds the forces (µN) of the batches to `forces`; returns the smallest det F seen.
///
/// With `AVERAGED` the pressure is the mean of the corners' fourth component
/// instead of `kappa (J - 1)` of the element.
#[inline(always)]
pub(crate) unsafe fn add_forces<L: Lanes, const AVERAGED: bool>(
    batches: &[Batch],
    nodes: *const [f32; 4],
    forces: *mut [f32; 4],
    law: Law,
) -> f32 {
    unsafe {
        let mut smallest = L::splat(f32::MAX);
        let mut buffer = [EMPTY; BLOCK];
        for block in batches.chunks(BLOCK) {
            for (batch, tensors) in block.iter().zip(&mut buffer) {
                for first in (0..WIDTH).step_by(L::COUNT) {
                    deformation::<L>(batch, first, nodes, tensors);
                }
            }
            for (batch, tensors) in block.iter().zip(&mut buffer) {
                for first in (0..WIDTH).step_by(L::COUNT) {
                    smallest = smallest.min(stress::<L, AVERAGED>(batch, first, tensors, law));
                }
            }
            for (batch, tensors) in block.iter().zip(&buffer) {
                for first in (0..WIDTH).step_by(L::COUNT) {
                    scatter::<L>(batch, first, tensors, forces);
                }
            }
        }
        let mut lanes = [f32::MAX; WIDTH];
        smallest.store(lanes.as_mut_ptr());
        lanes.into_iter().fold(f32::MAX, f32::min)
    }
}

/// Adds each element's current volume to the fourth component of its corners' `forces`.
#[inline(always)]
pub(crate) unsafe fn add_volumes<L: Lanes>(
    batches: &[Batch],
    nodes: *const [f32; 4],
    forces: *mut [f32; 4],
) {
    unsafe {
        let zero = L::splat(0.0);
        let mut tensors = EMPTY;
        for batch in batches {
            for first in (0..WIDTH).step_by(L::COUNT) {
                deformation::<L>(batch, first, nodes, &mut tensors);
                let (_, _, determinant) = cofactors::<L>(&tensors, first);
                let volume = determinant.mul(L::load(batch.volume.as_ptr().add(first)));
                for corners in &batch.corners {
                    let corners = corners.as_ptr().add(first);
                    L::scatter_add(forces, corners, [zero, zero, zero, volume]);
                }
            }
        }
    }
}
