//! Run-time choice of the instruction set, and the kernels compiled for each.
//!
//! A kernel is generic over its lanes and inlined into one function for each set, which carries
//! `target_feature`. Those functions are kept as pointers ([`Kernels`]), chosen once when a body is
//! packed, so that no call looks at the processor again. What differs by law is decided here, once
//! a chunk, outside of all loops.

#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "one contract for all: each function is chosen where the machine has its instruction set"
)]

use crate::kernel::{
    Eigenvalues, LaneFibres, LaneTerms, SecondLoop, Seconds, Shape, Strain, add_forces,
    add_forces_of_fibres, add_forces_of_stretches, add_volumes, add_volumes_of_stretches,
    by_eigenvalues, relax,
};
use crate::laws::Law;
use crate::partition::{Chunk, Partition};
use crate::slots::{advance, place};
use crate::stress_step::{SIX, StressStep};
use lanes::{Isa, NodeLanes, WIDTH};

/// With `true` the pressure of an element comes from its nodes' dilatation, the fourth components of their positions.
type ForceKernel = unsafe fn(&Partition, &Chunk, *const [f32; 4], *mut [f32; 4], bool) -> f32;
/// Adds each element's volume times its bulk modulus to the third component of its corners' slots.
type VolumeKernel = unsafe fn(&Partition, &Chunk, *const [f32; 4], *mut [f32; 4]);
/// Displacements by slot, and two rows of forces of which the second may be null.
type RelaxKernel =
    unsafe fn(&Partition, &Chunk, &StressStep, [*mut f32; 3], *const [f32; 4], [*mut [f32; 4]; 2]);
/// `positions = rest + displacement`, see [`place`].
type PlaceKernel = unsafe fn(usize, *const [f32; 4], *const [f32; 4], *mut [f32; 4]);
/// One explicit step of the nodes, see [`advance`].
type AdvanceKernel = unsafe fn(usize, f32, *const [f32; 4], *mut [f32; 4], *mut [f32; 4]);

/// The kernels of one instruction set.
#[derive(Clone, Copy)]
pub struct Kernels {
    /// Adds the forces of a chunk's elements to its slots; returns the smallest det F.
    pub forces: ForceKernel,
    /// For nodal dilatation.
    pub volumes: VolumeKernel,
    /// Takes a state into what a chunk's elements remember of their stresses ([`crate::StressHistory::pointers`]), and adds what that pushes with.
    pub relax: RelaxKernel,
    /// `positions = rest + displacement` of a chunk's slots.
    pub place: PlaceKernel,
    /// One explicit step of a chunk's slots.
    pub advance: AdvanceKernel,
}

/// Forces of all clusters of a chunk; returns the smallest det F.
#[inline(always)]
unsafe fn all_forces<L: Eigenvalues>(
    partition: &Partition,
    chunk: &Chunk,
    nodes: *const [f32; 4],
    forces: *mut [f32; 4],
    averaged: bool,
) -> f32 {
    unsafe {
        // All elements of a chunk have one law, so this is the only branch on it.
        let law = partition.moduli_of(chunk).law;
        let matrix = law.matrix();
        let smallest = match (matrix, Seconds::of(matrix)) {
            (_, Some(laws)) => forces_by::<L, _>(laws, partition, chunk, nodes, forces, averaged),
            (Law::NeoHookean(law), None) => {
                forces_by::<L, _>(law, partition, chunk, nodes, forces, averaged)
            }
            (_, None) => forces_by_stretches::<L>(partition, chunk, nodes, forces, averaged),
        };
        // In a second pass over the chunk's slots, which the first has left in the cache.
        if let Some(fibres) = law.fibres() {
            let fibres = LaneFibres::new(fibres, partition.moduli.shear_pa);
            forces_of_fibres::<L>(&fibres, partition, chunk, nodes, forces);
        }
        smallest
    }
}

/// Adds what the fibres of a chunk pull with.
#[inline(always)]
unsafe fn forces_of_fibres<L: NodeLanes>(
    fibres: &LaneFibres,
    partition: &Partition,
    chunk: &Chunk,
    nodes: *const [f32; 4],
    forces: *mut [f32; 4],
) {
    unsafe {
        let from_positions = !partition.moduli_of(chunk).law.takes_displacements();
        let (octahedra, pairs, singles) = partition.clusters(chunk);
        let (a, b, c) = partition.directions(chunk);
        let (octahedra, pairs, singles) = ((octahedra, a), (pairs, b), (singles, c));
        add_forces_of_fibres::<L, 6, 4>(fibres, from_positions, octahedra, nodes, forces);
        add_forces_of_fibres::<L, 5, 2>(fibres, from_positions, pairs, nodes, forces);
        add_forces_of_fibres::<L, 4, 1>(fibres, from_positions, singles, nodes, forces);
    }
}

/// The same by a law, or laws that share code: code is what a law costs those who do not use it.
#[inline(always)]
unsafe fn forces_by<L: NodeLanes, M: SecondLoop>(
    law: M,
    partition: &Partition,
    chunk: &Chunk,
    nodes: *const [f32; 4],
    forces: *mut [f32; 4],
    averaged: bool,
) -> f32 {
    unsafe {
        let moduli = partition.moduli;
        let law = (law, (moduli.bulk_pa / moduli.shear_pa) as f32);
        let (octahedra, pairs, singles) = partition.clusters(chunk);
        let mut shape = Shape::EMPTY;
        let shape = &mut shape;
        let a = add_forces::<L, M, 6, 4>(law, averaged, octahedra, nodes, forces, shape);
        let b = add_forces::<L, M, 5, 2>(law, averaged, pairs, nodes, forces, shape);
        let c = add_forces::<L, M, 4, 1>(law, averaged, singles, nodes, forces, shape);
        a.min(b).min(c)
    }
}

/// The same by a law in principal stretches.
#[inline(always)]
unsafe fn forces_by_stretches<L: Eigenvalues>(
    partition: &Partition,
    chunk: &Chunk,
    nodes: *const [f32; 4],
    forces: *mut [f32; 4],
    averaged: bool,
) -> f32 {
    unsafe {
        let moduli = partition.moduli_of(chunk);
        let law = &LaneTerms::new(&moduli.law, [moduli.shear_pa, moduli.bulk_pa]);
        let (octahedra, pairs, singles) = partition.clusters(chunk);
        let (of_octahedra, of_pairs, of_singles) = partition.gradients(chunk);
        let octahedra = (octahedra, of_octahedra);
        let (pairs, singles) = ((pairs, of_pairs), (singles, of_singles));
        let a = add_forces_of_stretches::<L, 6, 4>(law, averaged, octahedra, nodes, forces);
        let b = add_forces_of_stretches::<L, 5, 2>(law, averaged, pairs, nodes, forces);
        let c = add_forces_of_stretches::<L, 4, 1>(law, averaged, singles, nodes, forces);
        a.min(b).min(c)
    }
}

/// Adds the volumes of all clusters of a chunk.
/// A law in principal stretches is given displacements and has gradients beside its clusters; the
/// others are given positions.
#[inline(always)]
unsafe fn all_volumes<L: NodeLanes>(
    partition: &Partition,
    chunk: &Chunk,
    nodes: *const [f32; 4],
    forces: *mut [f32; 4],
) {
    unsafe {
        let (octahedra, pairs, singles) = partition.clusters(chunk);
        if partition.moduli_of(chunk).law.takes_displacements() {
            let bulk = partition.moduli.bulk_pa as f32;
            let (of_octahedra, of_pairs, of_singles) = partition.gradients(chunk);
            add_volumes_of_stretches::<L, 6, 4>(bulk, (octahedra, of_octahedra), nodes, forces);
            add_volumes_of_stretches::<L, 5, 2>(bulk, (pairs, of_pairs), nodes, forces);
            add_volumes_of_stretches::<L, 4, 1>(bulk, (singles, of_singles), nodes, forces);
        } else {
            add_volumes::<L, 6, 4>(octahedra, nodes, forces);
            add_volumes::<L, 5, 2>(pairs, nodes, forces);
            add_volumes::<L, 4, 1>(singles, nodes, forces);
        }
    }
}

/// What the elements of a chunk remember goes on, and pushes.
#[inline(always)]
unsafe fn all_histories<L: Eigenvalues>(
    partition: &Partition,
    chunk: &Chunk,
    step: &StressStep,
    [of_octahedra, of_pairs, of_singles]: [*mut f32; 3],
    nodes: *const [f32; 4],
    forces: [*mut [f32; 4]; 2],
) {
    unsafe {
        let moduli = partition.moduli_of(chunk);
        // The material's modulus is that of the elements, `g0` times the law's; the history is of
        // the law's own.
        let shear = moduli.shear_pa * step.stiffer;
        let terms = LaneTerms::new(&moduli.law, [shear, moduli.bulk_pa]);
        let fibres = moduli.law.fibres();
        let fibres = fibres.map(|own| LaneFibres::new(own, shear));
        let law = (&terms, fibres.as_ref());
        let (octahedra, pairs, singles) = partition.clusters(chunk);
        let (a, b, c) = partition.gradients(chunk);
        let (d, e, f) = partition.directions(chunk);
        // Numbers of one batch: for each lane six of the stress of the state before, and six of
        // each branch.
        let batch = (step.count + 1) * SIX * WIDTH;
        let of_octahedra = of_octahedra.add(chunk.octahedra.start * 4 * batch);
        let of_pairs = of_pairs.add(chunk.pairs.start * 2 * batch);
        let of_singles = of_singles.add(chunk.singles.start * batch);
        let (octahedra, pairs, singles) = ((octahedra, a, d), (pairs, b, e), (singles, c, f));
        // Two copies of the code, so that one row of forces costs no branch in the inner loop.
        if forces[1].is_null() {
            relax::<L, 6, 4, 1>(law, step, octahedra, of_octahedra, nodes, forces);
            relax::<L, 5, 2, 1>(law, step, pairs, of_pairs, nodes, forces);
            relax::<L, 4, 1, 1>(law, step, singles, of_singles, nodes, forces);
        } else {
            relax::<L, 6, 4, 2>(law, step, octahedra, of_octahedra, nodes, forces);
            relax::<L, 5, 2, 2>(law, step, pairs, of_pairs, nodes, forces);
            relax::<L, 4, 1, 2>(law, step, singles, of_singles, nodes, forces);
        }
    }
}

/// Compiles the kernels for one `Lanes` type, with [`Eigenvalues::APART`], under the given target features.
/// The function of the eigenvalues is not inlined: it is long, and each of the three sizes of
/// clusters calls it in two kernels.
macro_rules! kernels {
    ($module:ident, $lanes:ty, $apart:literal $(, $feature:literal)?) => {
        mod $module {
            use super::*;

            $(#[target_feature(enable = $feature)])?
            unsafe fn forces(
                p: &Partition,
                chunk: &Chunk,
                n: *const [f32; 4],
                f: *mut [f32; 4],
                averaged: bool,
            ) -> f32 {
                unsafe { all_forces::<$lanes>(p, chunk, n, f, averaged) }
            }

            $(#[target_feature(enable = $feature)])?
            unsafe fn volumes(
                p: &Partition,
                chunk: &Chunk,
                n: *const [f32; 4],
                f: *mut [f32; 4],
            ) {
                unsafe { all_volumes::<$lanes>(p, chunk, n, f) }
            }

            $(#[target_feature(enable = $feature)])?
            unsafe fn histories(
                p: &Partition,
                chunk: &Chunk,
                step: &StressStep,
                values: [*mut f32; 3],
                n: *const [f32; 4],
                f: [*mut [f32; 4]; 2],
            ) {
                unsafe { all_histories::<$lanes>(p, chunk, step, values, n, f) }
            }

            $(#[target_feature(enable = $feature)])?
            unsafe fn place_nodes(
                count: usize,
                rest: *const [f32; 4],
                u: *const [f32; 4],
                x: *mut [f32; 4],
            ) {
                unsafe { place::<$lanes>(count, rest, u, x) }
            }

            $(#[target_feature(enable = $feature)])?
            unsafe fn advance_nodes(
                count: usize,
                beta: f32,
                f: *const [f32; 4],
                d: *mut [f32; 4],
                u: *mut [f32; 4],
            ) {
                unsafe { advance::<$lanes>(count, beta, f, d, u) }
            }

            $(#[target_feature(enable = $feature)])?
            #[inline(never)]
            unsafe fn deviator(law: &LaneTerms, strain: &Strain<$lanes>) -> [$lanes; 6] {
                unsafe { by_eigenvalues(law, strain) }
            }

            impl Eigenvalues for $lanes {
                const APART: bool = $apart;

                #[inline(always)]
                unsafe fn by_eigenvalues(law: &LaneTerms, strain: &Strain<Self>) -> [Self; 6] {
                    unsafe { deviator(law, strain) }
                }
            }

            pub const KERNELS: Kernels = Kernels {
                forces,
                volumes,
                relax: histories,
                place: place_nodes,
                advance: advance_nodes,
            };
        }
    };
}

// Eight lanes, as in the portable set: one code for both.
#[cfg(any(not(target_family = "wasm"), feature = "scalar"))]
kernels!(scalar, lanes::Scalar<8>, true);
#[cfg(target_arch = "x86_64")]
kernels!(portable, lanes::Portable, false, "avx2,fma");
#[cfg(target_arch = "aarch64")]
kernels!(portable, lanes::Portable, false, "neon");
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
kernels!(portable, lanes::Portable, false);
#[cfg(target_arch = "x86_64")]
kernels!(avx2, lanes::Avx2, false, "avx2,fma");
#[cfg(target_arch = "x86_64")]
kernels!(avx512, lanes::Avx512, false, "avx512f,avx512vl,avx2,fma");
#[cfg(target_arch = "aarch64")]
kernels!(neon, lanes::NeonFour, false, "neon");
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
kernels!(simd128, lanes::Simd128, false);

impl Kernels {
    /// The kernels of `isa`; `None` where this processor lacks it.
    pub fn of(isa: Isa) -> Option<Self> {
        if !isa.is_available() {
            return None;
        }
        match isa {
            #[cfg(any(not(target_family = "wasm"), feature = "scalar"))]
            Isa::Scalar => Some(scalar::KERNELS),
            #[cfg(not(any(target_arch = "aarch64", target_family = "wasm")))]
            Isa::PortableScalar => Some(scalar::KERNELS),
            #[cfg(any(
                target_arch = "x86_64",
                target_arch = "aarch64",
                all(target_arch = "wasm32", target_feature = "simd128")
            ))]
            Isa::Portable => Some(portable::KERNELS),
            #[cfg(target_arch = "x86_64")]
            Isa::Avx2 => Some(avx2::KERNELS),
            #[cfg(target_arch = "x86_64")]
            Isa::Avx512 => Some(avx512::KERNELS),
            #[cfg(target_arch = "aarch64")]
            Isa::Neon => Some(neon::KERNELS),
            #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
            Isa::Simd128 => Some(simd128::KERNELS),
            #[allow(unreachable_patterns)]
            _ => None,
        }
    }
}
