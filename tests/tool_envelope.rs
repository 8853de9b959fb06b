//! Flags in the terms of tools: a bundle whose manifest says which rigid tools it is good for (`envelope.tools`).
#![cfg(feature = "instruments")]

use std::sync::Arc;

use contact::{Shape, Vector};
use fixture::{copy_of, find_runtime, plain, scene};
use upt::contact::Tool;
use upt::{Contact, Corrections, Model, ModelOptions, Scene, SceneOptions, flag};

const STEP_S: f32 = 0.05;
/// Everything that the envelope says of a contact.
const ENVELOPE: u32 = flag::PUSH | flag::CONTACT_AREA | flag::SITE | flag::RATE | flag::SITES;

/// `tiny-corrected`, good for one rod of 2 to 4 mm that goes 1.5 mm deep at 40 mm/s, and for no contact of nodes at all.
fn model() -> (tempfile::TempDir, Arc<Model>) {
    find_runtime();
    let folder = copy_of("tiny-corrected");
    let mut manifest = fixture::manifest(folder.path());
    let envelope = &mut manifest["envelope"];
    envelope["contact_area_mm2"] = serde_json::json!([1e5, 1e6]);
    envelope["max_push_rate_mm"] = serde_json::json!(1e-3);
    envelope["tools"] = serde_json::json!({
        "corrections": 3, "size_mm": [2.0, 4.0], "depth_mm": 1.5, "speed_mm_s": 40.0, "max_tools": 1,
    });
    fixture::write_manifest(folder.path(), &mut manifest);
    let model = Model::open(folder.path(), &ModelOptions::default()).unwrap();
    (folder, model)
}

fn with(corrections: u32) -> SceneOptions {
    SceneOptions {
        corrections: Corrections::Fixed(corrections),
        ..plain()
    }
}

/// Balls over the middle of the domain, side by side, their lowest points `depth` mm below the surface at rest.
fn balls(scene: &Scene, radius: f32, depth: f32, count: usize) -> Vec<Tool> {
    let mesh = scene.mesh();
    let place = |node: &u32| Vector::from_slice(&mesh.positions[3 * *node as usize..][..3]);
    let middle =
        mesh.domain.nodes.iter().map(place).sum::<Vector>() / mesh.domain.nodes.len() as f32;
    let face = mesh.domain.faces[..3].iter().map(place).collect::<Vec<_>>();
    let normal = (face[1] - face[0]).cross(face[2] - face[0]).normalize();
    let aside = normal.any_orthonormal_vector();
    (0..count)
        .map(|index| {
            let shift = aside * (index as f32 - 0.5 * (count as f32 - 1.0)) * 2.5 * radius;
            let at = middle + normal * (radius - depth) + shift;
            let shape = Shape::Sphere { radius };
            Tool::new(&shape, at.to_array(), [0.0, 0.0, 0.0, 1.0]).unwrap()
        })
        .collect()
}

/// Flags of the envelope and the indicator after tools came to `depth` in steps of `by` mm.
fn flags(corrections: u32, radius: f32, depth: f32, by: f32, count: usize) -> (u32, f32) {
    let (_folder, model) = model();
    let scene = scene(&model, &with(corrections));
    // From outside, so that the last step is a whole one.
    let steps = ((depth + 2.0) / by).ceil() as i32;
    for left in (0..=steps).rev() {
        let at = depth - by * left as f32;
        let tools = balls(&scene, radius, at, count);
        scene.step(Contact::Tools(&tools), None).unwrap();
        let pushed =
            scene.with_contact_report(|report| report.readings.iter().all(|r| r.contacts > 0));
        assert!(pushed || at <= 0.0, "each tool pushes at {at} mm");
    }
    let stats = scene.stats();
    (stats.flags & ENVELOPE, stats.indicator)
}

#[test]
fn a_tool_inside_of_the_limits_raises_nothing() {
    let (risen, indicator) = flags(3, 3.0, 1.0, 0.25, 1);
    assert_eq!(risen, 0, "{}", flag::names(risen));
    assert!(indicator > 0.1 && indicator <= 1.0, "{indicator}");
}

/// Verifies REQ-022.
#[test]
fn each_limit_has_its_flag() {
    for (name, expected, got) in [
        ("deep", flag::PUSH, flags(3, 3.0, 2.2, 0.25, 1)),
        ("thin", flag::CONTACT_AREA, flags(3, 1.5, 1.0, 0.25, 1)),
        ("thick", flag::CONTACT_AREA, flags(3, 5.0, 1.0, 0.25, 1)),
        ("fast", flag::RATE, flags(3, 3.0, 1.2, 60.0 * STEP_S, 1)),
        ("two", flag::SITES, flags(3, 2.0, 1.0, 0.25, 2)),
    ] {
        let (risen, indicator) = got;
        assert_eq!(risen, expected, "{name}: {}", flag::names(risen));
        assert!(indicator > 1.0, "{name}: {indicator}");
    }
}

#[test]
fn fewer_corrections_than_measured_are_judged_by_the_nodes() {
    let (risen, _) = flags(2, 3.0, 1.0, 0.25, 1);
    assert_eq!(risen, flag::CONTACT_AREA | flag::RATE);
}
