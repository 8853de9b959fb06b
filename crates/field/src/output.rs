//! [`Output`]: a caller's memory that a call fills. A C host may pass room that nothing has been written to, where no
//! `&mut [f32]` may lead, and it may pass an input's memory, which is still being read. So it stays a pointer that can be
//! written and not read.

use std::marker::PhantomData;
use std::mem::MaybeUninit;

/// Room for `len` values of a caller.
pub struct Output<'a, T> {
    start: *mut T,
    len: usize,
    room: PhantomData<&'a mut [MaybeUninit<T>]>,
}

impl<'a, T: Copy> Output<'a, T> {
    /// Room at `start`, which need not be initialised. An input may share it until the first write.
    ///
    /// # Safety
    /// `start` is aligned, not NULL, and leads to `len` elements that nobody else reads or writes from the first write until
    /// `'a` ends.
    pub unsafe fn new(start: *mut T, len: usize) -> Output<'a, T> {
        Output {
            start,
            len,
            room: PhantomData,
        }
    }

    /// Number of values that fit.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether nothing fits.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Whether an input shares memory with it.
    pub fn overlaps<U>(&self, input: &[U]) -> bool {
        let end = self.start.wrapping_add(self.len).addr();
        let (first, last) = (input.as_ptr_range().start, input.as_ptr_range().end);
        let either_is_empty = input.is_empty() || self.is_empty();
        !either_is_empty && self.start.addr() < last.addr() && first.addr() < end
    }

    /// Its first `len` values.
    ///
    /// # Panics
    /// Where there are fewer.
    pub fn first(self, len: usize) -> Output<'a, T> {
        assert!(
            len <= self.len,
            "{len} values do not fit in room for {}",
            self.len
        );
        Output { len, ..self }
    }

    /// Writes these values.
    ///
    /// # Panics
    /// Where their number is not its length.
    pub fn copy_from(self, values: &[T]) {
        assert_eq!(values.len(), self.len, "values for this room");
        // SAFETY: `new` promises memory of that length, which no slice of ours shares.
        unsafe { std::ptr::copy_nonoverlapping(values.as_ptr(), self.start, self.len) };
    }

    /// Writes one value after another, as many as there are or fit.
    pub fn write(mut self, values: impl Iterator<Item = T>) {
        // SAFETY: values are written, and nothing is read.
        for (cell, value) in unsafe { self.cells() }.iter_mut().zip(values) {
            cell.write(value);
        }
    }

    /// Writes one row of `N` after another, as many as there are or fit.
    pub fn write_rows<const N: usize>(mut self, rows: impl Iterator<Item = [T; N]>) {
        // SAFETY: values are written, and nothing is read.
        let cells = unsafe { self.cells() }.as_chunks_mut::<N>().0;
        for (cells, row) in cells.iter_mut().zip(rows) {
            *cells = row.map(MaybeUninit::new);
        }
    }

    /// Writes `value` everywhere; then it is a list as any other.
    pub fn filled(mut self, value: T) -> &'a mut [T] {
        // SAFETY: values are written, and nothing is read.
        unsafe { self.cells() }.fill(MaybeUninit::new(value));
        // SAFETY: every element has just been written; `new` promises the memory for `'a`, and `self` has ended.
        unsafe { std::slice::from_raw_parts_mut(self.start, self.len) }
    }

    /// What the caller wants written.
    ///
    /// # Safety
    /// Nothing is made uninitialised: the memory may be a `&mut [T]` of the caller.
    unsafe fn cells(&mut self) -> &mut [MaybeUninit<T>] {
        // SAFETY: `new` promises aligned memory of that length, and a `MaybeUninit` asks for no more.
        unsafe { std::slice::from_raw_parts_mut(self.start.cast(), self.len) }
    }
}

impl<'a, T: Copy> From<&'a mut [T]> for Output<'a, T> {
    fn from(list: &'a mut [T]) -> Self {
        // SAFETY: the list is borrowed for `'a`.
        unsafe { Output::new(list.as_mut_ptr(), list.len()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Room that nothing has been written to; Miri would tell of a read.
    fn unwritten(cells: &mut [MaybeUninit<f32>]) -> Output<'_, f32> {
        // SAFETY: the cells are borrowed for the lifetime of what is given back.
        unsafe { Output::new(cells.as_mut_ptr().cast(), cells.len()) }
    }

    #[test]
    fn fills_memory_that_nothing_was_written_to() {
        let mut cells = [MaybeUninit::uninit(); 6];
        let list = unwritten(&mut cells).filled(2.0);
        assert_eq!(list, [2.0; 6]);
        list[5] = 1.0;
        Output::from(&mut *list).first(2).copy_from(&[7.0, 8.0]);
        assert_eq!(list, [7.0, 8.0, 2.0, 2.0, 2.0, 1.0]);
        Output::from(&mut *list).write_rows([[3.0, 4.0, 5.0]].into_iter());
        Output::from(&mut *list).write([9.0].into_iter());
        assert_eq!(list, [9.0, 4.0, 5.0, 2.0, 2.0, 1.0]);

        let mut cells = [MaybeUninit::uninit(); 2];
        unwritten(&mut cells).copy_from(&[1.0, -1.0]);
        // SAFETY: both have been written.
        assert_eq!(cells.map(|cell| unsafe { cell.assume_init() }), [1.0, -1.0]);
    }

    #[test]
    #[should_panic(expected = "do not fit")]
    fn does_not_grow() {
        let _ = Output::from(&mut [0.0f32; 2][..]).first(3);
    }

    /// Inputs may be any type; what only touches is apart, and an empty one shares nothing.
    #[test]
    fn knows_which_inputs_share_its_memory() {
        let mut memory = [0.0f32; 8];
        let (start, all) = (memory.as_mut_ptr(), memory.as_slice());
        // SAFETY: nothing is written; the addresses alone are compared.
        let out = unsafe { Output::new(start.wrapping_add(2), 3) };
        assert!(!out.overlaps(&all[..2]) && !out.overlaps(&all[5..]));
        assert!(out.overlaps(&all[1..3]) && out.overlaps(&all[4..]) && out.overlaps(all));
        assert!(!out.overlaps(&all[3..3]));
        assert!(!out.overlaps(&[0u32; 4]));
    }
}
