//! A process that is a host: opens libupt, a bundle, steps it, and says what it has mapped and how long it took.

use std::collections::BTreeSet;
use std::ffi::{CString, c_char, c_void};
use std::path::Path;
use std::ptr::{null, null_mut};
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use libloading::{Library, Symbol};
use serde::{Deserialize, Serialize};

/// What was seen. The lists hold what was not mapped before.
#[derive(Serialize, Deserialize)]
pub struct Probe {
    pub with_library: BTreeSet<String>,
    pub with_model: BTreeSet<String>,
    pub with_steps: BTreeSet<String>,
    pub open_ms: f64,
    /// Median of a step in contact.
    pub step_us: f64,
}

const STEPS: usize = 300;
const DOMAIN_NODES: i32 = 1;

type Handle = *mut c_void;
type ModelOpen = unsafe extern "C" fn(*const c_char, *const c_void, *mut Handle) -> i32;
type ModelIndices = unsafe extern "C" fn(Handle, i32, *mut u32, u64, *mut u64) -> i32;
type SceneCreate = unsafe extern "C" fn(Handle, *const c_void, *mut Handle) -> i32;
type StepContacts = unsafe extern "C" fn(Handle, *const u32, *const f32, u64, *mut f32, u64) -> i32;

pub fn probe(library: &Path, bundle: &Path) -> Result<Probe> {
    let before = mapped()?;
    // SAFETY: the library is libupt, just built; its initialisers only set up Rust's runtime.
    let upt = unsafe { Library::new(library) }
        .with_context(|| format!("cannot open {}", library.display()))?;
    let with_library = mapped()?;
    // SAFETY: the types are those of include/upt.h.
    let (open, indices, create, step): (
        Symbol<ModelOpen>,
        Symbol<ModelIndices>,
        Symbol<SceneCreate>,
        Symbol<StepContacts>,
    ) = unsafe {
        (
            upt.get(b"upt_model_open")?,
            upt.get(b"upt_model_indices")?,
            upt.get(b"upt_scene_create")?,
            upt.get(b"upt_scene_step_contacts")?,
        )
    };
    let path = CString::new(bundle.to_string_lossy().as_bytes())?;
    let (mut model, mut scene) = (null_mut(), null_mut());
    let start = Instant::now();
    // SAFETY: a NUL-terminated path, default options, a place for the handle.
    let status = unsafe { open(path.as_ptr(), null(), &mut model) };
    let open_ms = start.elapsed().as_secs_f64() * 1e3;
    ensure!(
        status == 0,
        "upt_model_open gave {status} for {}",
        bundle.display()
    );
    let with_model = mapped()?;
    let mut nodes = vec![0u32; 1 << 20];
    let mut count = 0;
    // SAFETY: `nodes` has as many places as is said; the handles are live.
    unsafe {
        let capacity = nodes.len() as u64;
        let status = indices(
            model,
            DOMAIN_NODES,
            nodes.as_mut_ptr(),
            capacity,
            &mut count,
        );
        ensure!(status == 0, "upt_model_indices gave {status}");
        let status = create(model, null(), &mut scene);
        ensure!(status == 0, "upt_scene_create gave {status}");
    }
    let middle = count as usize / 2;
    let touched = &nodes[middle..(middle + 12).min(count as usize)];
    let mut times = Vec::with_capacity(STEPS);
    for index in 0..STEPS {
        let depth = 2.0 + (index % 20) as f32 * 0.05;
        let vectors = [0.0, 0.0, -depth].repeat(touched.len());
        let start = Instant::now();
        // SAFETY: as many nodes and vectors as is said; no output is asked for.
        let status = unsafe {
            step(
                scene,
                touched.as_ptr(),
                vectors.as_ptr(),
                touched.len() as u64,
                null_mut(),
                0,
            )
        };
        times.push(start.elapsed().as_secs_f64() * 1e6);
        ensure!(
            status == 0,
            "upt_scene_step_contacts gave {status} at step {index}"
        );
    }
    let with_steps = mapped()?;
    times.sort_by(f64::total_cmp);
    let new = |after: &BTreeSet<String>, before: &BTreeSet<String>| -> BTreeSet<String> {
        after.difference(before).cloned().collect()
    };
    let found = Probe {
        with_library: new(&with_library, &before),
        with_model: new(&with_model, &with_library),
        with_steps: new(&with_steps, &with_model),
        open_ms,
        step_us: times[STEPS / 2],
    };
    // The process ends now; the library stays open until then.
    std::mem::forget(upt);
    Ok(found)
}

/// File names of the shared libraries in this process.
fn mapped() -> Result<BTreeSet<String>> {
    let maps = std::fs::read_to_string("/proc/self/maps")?;
    Ok(maps
        .lines()
        .filter_map(|line| line.split_whitespace().nth(5)?.rsplit('/').next())
        .filter(|name| name.contains(".so"))
        .map(str::to_owned)
        .collect())
}
