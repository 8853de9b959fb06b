//! The stack that calls need, as docs/reference/abi.md states it: a thread with that much makes them.
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "a host in a test: every call keeps to the header, or breaks it on purpose"
)]

use std::sync::Mutex;

use fixture::host::{self, Host};
use upt::ffi::*;

/// Of a step; the thread itself has some of it.
const STEP: usize = 64 << 10;
/// Of opening a model, making a scene and attaching points.
const OPEN: usize = 256 << 10;

fn on_a_stack_of<T: Send>(bytes: usize, work: impl FnOnce() -> T + Send) -> T {
    std::thread::scope(|scope| {
        let builder = std::thread::Builder::new().stack_size(bytes);
        builder.spawn_scoped(scope, work).unwrap().join().unwrap()
    })
}

struct Shared(Host);
// SAFETY: handles are numbers.
unsafe impl Send for Shared {}

/// Verifies REQ-017.
#[test]
fn calls_stay_within_the_stated_stack() {
    let brain = fixture::shipped("brain-coarse");
    for bundle in fixture::BUNDLES
        .map(fixture::path)
        .into_iter()
        .chain([brain])
    {
        for kernel in [UPT_KERNEL_NATIVE, UPT_KERNEL_ONNX] {
            let shared = on_a_stack_of(OPEN, || {
                let host = Host::new(&bundle, |options| {
                    options.kernel = kernel;
                    options.check_inversion = 1;
                });
                let first = host::indices(host.model, UPT_SET_DOMAIN_NODES)[0] as usize;
                let mut positions = vec![0.0f32; 3 * host.nodes];
                let count = positions.len() as u64;
                unsafe {
                    let read = upt_model_read_positions(host.model, positions.as_mut_ptr(), count);
                    assert_eq!(read, UPT_OK);
                    let place = positions[3 * first..].as_ptr();
                    assert_eq!(upt_scene_attach_points(host.scene, place, 1), UPT_OK);
                }
                Mutex::new(Shared(host))
            });
            on_a_stack_of(STEP, || {
                let host = &shared.lock().unwrap().0;
                let domain = host::indices(host.model, UPT_SET_DOMAIN_NODES);
                for step in 0..6 {
                    let count = if step > 3 { 0 } else { 4 };
                    let status = host.step(&domain[..count], [0.0, 0.0, -0.2 * step as f32]);
                    assert!(
                        matches!(status, UPT_OK | UPT_ERR_GUARD),
                        "{}",
                        host::message()
                    );
                    let mut out = vec![0.0f32; 3 * host.nodes];
                    let floats = out.len() as u64;
                    let read = unsafe {
                        upt_scene_read(host.scene, std::ptr::null(), out.as_mut_ptr(), floats)
                    };
                    assert_eq!(read, UPT_OK);
                }
            });
        }
    }
}

/// Tools that press, leap and lie deep, whose steps take the longest ways through the code, and frames after them.
#[cfg(feature = "instruments")]
#[test]
fn steps_with_tools_stay_within_the_stated_stack() {
    use upt::{Contact, Model, ModelOptions, Scene, SceneOptions, Shape, Tool, Vector, View};

    fixture::find_runtime();
    let brain = fixture::shipped("brain-coarse-reduced");
    let scene = on_a_stack_of(OPEN, || {
        let model = Model::open(&brain, &ModelOptions::default()).unwrap();
        let options = SceneOptions {
            guard_policy: upt::GuardPolicy::Report,
            ..SceneOptions::default()
        };
        Scene::new(model, &options).unwrap()
    });
    let mesh = scene.mesh();
    let place = |node: u32| Vector::from_slice(&mesh.positions[3 * node as usize..][..3]);
    let corners = mesh.domain.faces.as_chunks::<3>().0[0].map(place);
    let [a, b, c] = corners;
    let out = (b - a).cross(c - a).normalize();
    let mut flags = 0;
    for (depth, aside) in [
        (0.0, 0.0),
        (3.0, 0.0),
        (6.0, 0.0),
        (25.0, 0.0),
        (25.0, 20.0),
        (3.0, 0.0),
    ] {
        flags |= on_a_stack_of(STEP, || {
            let at = a + out * (5.0 - depth) + (b - a).normalize() * aside;
            let shape = Shape::Sphere { radius: 5.0 };
            let tool = Tool::new(&shape, at.to_array(), [0.0, 0.0, 0.0, 1.0]).unwrap();
            let tools = std::slice::from_ref(&tool);
            scene.step(Contact::Tools(tools), None).unwrap();
            let mut u = vec![0.0; 3 * scene.node_count()];
            scene
                .present(Contact::Tools(tools), 0.01, View::Region, &mut u)
                .unwrap();
            scene.stats().flags
        });
    }
    assert_ne!(
        flags & UPT_FLAG_FELL_BACK,
        0,
        "no step took the longest way"
    );
}
