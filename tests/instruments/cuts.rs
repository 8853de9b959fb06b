//! Cuts, removal and stiffness in a scene: what moves, what is kept, what is refused.

use super::*;
use upt::Error;
use upt::ffi::*;

pub(crate) fn liver() -> std::sync::Arc<upt::Model> {
    model(fixture::shipped("liver-coarse"))
}

pub(crate) fn options() -> SceneOptions {
    SceneOptions {
        corrections: Corrections::Fixed(5),
        ..SceneOptions::default()
    }
}

/// A scene of the liver and a tool 4 mm deep in its top, pressed for a few steps.
fn pressed() -> (Scene, Tool) {
    let scene = Scene::new(liver(), &options()).unwrap();
    let tool = pressing(&scene, 4.0, Vector::ZERO);
    for _ in 0..6 {
        step(&scene, std::slice::from_ref(&tool));
    }
    (scene, tool)
}

/// A straight blade 40 mm long, `aside` mm from the site, pushed `depth` mm in along the normal.
pub(crate) fn slit(scene: &Scene, aside: f32, depth: f32) -> [[f32; 3]; 4] {
    let (at, normal) = site(scene);
    let along = normal.any_orthonormal_vector();
    let across = normal.cross(along);
    let point =
        |a: f32, n: f32| (Vector::from(at) + across * aside + along * a + normal * n).to_array();
    [
        point(-20.0, 6.0),
        point(20.0, 6.0),
        point(-20.0, -depth),
        point(20.0, -depth),
    ]
}

/// Verifies REQ-060.
#[test]
fn nothing_moves_at_the_moment_of_a_cut() {
    let (scene, tool) = pressed();
    let tools = std::slice::from_ref(&tool);
    let before = step(&scene, tools);
    let count = scene.node_count();
    let told = (readings(&scene)[0].force, scene.stats().flags);
    let cut = scene.cut(0, 2, &slit(&scene, 6.0, 15.0)).unwrap();
    // What the last step told stays until the next one.
    assert_eq!(told, (readings(&scene)[0].force, scene.stats().flags));
    assert!(size(told.0) > 10.0, "{told:?}");
    assert!(!cut.copied.is_empty() && cut.area_mm2 > 100.0 && cut.removed_mm3.abs() < 1e-3);
    assert_eq!(scene.node_count(), count + cut.copied.len());
    let mut now = vec![0.0; 3 * scene.node_count()];
    scene.read(&mut now).unwrap();
    assert_eq!(bits(&now[..3 * count]), bits(&before));
    for (at, source) in cut.copied.iter().enumerate() {
        let [own, from] = [count + at, *source as usize].map(|node| &now[3 * node..][..3]);
        assert_eq!(own, from);
    }
    // Without the tool it goes home.
    for _ in 0..40 {
        now = step(&scene, &[]);
        assert!(scene.stats().min_det > 0.3);
    }
    assert!(now.iter().all(|u| u.abs() < 0.3));
}

#[test]
fn snapshots_go_across_cuts_and_reset_gives_the_intact_body() {
    let (scene, tool) = pressed();
    let tools = std::slice::from_ref(&tool);
    let whole = scene.save().unwrap();
    let uncut = step(&scene, tools);
    scene.restore(&whole).unwrap();
    scene.cut(0, 2, &slit(&scene, 6.0, 12.0)).unwrap();
    step(&scene, tools);
    let parted = scene.save().unwrap();
    let next = step(&scene, tools);
    scene.cut(1, 2, &slit(&scene, -4.0, 18.0)).unwrap();
    step(&scene, tools);
    scene.restore(&parted).unwrap();
    assert_eq!(scene.save().unwrap(), parted);
    assert_eq!(bits(&step(&scene, tools)), bits(&next));
    scene.restore(&whole).unwrap();
    assert_eq!(bits(&step(&scene, tools)), bits(&uncut));
    // In another scene, with another number of threads.
    let threads = SceneOptions {
        threads: 2,
        ..options()
    };
    let other = Scene::new(liver(), &threads).unwrap();
    other.restore(&parted).unwrap();
    assert_eq!(bits(&step(&other, tools)), bits(&next));
    other.cut(1, 2, &slit(&scene, -4.0, 18.0)).unwrap();
    scene.restore(&parted).unwrap();
    step(&scene, tools);
    scene.cut(1, 2, &slit(&scene, -4.0, 18.0)).unwrap();
    assert_eq!(bits(&step(&other, tools)), bits(&step(&scene, tools)));
    other.reset().unwrap();
    let fresh = Scene::new(liver(), &options()).unwrap();
    assert_eq!(other.node_count(), fresh.node_count());
    assert_eq!(bits(&step(&other, tools)), bits(&step(&fresh, tools)));
}

/// In a body most of which is far, what a blade has not come to stands from cut to cut: a scene that is restored makes all of it anew, with the same bits.
#[test]
fn a_cut_that_grows_steps_as_one_that_is_restored() {
    let brain = model(fixture::shipped("brain-coarse-reduced"));
    let scene = Scene::new(brain.clone(), &options()).unwrap();
    let (at, normal) = site(&scene);
    let along = normal.any_orthonormal_vector();
    let point = |a: f32, n: f32| (Vector::from(at) + along * a + normal * n).to_array();
    let edge = |a: f32| [point(a, 3.0), point(a, -9.0)];
    let ball = pressing(&scene, 2.0, Vector::ZERO);
    let tools = std::slice::from_ref(&ball);
    for piece in 0..6 {
        let from = 3.0 * piece as f32 - 9.0;
        let blade = [edge(from), edge(from + 3.0)].concat();
        scene.cut(1, 2, &blade).unwrap();
        let parted = scene.save().unwrap();
        let other = Scene::new(brain.clone(), &options()).unwrap();
        other.restore(&parted).unwrap();
        for _ in 0..2 {
            let (own, restored) = (step(&scene, tools), step(&other, tools));
            assert_eq!(bits(&own), bits(&restored), "piece {piece}");
        }
    }
}

/// Verifies REQ-060.
#[test]
fn what_cannot_be_cut_stays_as_it_is() {
    let (scene, tool) = pressed();
    let saved = scene.save().unwrap();
    let edge = slit(&scene, 6.0, 10.0);
    let still = [edge[0], edge[1], edge[0], edge[1]];
    assert!(matches!(scene.cut(0, 2, &still), Err(Error::Argument(_))));
    assert!(matches!(scene.cut(0, 0, &[]), Err(Error::Argument(_))));
    assert!(matches!(scene.cut(0, 3, &edge), Err(Error::Argument(_))));
    let lost = [edge[0], [f32::NAN; 3], edge[2], edge[3]];
    assert!(matches!(scene.cut(0, 2, &lost), Err(Error::NonFinite(_))));
    assert!(matches!(
        scene.remove(&tool, f32::NAN),
        Err(Error::NonFinite(_))
    ));
    let all = ball(500.0, [0.0; 3]);
    assert!(matches!(
        scene.remove(&all, f32::MAX),
        Err(Error::Argument(_))
    ));
    assert!(matches!(
        scene.scale_stiffness(&[0], 0.0),
        Err(Error::Argument(_))
    ));
    assert!(matches!(
        scene.scale_stiffness(&[u32::MAX], 2.0),
        Err(Error::Argument(_))
    ));
    assert_eq!(scene.save().unwrap(), saved);
    scene.cut(0, 2, &edge).unwrap();
    let rest = vec![0.0; 3 * scene.mesh().node_count()];
    let given = upt::StepInput {
        displacement: Some(&rest),
        ..upt::StepInput::default()
    };
    assert!(matches!(
        scene.step(given, None),
        Err(Error::Unsupported(_))
    ));
    let found = scene.contacts_from_instruments(&[], |_, _| Ok(()));
    assert!(matches!(found, Err(Error::Unsupported(_))));
    let bare = Scene::new(liver(), &with(0)).unwrap();
    assert!(matches!(bare.cut(0, 2, &edge), Err(Error::Unsupported(_))));
}

/// The same through the C interface: the same bits, and undo by a snapshot.
#[test]
fn a_host_in_c_cuts_as_one_in_rust() {
    let (own, tool) = pressed();
    let tools = std::slice::from_ref(&tool);
    let edge = slit(&own, 6.0, 15.0);
    let model = fixture::host::open(&fixture::shipped("liver-coarse"));
    let mut options = fixture::host::scene_options();
    (options.corrections.mode, options.corrections.count) = (UPT_CORRECTIONS_COUNT, 5);
    let scene = fixture::host::create(model, &options);
    // SAFETY: zeros are values of these structs, and each call keeps to the header.
    unsafe {
        let mut one: upt_instrument = std::mem::zeroed();
        one.struct_size = size_of::<upt_instrument>() as u32;
        one.radius = 3.0;
        one.rotation[3] = 1.0;
        one.position = tool.pose.translation.to_array();
        let input = upt_input::of_instruments(std::slice::from_ref(&one));
        let step_in_c = |out: &mut [f32]| {
            let status = upt_scene_step(scene, &input, out.as_mut_ptr(), out.len() as u64);
            assert_eq!(status, UPT_OK, "{}", fixture::host::message());
        };
        let mut u = vec![0.0f32; 3 * own.node_count()];
        for _ in 0..6 {
            step_in_c(&mut u);
        }
        let mut saved = vec![0u8; 1 << 22];
        let mut needed = 0;
        let room = saved.len() as u64;
        assert_eq!(
            upt_scene_save(scene, saved.as_mut_ptr().cast(), room, &mut needed),
            UPT_OK
        );
        let mut out: upt_cut = std::mem::zeroed();
        let at = edge.as_flattened().as_ptr();
        assert_eq!(
            upt_scene_cut(scene, 0, at, 2, 2, &mut out),
            UPT_ERR_STRUCT_SIZE
        );
        out.struct_size = size_of::<upt_cut>() as u32;
        assert_eq!(
            upt_scene_cut(scene, 0, at, 1, 2, &mut out),
            UPT_ERR_ARGUMENT
        );
        assert_eq!(
            upt_scene_cut(scene, 0, at, 2, 2, &mut out),
            UPT_OK,
            "{}",
            fixture::host::message()
        );
        let cut = own.cut(0, 2, &edge).unwrap();
        assert_eq!(out.node_count, own.node_count() as u64);
        assert_eq!(out.copied_count, cut.copied.len() as u64);
        let mut u = vec![0.0f32; 3 * own.node_count()];
        step_in_c(&mut u);
        assert_eq!(bits(&u), bits(&step(&own, tools)));
        one.position[2] -= 12.0;
        one.radius = 5.0;
        assert_eq!(upt_scene_remove(scene, &one, 100.0, &mut out), UPT_OK);
        assert!(out.removed_mm3 > 90.0);
        assert_eq!(
            upt_scene_scale_stiffness(scene, [1, 2].as_ptr(), 2, 2.0, &mut out),
            UPT_OK
        );
        assert_eq!(upt_scene_drop_fragments(scene, &mut out), UPT_OK);
        assert_eq!(
            upt_scene_restore(scene, saved.as_ptr().cast(), needed),
            UPT_OK
        );
        let status = upt_scene_read(
            scene,
            std::ptr::null(),
            u.as_mut_ptr(),
            3 * fixture::host::node_count(model) as u64,
        );
        assert_eq!(status, UPT_OK);
        upt_scene_destroy(scene);
        upt_model_destroy(model);
    }
}
