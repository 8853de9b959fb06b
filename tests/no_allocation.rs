//! A step in steady state makes no heap allocation through Rust's allocator, and leaves the host's floating-point
//! mode as it was.

mod fixture;

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

use fixture::{BUNDLES, model, plain, push, rollout, scene, sparse};
use upt::kernels::Isa;
use upt::kernels::flush::read_mode;
use upt::{Contact, DecoderKernel, IndexSet, SceneOptions, StepInput, StepPath};

struct Counting;

static ALLOCATIONS: AtomicUsize = AtomicUsize::new(0);

// SAFETY: passes every call on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// One test, so that no other test's allocations are counted.
#[test]
fn steps_allocate_nothing_and_keep_the_floating_point_mode() {
    if Isa::detect() == Isa::Scalar {
        // The readable reference of the kernels makes lists for what the others keep in registers.
        return;
    }
    for name in BUNDLES {
        for (kernel, step_path) in [
            (DecoderKernel::Native, StepPath::Split),
            (DecoderKernel::Onnx, StepPath::Split),
            (DecoderKernel::Resident, StepPath::Split),
            (DecoderKernel::Native, StepPath::Whole),
        ] {
            if !name.contains("upt") && step_path == StepPath::Whole {
                continue;
            }
            for threads in [1, 2] {
                let model = model(name);
                let options = SceneOptions {
                    threads,
                    kernel,
                    step_path,
                    ..plain()
                };
                let scene = scene(&model, &options);
                let points = [10.0, 10.0, 10.0, 20.0, 5.0, 5.0];
                scene.attach_points(Some(&points)).unwrap();
                scene
                    .set_region(Some(model.indices(IndexSet::SurfaceNodes)))
                    .unwrap();
                rollout(&scene, 20);
                let pushes: Vec<_> = (0..20).map(|t| push(&model, t)).collect();
                let mut dense = vec![0.0; 3 * scene.node_count()];
                for (&node, c) in pushes[2].0.iter().zip(pushes[2].1.chunks_exact(3)) {
                    dense[3 * node as usize..3 * node as usize + 3].copy_from_slice(c);
                }
                let given = vec![0.25; dense.len()];
                let mut out = vec![0.0; 3 * scene.region_count()];
                let mut at_points = vec![0.0; 6];
                let mut forces = vec![0.0; pushes.iter().map(|push| push.1.len()).max().unwrap()];
                let mode = read_mode();
                let mut turn = || {
                    let before = ALLOCATIONS.load(Ordering::Relaxed);
                    for contact in &pushes {
                        scene.step(sparse(contact), Some(&mut out)).unwrap();
                        scene.sample(0.3, &mut out).unwrap();
                        scene.read_points(&mut at_points).unwrap();
                        if scene.stats().prior_forces {
                            let forces = &mut forces[..contact.1.len()];
                            scene.contact_force(forces).unwrap();
                        }
                    }
                    let inputs = StepInput {
                        displacement: Some(&given),
                        contact: Contact::Dense(&dense),
                    };
                    scene.step(inputs, Some(&mut out)).unwrap();
                    ALLOCATIONS.load(Ordering::Relaxed) - before
                };
                // A thread that was started before may begin, and allocate what a thread needs, in the middle of a turn.
                let count = (0..5).map(|_| turn()).min().unwrap();
                assert_eq!(
                    count, 0,
                    "{name} {kernel:?} {step_path:?} {threads} threads"
                );
                assert_eq!(read_mode(), mode, "the host's floating-point mode");
            }
        }
    }
}
