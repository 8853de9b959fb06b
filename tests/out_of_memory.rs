//! No memory is a status. An allocator that refuses one request after another, wherever a call makes it: every one of a size that a
//! host or a bundle decides gives `UPT_ERR_OUT_OF_MEMORY`, changes nothing, and the same call works when there is memory again.
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "a host in a test: every call keeps to the header, or breaks it on purpose"
)]

mod fixture;
mod host;

use std::alloc::{GlobalAlloc, Layout, System};
use std::path::{Path, PathBuf};
use std::ptr::{null, null_mut};
use std::sync::atomic::{AtomicBool, AtomicIsize, AtomicUsize, Ordering};

use upt::ffi::*;

/// Smaller requests are texts and the like; the meshes here have 210 and 3,000 nodes.
const SCENE: usize = 4096;
/// Smaller requests of opening are the search structures that docs/reference/abi.md leaves out.
const OPEN: usize = 1 << 20;

struct Refusing;

/// Least bytes of a request that may be refused.
static LEAST: AtomicUsize = AtomicUsize::new(SCENE);
/// Requests of that size until one is refused; negative: none is.
static LEFT: AtomicIsize = AtomicIsize::new(-1);
static REFUSED: AtomicBool = AtomicBool::new(false);

fn refuses(size: usize) -> bool {
    if size < LEAST.load(Ordering::Relaxed) || LEFT.load(Ordering::Relaxed) < 0 {
        return false;
    }
    let refused = LEFT.fetch_sub(1, Ordering::Relaxed) == 0;
    if refused {
        REFUSED.store(true, Ordering::Relaxed);
        if std::env::var_os("UPT_TEST_BACKTRACE").is_some() {
            eprintln!(
                "{size} bytes refused:\n{}",
                std::backtrace::Backtrace::force_capture()
            );
        }
    }
    refused
}

// SAFETY: passes what it does not refuse on to the system's allocator.
unsafe impl GlobalAlloc for Refusing {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if refuses(layout.size()) {
            return null_mut();
        }
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        if refuses(size) {
            return null_mut();
        }
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Refusing = Refusing;

/// Makes a call again and again, the first, the second, ... of its requests refused, until it needs no more. Returns how many
/// were refused.
fn starve(what: &str, mut call: impl FnMut() -> i32) -> usize {
    for at in 0.. {
        REFUSED.store(false, Ordering::Relaxed);
        LEFT.store(at as isize, Ordering::Relaxed);
        let status = call();
        LEFT.store(-1, Ordering::Relaxed);
        if !REFUSED.load(Ordering::Relaxed) {
            assert_eq!(status, UPT_OK, "{what}: {}", host::message());
            return at;
        }
        assert_eq!(
            status,
            UPT_ERR_OUT_OF_MEMORY,
            "{what}, request {at}: {}",
            host::message()
        );
    }
    unreachable!("every call ends")
}

fn brain(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("onnx")
        .join(name)
}

/// One test: the allocator is the process's.
#[test]
fn no_memory_is_a_status_wherever_it_is_missing() {
    fixture::find_runtime();
    for name in ["brain-fast", "brain-reduced"] {
        let path = std::ffi::CString::new(brain(name).to_str().unwrap()).unwrap();
        let mut model = null_mut();
        LEAST.store(OPEN, Ordering::Relaxed);
        let opened = starve("upt_model_open", || unsafe {
            upt_model_open(path.as_ptr(), null(), &mut model)
        });
        LEAST.store(SCENE, Ordering::Relaxed);
        println!("{name}: refused {opened} requests of opening");
        assert!(opened > 5, "{name}: a model has tables");
        assert_eq!(unsafe { upt_model_close(model) }, UPT_OK);
    }
    let bundles = ["tiny-upt-prior", "tiny-reduced"].map(fixture::path);
    for path in bundles
        .into_iter()
        .chain(["brain-coarse", "brain-coarse-reduced"].map(brain))
    {
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        let model = host::open(&path);
        let mut options = host::scene_options();
        (options.guard_policy, options.check_inversion) = (UPT_GUARD_REPORT, 1);
        options.cubic_sampling = 1;
        let mut scene = null_mut();
        // What the model keeps for all scenes is made with the first one, as opening makes it.
        LEAST.store(OPEN, Ordering::Relaxed);
        starve("the first upt_scene_create", || unsafe {
            upt_scene_create(model, &options, &mut scene)
        });
        LEAST.store(SCENE, Ordering::Relaxed);
        assert_eq!(unsafe { upt_scene_destroy(scene) }, UPT_OK);
        let created = starve("upt_scene_create", || unsafe {
            upt_scene_create(model, &options, &mut scene)
        });
        assert!(created > 0, "{name}: a scene has states");
        let count = host::node_count(model);
        let domain = host::indices(model, UPT_SET_DOMAIN_NODES);
        let mut positions = vec![0.0f32; 3 * count];
        let floats = positions.len() as u64;
        let read = unsafe { upt_model_positions(model, positions.as_mut_ptr(), floats) };
        assert_eq!(read, UPT_OK);

        // More nodes than the contact solve has room for from the start.
        let many = &domain[..domain.len().min(400)];
        let push = [0.0f32, 0.0, -0.5].repeat(many.len());
        let (nodes, vectors, length) = (many.as_ptr(), push.as_ptr(), many.len() as u64);
        let step = |scene| unsafe {
            upt_scene_step_contacts(scene, nodes, vectors, length, null_mut(), 0)
        };
        starve("upt_scene_step_contacts", || step(scene));
        starve("upt_scene_submit", || unsafe {
            upt_scene_submit(scene, nodes, vectors, length)
        });
        assert_eq!(unsafe { upt_scene_wait(scene, u32::MAX) }, UPT_OK);
        // The output lies over the inputs, which are copied.
        let mut field = vec![0.0f32; 3 * count];
        let over = field.as_mut_ptr();
        starve("upt_scene_step", || unsafe {
            upt_scene_step(scene, over, null(), over, floats)
        });

        let attached = starve("upt_scene_attach_points", || unsafe {
            upt_scene_attach_points(scene, positions.as_ptr(), count as u64)
        });
        assert!(attached > 0, "{name}: points have places");
        starve("upt_scene_set_region", || unsafe {
            upt_scene_set_region(scene, domain.as_ptr(), domain.len() as u64)
        });
        assert_eq!(step(scene), UPT_OK);
        let mut out = vec![0.0f32; 3 * many.len()];
        starve("upt_scene_decode", || unsafe {
            upt_scene_decode(scene, nodes, length, out.as_mut_ptr(), out.len() as u64)
        });
        let mut needed = 0;
        starve("upt_scene_save", || unsafe {
            upt_scene_save(scene, null_mut(), 0, &mut needed)
        });
        let mut snapshot = vec![0u8; needed as usize];
        let saved = unsafe { upt_scene_save(scene, snapshot.as_mut_ptr(), needed, null_mut()) };
        assert_eq!(saved, UPT_OK);
        starve("upt_scene_restore", || unsafe {
            upt_scene_restore(scene, snapshot.as_ptr(), needed)
        });
        let mut again = vec![0u8; needed as usize];
        let saved = unsafe { upt_scene_save(scene, again.as_mut_ptr(), needed, null_mut()) };
        assert!(
            saved == UPT_OK && again == snapshot,
            "{name}: refused calls changed the state"
        );
        println!("{name}: refused {created} requests of a scene, {attached} of points");
        assert_eq!(unsafe { upt_scene_destroy(scene) }, UPT_OK);
        assert_eq!(unsafe { upt_model_close(model) }, UPT_OK);
    }
}
