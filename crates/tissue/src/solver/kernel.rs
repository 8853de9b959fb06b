//! The element law on batches of 16 clusters of tetrahedra: displacements in, nodal forces added.
//!
//! With `F = I + sum_a (u_a - u_0) (x) dN_a/dX` the first Piola stress of the
//! neo-Hookean law is
//! `P = mu J^(-2/3) F + [kappa (J - 1) - mu/3 J^(-5/3) I1] cof F`
//! and a corner's force is `f_a = -V P dN_a/dX`. `J^(-1/3)` comes from an integer
//! guess and two polynomial corrections, to f32 accuracy, without log or division.
//!
//! Tetrahedra that share an edge or a face go through together ([`Cluster`]): their
//! nodes are gathered once and their forces meet in registers, because gathers and
//! scatters, not arithmetic, are what an element costs.
//!
//! A block of batches goes through three short loops (deformation, stress, forces)
//! with a buffer between them: the iterations of each are independent and overlap,
//! where one long loop would wait for its own cube root.
//!
//! No closures here or in `lanes`: a closure does not take on its caller's
//! instruction set, and every vector operation in it would become a call.

use super::cluster::{Cluster, corners};
use super::lanes::{Lanes, WIDTH, prefetch};

/// Tetrahedra (times 16) that go through the loops together; their tensors fill 5 kB of the first-level cache.
pub(crate) const BLOCK: usize = 8;

/// Moduli in the solver's units, Pa.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Law {
    pub shear: f32,
    pub bulk: f32,
}

/// Floating-point operations of one tetrahedron in [`add_forces`], a fused multiply-add counted as two:
/// F 54, cofactors 27, det 5, invariant 17, root 21, coefficients 11, stress 27, forces 54.
pub(crate) const FLOPS_PER_TET: usize = 216;

/// Those of one node of a cluster: difference, balance and addition, three each.
pub(crate) const FLOPS_PER_CORNER: usize = 9;

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
pub(crate) struct Tensors {
    entry: [[f32; WIDTH]; 9],
    /// Mean of the corners' fourth component: nodal pressure, where it is used.
    scalar: [f32; WIDTH],
}

/// What a block of batches keeps between the loops.
pub(crate) type Buffer = [Tensors; BLOCK];

pub(crate) const EMPTY: Tensors = Tensors {
    entry: [[0.0; WIDTH]; 9],
    scalar: [0.0; WIDTH],
};

/// Deformation gradients of the tetrahedra of a batch from lane `first` on.
#[inline(always)]
unsafe fn deformation<L: Lanes, const NODES: usize, const TETS: usize, const AVERAGED: bool>(
    cluster: &Cluster<NODES, TETS>,
    first: usize,
    nodes: *const [f32; 4],
    out: &mut [Tensors],
) {
    unsafe {
        let zero = L::splat(0.0);
        let mut displacement = [[zero; 4]; NODES];
        for (node, value) in displacement.iter_mut().enumerate() {
            *value = L::gather(nodes, cluster.slots[node].as_ptr().add(first));
        }
        let origin = displacement[0];
        for value in &mut displacement[1..] {
            for i in 0..3 {
                value[i] = value[i].sub(origin[i]);
            }
        }
        for tet in 0..TETS {
            let mut f = [[zero; 3]; 3];
            let mut scalar = origin[3];
            for i in 0..3 {
                f[i][i] = L::splat(1.0);
            }
            for (a, corner) in corners::<NODES>(tet).into_iter().enumerate() {
                if AVERAGED {
                    scalar = scalar.add(displacement[corner][3]);
                }
                for i in 0..3 {
                    for j in 0..3 {
                        let slope = L::load(cluster.gradient[tet][3 * a + j].as_ptr().add(first));
                        f[i][j] = displacement[corner][i].mul_add(slope, f[i][j]);
                    }
                }
            }
            for i in 0..3 {
                for j in 0..3 {
                    f[i][j].store(out[tet].entry[3 * i + j].as_mut_ptr().add(first));
                }
            }
            if AVERAGED {
                scalar
                    .mul(L::splat(0.25))
                    .store(out[tet].scalar.as_mut_ptr().add(first));
            }
        }
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
    volume: &[f32; WIDTH],
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
        let volume = L::load(volume.as_ptr().add(first));
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
unsafe fn scatter<L: Lanes, const NODES: usize, const TETS: usize>(
    cluster: &Cluster<NODES, TETS>,
    first: usize,
    tensors: &[Tensors],
    forces: *mut [f32; 4],
) {
    unsafe {
        let mut force = [[L::splat(0.0); 4]; NODES];
        for tet in 0..TETS {
            for (a, corner) in corners::<NODES>(tet).into_iter().enumerate() {
                for i in 0..3 {
                    for j in 0..3 {
                        let entry = L::load(tensors[tet].entry[3 * i + j].as_ptr().add(first));
                        let slope = L::load(cluster.gradient[tet][3 * a + j].as_ptr().add(first));
                        force[corner][i] = entry.mul_add(slope, force[corner][i]);
                    }
                }
            }
        }
        // The forces of an element are in balance.
        for node in 1..NODES {
            for i in 0..3 {
                force[0][i] = force[0][i].sub(force[node][i]);
            }
        }
        for (node, value) in force.into_iter().enumerate() {
            L::scatter_add(forces, cluster.slots[node].as_ptr().add(first), value);
        }
    }
}

/// Adds the forces (µN) of the clusters to `forces`; returns the smallest det F seen.
///
/// With `AVERAGED` the pressure is the mean of the corners' fourth component
/// instead of `kappa (J - 1)` of the element.
#[inline(always)]
pub(crate) unsafe fn add_forces<
    L: Lanes,
    const NODES: usize,
    const TETS: usize,
    const AVERAGED: bool,
>(
    clusters: &[Cluster<NODES, TETS>],
    nodes: *const [f32; 4],
    forces: *mut [f32; 4],
    law: Law,
    buffer: &mut Buffer,
) -> f32 {
    unsafe {
        let mut smallest = L::splat(f32::MAX);
        for block in clusters.chunks(BLOCK / TETS) {
            for (cluster, tensors) in block.iter().zip(buffer.chunks_exact_mut(TETS)) {
                for first in (0..WIDTH).step_by(L::COUNT) {
                    deformation::<L, NODES, TETS, AVERAGED>(cluster, first, nodes, tensors);
                }
            }
            for (cluster, tensors) in block.iter().zip(buffer.chunks_exact_mut(TETS)) {
                prefetch(std::ptr::from_ref(cluster).wrapping_add(BLOCK / TETS));
                for (volume, tensors) in cluster.volume.iter().zip(tensors) {
                    for first in (0..WIDTH).step_by(L::COUNT) {
                        let determinant = stress::<L, AVERAGED>(volume, first, tensors, law);
                        smallest = smallest.min(determinant);
                    }
                }
            }
            for (cluster, tensors) in block.iter().zip(buffer.chunks_exact(TETS)) {
                for first in (0..WIDTH).step_by(L::COUNT) {
                    scatter::<L, NODES, TETS>(cluster, first, tensors, forces);
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
pub(crate) unsafe fn add_volumes<L: Lanes, const NODES: usize, const TETS: usize>(
    clusters: &[Cluster<NODES, TETS>],
    nodes: *const [f32; 4],
    forces: *mut [f32; 4],
) {
    unsafe {
        let zero = L::splat(0.0);
        let mut buffer = [EMPTY; TETS];
        for cluster in clusters {
            for first in (0..WIDTH).step_by(L::COUNT) {
                deformation::<L, NODES, TETS, false>(cluster, first, nodes, &mut buffer);
                let mut sum = [zero; NODES];
                for tet in 0..TETS {
                    let (_, _, determinant) = cofactors::<L>(&buffer[tet], first);
                    let rest = L::load(cluster.volume[tet].as_ptr().add(first));
                    let volume = determinant.mul(rest);
                    sum[0] = sum[0].add(volume);
                    for corner in corners::<NODES>(tet) {
                        sum[corner] = sum[corner].add(volume);
                    }
                }
                for (slots, volume) in cluster.slots.iter().zip(sum) {
                    let slots = slots.as_ptr().add(first);
                    L::scatter_add(forces, slots, [zero, zero, zero, volume]);
                }
            }
        }
    }
}
