//! The closed surface of a cut body: the same in C as in Rust, with numbers that stay, and vertices that follow the steps.

use std::collections::HashMap;
use std::ptr::null_mut;

use super::cuts::{liver, options, slit};
use super::*;
use upt::ffi::*;
use upt::{Blade, Error, View};

/// What a host keeps of a surface, from the C interface.
#[derive(Clone, Debug, Default, PartialEq)]
struct Kept {
    rest: Vec<f32>,
    triangles: Vec<[u32; 3]>,
    inside: Vec<u8>,
    changed: Vec<u32>,
}

/// Asks for what is new and takes all of it.
fn follow(scene: *mut upt_scene) -> (upt_surface, Kept) {
    // SAFETY: zeros are a value of this struct, and each call keeps to the header.
    unsafe {
        let mut out: upt_surface = std::mem::zeroed();
        out.struct_size = size_of::<upt_surface>() as u32;
        let status = upt_scene_update_surface(scene, &mut out);
        assert_eq!(status, UPT_OK, "{}", fixture::host::message());
        let mut kept = Kept {
            rest: vec![0.0; 3 * out.vertex_count as usize],
            triangles: vec![[0; 3]; out.triangle_count as usize],
            inside: vec![9; out.triangle_count as usize],
            changed: vec![0; out.changed_count as usize],
        };
        let status = upt_scene_read_surface(
            scene,
            kept.rest.as_mut_ptr(),
            out.vertex_count,
            kept.triangles.as_mut_ptr().cast(),
            kept.inside.as_mut_ptr(),
            out.triangle_count,
            kept.changed.as_mut_ptr(),
            out.changed_count,
        );
        assert_eq!(status, UPT_OK, "{}", fixture::host::message());
        (out, kept)
    }
}

/// Each edge of the surface is passed once in each direction, or as often in both where lips meet.
fn assert_closed(triangles: &[[u32; 3]]) {
    let mut edges: HashMap<(u32, u32), i32> = HashMap::new();
    for &[a, b, c] in triangles.iter().filter(|corners| **corners != [0; 3]) {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            assert_ne!(from, to);
            *edges.entry((from.min(to), from.max(to))).or_default() +=
                if from < to { 1 } else { -1 };
        }
    }
    assert!(edges.values().all(|times| *times == 0));
}

/// Volume that a surface encloses, mm³.
fn volume(triangles: &[[u32; 3]], positions: &[f32]) -> f64 {
    let at = |node: u32| Vector::from_slice(&positions[3 * node as usize..][..3]);
    let parts = triangles.iter().map(|corners| corners.map(at));
    parts
        .map(|[a, b, c]| f64::from(a.dot(b.cross(c))) / 6.0)
        .sum()
}

/// A frame of the surface at the moment of a step is the state's, one after it is near, and there is none of another length.
fn assert_frames_start_from_the_state(scene: &Scene, tool: &Tool, rest: &[f32], at: &[f32]) {
    let tools = std::slice::from_ref(tool);
    let mut u = vec![0.0; rest.len()];
    for (seconds, bound) in [(0.0, 1e-3), (0.02, 1.0)] {
        let made = scene.present(Contact::Tools(tools), seconds, View::Surface, &mut u);
        made.unwrap();
        let off = rest
            .iter()
            .zip(&u)
            .zip(at)
            .map(|((rest, u), at)| (rest + u - at).abs());
        let worst = off.fold(0.0, f32::max);
        assert!(worst < bound, "{worst} mm at {seconds} s");
    }
    let short = &mut u[3..];
    let refused = scene.present(Contact::None, 0.0, View::Surface, short);
    assert!(matches!(refused, Err(Error::Argument(_))), "{refused:?}");
}

#[test]
fn the_surface_of_a_cut_body_is_the_same_in_c_is_closed_and_follows_the_steps() {
    let own = Scene::new(liver(), &options()).unwrap();
    let tool = pressing(&own, 4.0, Vector::ZERO);
    let edge = slit(&own, 6.0, 15.0);
    let model = fixture::host::open(&fixture::shipped("liver-coarse"));
    let mut made = fixture::host::scene_options();
    (made.corrections.mode, made.corrections.count) = (UPT_CORRECTIONS_COUNT, 5);
    let scene = fixture::host::create(model, &made);
    // SAFETY: zeros are values of these structs, and each call keeps to the header.
    unsafe {
        let mut one: upt_instrument = std::mem::zeroed();
        one.struct_size = size_of::<upt_instrument>() as u32;
        one.radius = 3.0;
        one.rotation[3] = 1.0;
        one.position = tool.pose.translation.to_array();
        let input = upt_input::of_instruments(std::slice::from_ref(&one));
        let mut none = [0.0; 3];
        let early = upt_scene_read_surface_positions(scene, none.as_mut_ptr(), 3);
        assert_eq!(early, UPT_ERR_STATE);
        let (first, whole) = follow(scene);
        let first = (first.is_new, first.first_vertex, first.changed_count);
        assert_eq!(first, (1, 0, whole.triangles.len() as u64));
        assert_closed(&whole.triangles);
        assert!(whole.inside.iter().all(|inside| *inside == 0));
        let mut cut: upt_cut = std::mem::zeroed();
        cut.struct_size = size_of::<upt_cut>() as u32;
        let status = upt_scene_cut(scene, 0, edge.as_flattened().as_ptr(), 2, 2, &mut cut);
        assert_eq!(status, UPT_OK, "{}", fixture::host::message());
        assert_eq!(cut.is_changed, 1);
        let mut nodes = 0;
        assert_eq!(upt_scene_read_node_count(scene, &mut nodes), UPT_OK);
        assert_eq!(nodes, cut.node_count);
        // Stale: the vertices are not those of the body.
        let mut old = vec![0.0; whole.rest.len()];
        let floats = old.len() as u64;
        let stale = upt_scene_read_surface_positions(scene, old.as_mut_ptr(), floats);
        assert_eq!(stale, UPT_ERR_STATE);

        let (update, now) = follow(scene);
        assert_eq!(update.is_new, 0);
        assert_eq!(update.first_vertex as usize, whole.rest.len() / 3);
        assert_eq!(now.rest[..whole.rest.len()], whole.rest);
        assert_closed(&now.triangles);
        let lips = now.inside.iter().filter(|inside| **inside == 1).count();
        assert!(lips > 20 && now.changed.len() < now.triangles.len() / 2);
        // Nothing vanishes, and what changed is what is listed.
        let volumes = [&whole, &now].map(|kept| volume(&kept.triangles, &kept.rest));
        assert!((volumes[1] / volumes[0] - 1.0).abs() < 1e-4, "{volumes:?}");
        let mut uploaded = whole.triangles.clone();
        uploaded.resize(now.triangles.len(), [0; 3]);
        for slot in &now.changed {
            uploaded[*slot as usize] = now.triangles[*slot as usize];
        }
        assert_eq!(uploaded, now.triangles);
        assert_eq!(follow(scene).0.changed_count, 0);

        // In Rust the same.
        own.surface().update().unwrap();
        own.cut(0, 2, &edge).unwrap();
        let same = own.surface().update().unwrap();
        assert_eq!(same.first_vertex as u64, update.first_vertex);
        let in_rust = own.surface().read(|surface| Kept {
            rest: surface.rest.as_flattened().to_vec(),
            triangles: surface.triangles.to_vec(),
            inside: surface
                .inside
                .iter()
                .map(|inside| u8::from(*inside))
                .collect(),
            changed: surface.changed.to_vec(),
        });
        assert_eq!(in_rust.unwrap(), now);

        // The vertices go with the tissue: the first are the mesh's nodes, and the surface stays closed around what it was.
        let mut at = vec![0.0; now.rest.len()];
        let floats = at.len() as u64;
        let mut u = vec![0.0; 3 * nodes as usize];
        for _ in 0..4 {
            let status = upt_scene_step(scene, &input, u.as_mut_ptr(), u.len() as u64);
            assert_eq!(status, UPT_OK, "{}", fixture::host::message());
            step(&own, std::slice::from_ref(&tool));
        }
        let status = upt_scene_read_surface_positions(scene, at.as_mut_ptr(), floats);
        assert_eq!(status, UPT_OK, "{}", fixture::host::message());
        let mut in_rust = vec![0.0; at.len()];
        own.surface().positions(&mut in_rust).unwrap();
        assert_eq!(bits(&at), bits(&in_rust));
        assert_frames_start_from_the_state(&own, &tool, &now.rest, &at);
        for (k, position) in at[..whole.rest.len()].iter().enumerate() {
            assert!((position - whole.rest[k] - u[k]).abs() < 1e-4);
        }
        let moved = at.iter().zip(&now.rest).map(|(a, b)| (a - b).abs());
        assert!(moved.fold(0.0, f32::max) > 3.0);
        let pressed = volume(&now.triangles, &at);
        assert!((pressed / volumes[0] - 1.0).abs() < 0.05, "{pressed}");

        let wrong = upt_scene_read_surface(
            scene,
            at.as_mut_ptr(),
            7,
            null_mut(),
            null_mut(),
            0,
            null_mut(),
            0,
        );
        assert_eq!(wrong, UPT_ERR_ARGUMENT);
        let short = upt_scene_read_surface_positions(scene, at.as_mut_ptr(), floats - 3);
        assert_eq!(short, UPT_ERR_ARGUMENT);
        // The intact body is another one.
        assert_eq!(upt_scene_reset(scene), UPT_OK);
        let (update, again) = follow(scene);
        assert_eq!((update.is_new, update.first_vertex), (1, 0));
        assert_eq!(again.triangles, whole.triangles);
        upt_scene_destroy(scene);
        upt_model_destroy(model);
    }
    own.reset().unwrap();
    let mut at = vec![0.0; 3 * own.node_count()];
    let stale = own.present(Contact::None, 0.0, View::Surface, &mut at);
    assert!(matches!(stale, Err(Error::State(_))), "{stale:?}");
    own.set_region(Some(&[1])).unwrap();
    let update = own.surface().update().unwrap();
    let mut at = vec![0.0; 3 * update.vertices];
    let refused = own.surface().positions(&mut at);
    assert!(matches!(refused, Err(Error::Unsupported(_))), "{refused:?}");
}

/// A blade that goes over again what it has cut leaves the body, and so the surface that a host has, as it is; what it does change it says, also where
/// nothing is laid open.
#[test]
fn a_cut_says_whether_the_body_is_another_one() {
    let scene = Scene::new(liver(), &options()).unwrap();
    scene.surface().update().unwrap();
    let [a, b, c, d] = slit(&scene, 6.0, 15.0);
    let blade = Blade {
        energy: 10.0,
        ..Blade::default()
    };
    // To and fro, and aside a little, as a hand holds it.
    let edge = |at: usize| {
        let part = (at % 160).min(160 - at % 160) as f32 / 80.0;
        let aside = 0.3 * (at as f32).sin();
        let moved = |from: f32, to: f32| from + part * (to - from) + aside;
        [(a, c), (b, d)].map(|(from, to)| [0, 1, 2].map(|k| moved(from[k], to[k])))
    };
    let (mut area, mut idle) = (0.0, 0);
    for at in 0..240 {
        let poses = [edge(at), edge(at + 1)];
        let cut = scene.cut_with(&blade, 0, 2, poses.as_flattened()).unwrap();
        if cut.is_changed {
            scene.surface().update().unwrap();
        } else {
            assert_eq!(cut, upt::Cut::default());
            idle += 1;
        }
        area += cut.area_mm2;
        let floats = scene.surface().read(|surface| 3 * surface.rest.len());
        let mut places = vec![0.0; floats.unwrap()];
        scene.surface().positions(&mut places).unwrap();
    }
    assert!(area > 100.0 && idle > 20, "{area} mm2, {idle}");
}
