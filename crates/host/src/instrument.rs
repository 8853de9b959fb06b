//! Instruments and the hulls of their shapes.

use anyhow::Result;
use upt::ffi;

use super::{check, size, zeroed};

/// An instrument of the C interface with its size set and zero elsewhere.
pub fn instrument() -> ffi::upt_instrument {
    // SAFETY: zero is a value of every field.
    let mut instrument: ffi::upt_instrument = unsafe { zeroed() };
    instrument.struct_size = size::<ffi::upt_instrument>();
    instrument
}

/// A tool of its own shape; destroyed when dropped.
pub struct Hull {
    handle: *mut ffi::upt_hull,
}

impl Hull {
    /// `upt_hull_create`; without faces the convex hull of the points.
    pub fn create(points: &[[f32; 3]], faces: &[[u32; 3]]) -> Result<Self> {
        let mut handle = std::ptr::null_mut();
        // SAFETY: pointers and counts describe `points` and `faces`; `handle` is a place to write to.
        check(unsafe {
            ffi::upt_hull_create(
                points.as_ptr().cast(),
                points.len() as u64,
                faces.as_ptr().cast(),
                faces.len() as u64,
                &mut handle,
            )
        })?;
        Ok(Self { handle })
    }

    /// What `upt_instrument` holds.
    pub fn handle(&self) -> *const ffi::upt_hull {
        self.handle.cast_const()
    }
}

impl Drop for Hull {
    fn drop(&mut self) {
        // SAFETY: the handle came from upt_hull_create and is destroyed once.
        unsafe { ffi::upt_hull_destroy(self.handle) };
    }
}
