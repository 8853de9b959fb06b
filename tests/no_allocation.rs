//! A step in steady state makes no heap allocation through Rust's allocator, and leaves the host's floating-point
//! mode as it was.
#![cfg(feature = "instruments")]
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "a host in a test: every call keeps to the header, or breaks it on purpose"
)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

use fixture::{BUNDLES, model, plain, push, rollout, scene, sparse};
use upt::kernels::Isa;
use upt::kernels::flush::read_mode;
use upt::{Contact, DecoderKernel, IndexSet, SceneOptions, StepInput, StepPath, View};

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

/// A ball that presses, slides and lifts, again and again.
fn tools_allocate_nothing() {
    let branches = serde_json::json!([{"share": 0.4, "tau_s": 0.1}]);
    let (_folder, relaxing) = fixture::relaxing(branches, 1.0);
    let both = ["tiny-reduced", "tiny-corrected"].map(|name| (name, model(name)));
    for (name, model) in both.into_iter().chain([("relaxing", relaxing)]) {
        let scene = scene(&model, &plain());
        let node = model.indices(IndexSet::DomainNodes)[0] as usize;
        let at: Vec<f32> = model.positions()[3 * node..3 * node + 3].to_vec();
        let shape = contact::Shape::Sphere { radius: 3.0 };
        let programme: Vec<Vec<upt::contact::Tool>> = (0..20)
            .map(|t| {
                let depth = 0.2 * (t as f32).min(6.0) - 3.0 * (t as f32 - 14.0).max(0.0);
                let centre = [at[0] + 0.1 * t as f32, at[1], at[2] + 3.0 - depth];
                let tool = upt::contact::Tool::new(&shape, centre, [0.0, 0.0, 0.0, 1.0]);
                vec![tool.unwrap()]
            })
            .collect();
        let mut out = vec![0.0; 3 * scene.node_count()];
        let mut touched = false;
        let mut turn = || {
            let before = ALLOCATIONS.load(Ordering::Relaxed);
            for tools in &programme {
                scene.step(Contact::Tools(tools), Some(&mut out)).unwrap();
                touched |= scene.with_contact_report(|report| report.readings[0].contacts > 0);
            }
            ALLOCATIONS.load(Ordering::Relaxed) - before
        };
        turn();
        let count = (0..5).map(|_| turn()).min().unwrap();
        assert!(touched, "{name}: the tool touches");
        assert_eq!(count, 0, "{name} driven by a tool");
    }
}

/// A ball presses while gravity turns, the surface is under pressure, the support and one of its groups move, and ties are drawn taut, slack and broken.
fn loads_allocate_nothing() {
    let folder = fixture::with_groups("tiny-corrected");
    let model = upt::Model::open(folder.path(), &upt::ModelOptions::default()).unwrap();
    let scene = scene(&model, &plain());
    let node = model.indices(IndexSet::DomainNodes)[0] as usize;
    let at: Vec<f32> = model.positions()[3 * node..3 * node + 3].to_vec();
    let shape = contact::Shape::Sphere { radius: 3.0 };
    let mut forces = vec![0.0; 3 * scene.node_count()];
    forces[3 * node] = 5.0;
    let domain = model.indices(IndexSet::DomainNodes);
    let from = upt::Vector::from_slice(&at);
    let tie = |node: u32, break_mn: f32| upt::Tie {
        point: upt::TiePoint {
            nodes: [node; 3],
            weights: [1.0, 0.0, 0.0],
        },
        end: upt::TieEnd::World(from + upt::Vector::Z),
        spring: upt::Spring {
            stiffness: 10.0,
            slack_mm: 1.0,
            ..upt::Spring::default()
        },
        break_mn,
    };
    let ties = [
        tie(node as u32, 0.0),
        tie(domain[1], 2.0),
        tie(domain[2], 0.0),
    ];
    let mut shown = forces.clone();
    let mut turn = || {
        let before = ALLOCATIONS.load(Ordering::Relaxed);
        for t in 0..20 {
            let wave = (0.314 * t as f32).sin();
            let centre = [at[0], at[1], at[2] + 3.0 - 0.5 * wave];
            let tool = upt::contact::Tool::new(&shape, centre, [0.0, 0.0, 0.0, 1.0]).unwrap();
            let pressures = [
                upt::Pressure {
                    nodes: &[],
                    pascal: 10.0 * wave,
                },
                upt::Pressure {
                    nodes: domain,
                    pascal: -4.0,
                },
            ];
            let groups = [upt::GroupMotion {
                group: 1,
                pose: Some(upt::SupportPose {
                    position: [0.0, 0.1 * wave, 0.2 * wave],
                    rotation: [0.0, 0.0, 0.0, 1.0],
                }),
                ..upt::GroupMotion::default()
            }];
            let loads = upt::Loads {
                gravity: [wave, 0.0, -1.0],
                forces: Some(&forces),
                point_forces: &[upt::PointForce {
                    nodes: [node as u32; 4],
                    force: [0.0, wave, 0.0],
                    ..upt::PointForce::default()
                }],
                pressures: &pressures,
                support: Some(upt::SupportPose {
                    position: [0.0, 0.0, 2.0 * wave],
                    rotation: [0.0, 0.0, 0.0, 1.0],
                }),
                ties: &ties[..if t % 5 == 0 { 0 } else { 3 }],
                supports: &groups,
                ..upt::Loads::NONE
            };
            let tools = [tool];
            let input = StepInput {
                contact: match t < 10 {
                    true => Contact::Tools(&tools),
                    false => Contact::Tools(&[]),
                },
                loads,
                ..StepInput::default()
            };
            scene.step(input, None).unwrap();
            scene
                .present(input, 0.01, View::Region, &mut shown)
                .unwrap();
        }
        ALLOCATIONS.load(Ordering::Relaxed) - before
    };
    // What the group moves comes to other samples of contact, and more of them, for some turns.
    (0..4).for_each(|_| _ = turn());
    let count = (0..5).map(|_| turn()).min().unwrap();
    assert_eq!(count, 0, "steps and frames under loads");
}

/// Frames of the region and of attached points between the steps.
fn frames_allocate_nothing() {
    let model = model("tiny-corrected");
    let scene = scene(&model, &plain());
    let node = model.indices(IndexSet::DomainNodes)[0] as usize;
    let at: Vec<f32> = model.positions()[3 * node..3 * node + 3].to_vec();
    let shape = contact::Shape::Sphere { radius: 3.0 };
    let tool = |depth: f32| {
        let centre = [at[0], at[1], at[2] + 3.0 - depth];
        [upt::contact::Tool::new(&shape, centre, [0.0, 0.0, 0.0, 1.0]).unwrap()]
    };
    let depths = [0.5, 0.8, 1.1, 0.8].map(|depth| [tool(depth), tool(depth + 0.1)]);
    scene.attach_points(Some(&model.positions()[..9])).unwrap();
    let (mut out, mut points) = (vec![0.0; 3 * scene.node_count()], [0.0; 9]);
    let mut turn = || {
        let before = ALLOCATIONS.load(Ordering::Relaxed);
        for [now, later] in &depths {
            scene.step(Contact::Tools(now), None).unwrap();
            for part in [0.01, 0.02, 0.03] {
                scene
                    .present(Contact::Tools(later), part, View::Region, &mut out)
                    .unwrap();
                scene
                    .present(Contact::Tools(later), part, View::Points, &mut points)
                    .unwrap();
            }
        }
        ALLOCATIONS.load(Ordering::Relaxed) - before
    };
    turn();
    let count = (0..5).map(|_| turn()).min().unwrap();
    assert_eq!(count, 0, "frames between steps");
}

/// The hand's thread and a scene that a hand feels.
fn haptics_allocate_nothing() {
    use upt::haptics::{HapticOptions, HapticPose};
    let model = model("tiny-corrected");
    let scene = scene(&model, &plain());
    let node = model.indices(IndexSet::DomainNodes)[0] as usize;
    let at: Vec<f32> = model.positions()[3 * node..3 * node + 3].to_vec();
    let shape = contact::Shape::Sphere { radius: 3.0 };
    let tool = |depth: f32| {
        let centre = [at[0], at[1], at[2] + 3.0 - depth];
        upt::contact::Tool::new(&shape, centre, [0.0, 0.0, 0.0, 1.0]).unwrap()
    };
    let tools = [[tool(0.5)], [tool(1.0)]];
    let mut hand = scene.haptics(&HapticOptions::new(0, tool(0.0))).unwrap();
    let (mut time_s, mut touched) = (0.0, false);
    let mut turn = || {
        let before = ALLOCATIONS.load(Ordering::Relaxed);
        for tools in tools.iter().cycle().take(8) {
            scene.step(Contact::Tools(tools), None).unwrap();
            for _ in 0..5 {
                time_s += 1e-3;
                let at = tools[0].pose.translation.to_array();
                let pose = HapticPose {
                    time_s,
                    position_m: at.map(|x| 1e-3 * x),
                    rotation: [0.0, 0.0, 0.0, 1.0],
                    velocity: None,
                };
                touched |= hand.render(&pose).unwrap().contact;
            }
        }
        ALLOCATIONS.load(Ordering::Relaxed) - before
    };
    turn();
    let count = (0..5).map(|_| turn()).min().unwrap();
    assert!(touched, "the tool touches");
    assert_eq!(count, 0, "haptics");
}

/// One test, so that no other test's allocations are counted.
/// Verifies REQ-033.
#[test]
fn steps_allocate_nothing_and_keep_the_floating_point_mode() {
    if Isa::detect() == Isa::Scalar {
        println!("left out: the scalar kernels make lists for what the others keep in registers");
        return;
    }
    tools_allocate_nothing();
    frames_allocate_nothing();
    haptics_allocate_nothing();
    loads_allocate_nothing();
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
                        scene.read_view(upt::View::Points, &mut at_points).unwrap();
                        if scene.stats().prior_forces {
                            let forces = &mut forces[..contact.1.len()];
                            scene.contact_force(forces).unwrap();
                        }
                    }
                    let inputs = StepInput {
                        displacement: Some(&given),
                        contact: Contact::Dense(&dense),
                        ..StepInput::default()
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
