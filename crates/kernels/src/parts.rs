//! One output that the chunks of a job write in disjoint parts.
//!
//! Rust lends a slice mutably to one thread only. A job's chunks are closures of one shared borrow,
//! so the split into parts is promised by the kernel that knows who writes what: a row, a block of
//! columns, a worker's scratch space. Bounds are checked, disjointness is the promise.

/// A mutable slice that chunks of one job write in disjoint parts.
pub struct Parts<T> {
    address: *mut T,
    len: usize,
}
// SAFETY: `Parts` only hands out parts that its users promise to be disjoint.
unsafe impl<T: Send> Send for Parts<T> {}
// SAFETY: as above.
unsafe impl<T: Send> Sync for Parts<T> {}

impl<T> Parts<T> {
    /// Parts of this slice.
    pub fn new(slice: &mut [T]) -> Self {
        Self {
            address: slice.as_mut_ptr(),
            len: slice.len(),
        }
    }

    /// The part `start..start + len`.
    ///
    /// # Safety
    /// No two parts alive at once overlap, and the slice given to `new` outlives them.
    #[allow(clippy::mut_from_ref)]
    pub unsafe fn part(&self, start: usize, len: usize) -> &mut [T] {
        assert!(start <= self.len && len <= self.len - start, "part outside");
        // SAFETY: inside the slice by the line above; disjoint by the caller's promise.
        unsafe { std::slice::from_raw_parts_mut(self.address.add(start), len) }
    }

    /// Writes one element.
    ///
    /// # Safety
    /// No other chunk touches this element during the job, and the slice is still alive.
    pub unsafe fn write(&self, index: usize, value: T) {
        assert!(index < self.len, "write outside");
        // SAFETY: in bounds by the line above; not shared by the caller's promise.
        unsafe { self.address.add(index).write(value) };
    }
}
