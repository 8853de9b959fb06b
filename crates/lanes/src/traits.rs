//! What kernels need of a register.

/// Elements of a mesh in a batch. It is the width of the widest register (AVX-512) and a multiple
/// of all others, so that a batch is a whole number of registers on every machine and its layout in
/// memory does not depend on the instruction set.
pub const WIDTH: usize = 16;

/// Constant of the inverse cube root's first guess, `bits(y) = GUESS - bits(x) / 3`. The bits of a
/// positive number are nearly linear in its logarithm, so dividing them by -3 nearly takes the
/// power -1/3; the constant sets the offset of the exponents right. The polynomial that follows in
/// the elements' kernel was fitted to the error of this very guess.
pub const CUBE_ROOT_GUESS: f32 = 1_419_967_116.0;

/// Bits of the root of a half, where [`FunctionLanes::split`] turns to the next power of two: the
/// mantissa is then as near to one as it can be, and a logarithm's series as short.
pub(crate) const ROOT_OF_HALF: i32 = 0x3F35_04F3;

/// Arithmetic on `COUNT` f32 lanes.
///
/// # Safety
/// All functions need the instruction set of the implementing type; pointers must be valid for `COUNT` values and need not be
/// aligned. The callers are `target_feature` functions that are reached only after run-time detection.
#[allow(clippy::missing_safety_doc)]
pub trait Lanes: Copy {
    /// Lanes of a register.
    const COUNT: usize;
    /// Whether a multiply-add is rounded once.
    const FUSED: bool;

    unsafe fn splat(x: f32) -> Self;
    unsafe fn load(from: *const f32) -> Self;
    unsafe fn store(self, to: *mut f32);
    unsafe fn add(self, other: Self) -> Self;
    unsafe fn sub(self, other: Self) -> Self;
    unsafe fn mul(self, other: Self) -> Self;
    unsafe fn div(self, other: Self) -> Self;
    /// `self * a + b`, rounded once where the set has it.
    unsafe fn mul_add(self, a: Self, b: Self) -> Self;
    /// `b - self * a`, likewise.
    unsafe fn neg_mul_add(self, a: Self, b: Self) -> Self;
    /// The smaller; a NaN in `self` is kept.
    unsafe fn min(self, other: Self) -> Self;
    /// The larger; a NaN in `self` is kept.
    unsafe fn max(self, other: Self) -> Self;
}

/// What elementary functions are made of ([`crate::functions`]).
///
/// # Safety
/// As [`Lanes`].
#[allow(clippy::missing_safety_doc)]
pub trait FunctionLanes: Lanes {
    unsafe fn sqrt(self) -> Self;
    /// The nearest integer.
    unsafe fn round(self) -> Self;
    /// `self * 2^exponent` for integer `exponent` in `-126..=127`.
    unsafe fn scale_by_power(self, exponent: Self) -> Self;
    /// Of a positive normal number, `m` and the integer `e` with `self = m 2^e` and `m` from the root of a half to that of two.
    unsafe fn split(self) -> [Self; 2];
    /// By lane: `then` where `self < limit`, else `otherwise`; a NaN takes `otherwise`.
    unsafe fn below(self, limit: Self, then: Self, otherwise: Self) -> Self;
    /// Whether `self < limit` in every lane.
    unsafe fn all_below(self, limit: Self) -> bool;
}

/// Products over tables: parts of a register, half precision, sums over the lanes.
///
/// # Safety
/// As [`Lanes`].
#[allow(clippy::missing_safety_doc)]
pub trait DenseLanes: FunctionLanes {
    /// The first `count < COUNT` lanes from memory, zeros behind them.
    unsafe fn load_part(from: *const f32, count: usize) -> Self;
    /// The first `count < COUNT` lanes to memory.
    unsafe fn store_part(self, to: *mut f32, count: usize);
    /// `COUNT` IEEE half-precision numbers, widened exactly.
    unsafe fn load_f16(from: *const half::f16) -> Self;
    /// Sums of the lanes of `four` registers, in `four`'s order: one fixed tree over the lanes, the same for each register.
    unsafe fn sums(four: [Self; 4]) -> [f32; 4];
    /// Transposes the `COUNT` rows at `from + row_offset[i]` into `COUNT` columns:
    /// `to[j * stride + i] = from[row_offset[i] + j]`.
    unsafe fn transpose(from: *const f32, row_offset: &[usize], to: *mut f32, stride: usize);
}

/// Elements of a mesh, of which `COUNT` go through together; `COUNT` divides [`WIDTH`]. A type is as wide as lets the operands of
/// a tetrahedron stay in registers.
///
/// Nodes are `[x, y, z, w]` in memory. A gather loads one corner of each of `COUNT` elements and transposes to four vectors; a
/// scatter adds back in one order of the elements, so corners that share a node are summed one after the other. Indices count half nodes
/// (8 bytes): the largest step that x86 addressing scales by itself.
///
/// # Safety
/// As [`Lanes`], for the nodes that the indices name.
#[allow(clippy::missing_safety_doc)]
pub trait NodeLanes: FunctionLanes {
    /// The bits of each lane, an integer, as a number.
    unsafe fn bits_as_numbers(self) -> Self;
    /// The whole part of each lane as bits.
    unsafe fn numbers_as_bits(self) -> Self;
    /// First guess of `self^(-1/3)` for positive values, within 4 %.
    #[inline(always)]
    unsafe fn inverse_cube_root_guess(self) -> Self {
        // SAFETY: the caller's.
        unsafe {
            let bits = self.bits_as_numbers();
            bits.neg_mul_add(Self::splat(1.0 / 3.0), Self::splat(CUBE_ROOT_GUESS))
                .numbers_as_bits()
        }
    }
    /// Of nodes that follow each other in memory, their fourth components in place of all four.
    unsafe fn fourth(self) -> Self;
    unsafe fn gather(nodes: *const [f32; 4], index: *const u16) -> [Self; 4];
    /// Adds three components; the fourth is left with anything.
    unsafe fn scatter_add(nodes: *mut [f32; 4], index: *const u16, value: [Self; 3]);
    /// The same, one element after another.
    #[inline(always)]
    unsafe fn scatter_add_in_order(nodes: *mut [f32; 4], index: *const u16, value: [Self; 3]) {
        // SAFETY: the caller's.
        unsafe { Self::scatter_add(nodes, index, value) }
    }
}
