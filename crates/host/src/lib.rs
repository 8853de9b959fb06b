//! The library as a host sees it: the functions of `upt.h`, called through their C signatures.
//!
//! What is measured here is what a C or C# program gets. One row of `cargo xtask study report` reaches behind the ABI, since no host can ask
//! for it: a bundle's linear response alone (`report/prior_alone.rs`).

mod cuts;
mod effort;
mod hand;
mod instrument;
mod scene;

pub use cuts::SurfaceNews;
pub use hand::Hand;
pub use instrument::{Hull, instrument};
pub use scene::Scene;

pub use effort::Effort;
use std::ffi::{CStr, CString};
use std::path::Path;

use anyhow::{Context, Result, bail};
use upt::ffi;

/// How a model is opened.
#[derive(Clone, Debug)]
pub struct ModelSettings {
    pub threads: u32,
    /// `UPT_PROVIDER_*`.
    pub provider: i32,
    /// `UPT_PRECISION_*`.
    pub precision: i32,
    /// Fail rather than take another provider.
    pub exact: bool,
    /// Corrections a step; none: as many as the bundle recommends.
    pub corrections: Option<Effort>,
    /// Length of its scenes' steps, s; 0: the bundle's.
    pub step_s: f64,
    /// Damping of its scenes' tissue, 1/s; 0: the bundle's.
    pub damping_per_s: f64,
}

impl Default for ModelSettings {
    fn default() -> Self {
        Self {
            threads: 1,
            provider: ffi::UPT_PROVIDER_CPU,
            precision: ffi::UPT_PRECISION_F32,
            exact: false,
            corrections: None,
            step_s: 0.0,
            damping_per_s: 0.0,
        }
    }
}

/// An open model; closed when dropped.
pub struct Model {
    corrections: Option<Effort>,
    /// No correction of a step starts later than this, µs; 0: no budget.
    correction_budget_us: u32,
    step_s: f64,
    damping_per_s: f64,
    handle: *mut ffi::upt_model,
    info: ffi::upt_model_info,
}

// SAFETY: the ABI promises that a model may be used from any thread at once; the handle is a number.
unsafe impl Send for Model {}
// SAFETY: as above.
unsafe impl Sync for Model {}

fn size<T>() -> u32 {
    std::mem::size_of::<T>() as u32
}

/// A struct of the ABI whose fields are integers, floats and nullable pointers, all zero.
///
/// SAFETY: the caller names a `repr(C)` struct for which all-zero bytes are a value: the ABI's
/// documented default of every options struct.
unsafe fn zeroed<T>() -> T {
    // SAFETY: the caller's.
    unsafe { std::mem::MaybeUninit::zeroed().assume_init() }
}

/// An error that says what the library said; its message names the call.
fn check(status: i32) -> Result<()> {
    if status >= 0 {
        return Ok(());
    }
    // SAFETY: both return NUL-terminated text that is valid until this thread's next call.
    let (name, message) = unsafe {
        (
            CStr::from_ptr(ffi::upt_status_name(status)),
            CStr::from_ptr(ffi::upt_last_error()),
        )
    };
    let text = format!("{} ({})", message.to_string_lossy(), name.to_string_lossy());
    if status == ffi::UPT_ERR_RUNTIME {
        return Err(NoRuntime(text).into());
    }
    bail!(text)
}

/// ONNX Runtime is missing, too old or broken.
#[derive(Debug)]
pub struct NoRuntime(String);

impl std::fmt::Display for NoRuntime {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.write_str(&self.0)
    }
}

impl std::error::Error for NoRuntime {}

impl Model {
    /// `upt_model_create`.
    pub fn open(path: &Path, settings: &ModelSettings) -> Result<Self> {
        let text = path
            .to_str()
            .with_context(|| format!("{}: the path is not UTF-8", path.display()))?;
        let text = CString::new(text)?;
        let providers = [settings.provider];
        // SAFETY: options and path live across the call; `handle` and `info` are places to write to.
        unsafe {
            let mut options: ffi::upt_model_options = zeroed();
            options.struct_size = size::<ffi::upt_model_options>();
            options.threads = settings.threads;
            options.providers = providers.as_ptr();
            options.provider_count = 1;
            options.precision = settings.precision;
            if settings.exact {
                options.fallback = ffi::UPT_SWITCH_OFF;
            }
            let mut handle = std::ptr::null_mut();
            check(ffi::upt_model_create(text.as_ptr(), &options, &mut handle))?;
            let mut info: ffi::upt_model_info = zeroed();
            info.struct_size = size::<ffi::upt_model_info>();
            let mut model = Self {
                corrections: settings.corrections,
                correction_budget_us: 0,
                step_s: settings.step_s,
                damping_per_s: settings.damping_per_s,
                handle,
                info,
            };
            check(ffi::upt_model_read_info(handle, &mut model.info))?;
            Ok(model)
        }
    }

    /// Length of its scenes' steps, s.
    pub fn step_s(&self) -> f64 {
        match self.step_s {
            0.0 => self.info.dt.into(),
            own => own,
        }
    }

    pub fn info(&self) -> &ffi::upt_model_info {
        &self.info
    }

    /// The same; its scenes' steps have the length that the bundle recommends for frames.
    pub fn for_frames(mut self) -> Self {
        self.step_s = self.info.frame_step_s;
        self
    }

    /// The same; no correction of a step starts later than after this part of the step's length, so that steps keep up with the clock.
    pub fn in_real_time(mut self, part: f64) -> Self {
        self.correction_budget_us = (1e6 * part * self.step_s()) as u32;
        self
    }

    /// `upt_model_read_indices` of a `UPT_SET_*`.
    pub fn indices(&self, set: i32) -> Result<Vec<u32>> {
        let mut needed = 0;
        // SAFETY: a NULL buffer of capacity 0 asks for the count; the second call has that capacity.
        unsafe {
            ffi::upt_model_read_indices(self.handle, set, std::ptr::null_mut(), 0, &mut needed);
            let mut out = vec![0u32; needed as usize];
            check(ffi::upt_model_read_indices(
                self.handle,
                set,
                out.as_mut_ptr(),
                needed,
                &mut needed,
            ))?;
            Ok(out)
        }
    }

    /// `upt_model_read_positions`: rest positions, mm.
    pub fn positions(&self) -> Result<Vec<[f32; 3]>> {
        let mut out = vec![[0.0; 3]; self.info.node_count as usize];
        // SAFETY: pointer and count describe `out`.
        check(unsafe {
            ffi::upt_model_read_positions(
                self.handle,
                out.as_mut_ptr().cast(),
                3 * out.len() as u64,
            )
        })?;
        Ok(out)
    }
}

impl Drop for Model {
    fn drop(&mut self) {
        // SAFETY: the handle came from upt_model_create and is closed once.
        unsafe { ffi::upt_model_destroy(self.handle) };
    }
}
