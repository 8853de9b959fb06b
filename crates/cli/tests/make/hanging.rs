//! What holds an organ and what it was scanned under: parts that the file names, `--gravity`, `--unload`, and the support group of `--support`.

use std::path::Path;

use super::refused::refused;
use super::{command, plain};
use upt::{GroupMotion, Loads, Model, ModelOptions, Scene, SceneOptions, StepInput, SupportPose};

/// Of a bundle that says what it was scanned under, with a group.
pub const OPTIONS: [&str; 4] = ["--gravity", "0,-1,0", "--support", "bed=ball:0,0,-30,12"];

/// Under the gravity of the scan nothing moves; gravity that turns bends it, and its group leads it.
pub fn hangs_as_it_was_scanned(bundle: &Path) {
    let model = Model::open(bundle, &ModelOptions::default()).unwrap();
    assert_eq!(model.manifest.gravity_at_rest_m_s2, [0.0, -1.0, 0.0]);
    let names: Vec<&str> = model.supports().map(|(name, _)| name).collect();
    assert_eq!(names, ["bed"]);
    let scene = Scene::new(model, &SceneOptions::default()).unwrap();
    let mut field = vec![0.0; 3 * scene.node_count()];
    let mut farthest = |loads: Loads<'_>| {
        let input = StepInput {
            loads,
            ..StepInput::default()
        };
        for _ in 0..10 {
            scene.step(input, Some(&mut field)).unwrap();
        }
        field.iter().fold(0.0f32, |most, u| most.max(u.abs()))
    };
    let under = |gravity| Loads {
        gravity,
        ..Loads::default()
    };
    assert_eq!(farthest(under([0.0, -1.0, 0.0])), 0.0);
    assert!(farthest(under([1.0, 0.0, 0.0])) > 0.01);
    let up = [GroupMotion {
        group: 0,
        pose: Some(SupportPose {
            position: [0.0, 0.0, 1.0],
            rotation: [0.0, 0.0, 0.0, 1.0],
        }),
        ..GroupMotion::default()
    }];
    let led = Loads {
        supports: &up,
        ..Loads::default()
    };
    assert!(farthest(led) > 0.9);
}

#[test]
fn parts_that_the_file_names_are_held_and_stiffer() {
    let folder = tempfile::tempdir().unwrap();
    let surface = folder.path().join("named.obj");
    plain(&surface);
    let mut text = std::fs::read_to_string(&surface).unwrap();
    // The last faces are three sectors of sixteen.
    let at = text.match_indices("f ").map(|(at, _)| at).nth(208).unwrap();
    text.insert_str(at, "usemtl ligament\n");
    std::fs::write(&surface, text).unwrap();
    let out = surface.with_extension("bundle");
    let arguments = [
        "--fixed",
        "group:ligament",
        "--stiffness",
        "ball:0,0,0,15=4",
        "--pressure",
        "bed=group:ligament",
        "--gravity",
        "0,0,-2",
        "--unload",
        "--preview",
    ];
    let output = command(&surface, &out, &arguments).output().unwrap();
    let said = super::text(&output);
    assert!(output.status.success(), "{said}");
    assert!(said.contains("4 times the stiffness"), "{said}");
    assert!(said.contains("region `bed`: "), "{said}");
    is_unloaded(&said);
    let message = refused(&surface, &["--fixed", "group:tendon"]);
    assert!(message.contains("tendon") && message.contains("ligament"));
}

/// A run with `--unload` says how far the shape without gravity is from the scan.
fn is_unloaded(said: &str) {
    let (_, after) = said
        .split_once("shape without the gravity of the scan: nodes go ")
        .expect(said);
    let way: f64 = after.split_once(' ').unwrap().0.parse().unwrap();
    assert!((0.1..20.0).contains(&way), "{said}");
}
