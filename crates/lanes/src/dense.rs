//! Parts of a register: the ends of rows whose length is no multiple of the lanes.
//!
//! Masked loads and stores are slower than plain ones on some machines, and copies through the
//! stack where there are no masks; these two take the plain way wherever a whole register is there.
//! A lane behind `count` is zero, and so adds nothing to a sum of products.

use super::DenseLanes;

/// `count <= COUNT` lanes from memory; zeros behind them.
///
/// # Safety
/// As [`DenseLanes`].
#[inline(always)]
pub unsafe fn load_some<V: DenseLanes>(from: *const f32, count: usize) -> V {
    // SAFETY: the caller's.
    unsafe {
        if count == V::COUNT {
            V::load(from)
        } else {
            V::load_part(from, count)
        }
    }
}

/// `count <= COUNT` lanes to memory.
///
/// # Safety
/// As [`DenseLanes`].
#[inline(always)]
pub unsafe fn store_some<V: DenseLanes>(x: V, to: *mut f32, count: usize) {
    // SAFETY: the caller's.
    unsafe {
        if count == V::COUNT {
            x.store(to)
        } else {
            x.store_part(to, count)
        }
    }
}
