//! Tissue that relaxes under each load of an input: in the end it lies where tissue of what lasts of its modulus lies.

use std::sync::Arc;

use serde_json::json;
use upt::contact::Tool;
use upt::{
    Contact, GroupMotion, Loads, Model, ModelOptions, Pressure, Scene, SceneOptions, Shape,
    StepInput, SupportPose, Tie, View,
};

use crate::BUNDLE;
use crate::ties::{middle, place, thorough, thread};
use fixture::{bits, relaxing_in, scene, with_groups};

/// What acts, one at a time.
const CASES: [&str; 6] = ["gravity", "forces", "pressure", "tie", "group", "tool"];
/// 0.3 of the stress lasts.
const LASTING: f64 = 0.3;

fn branches() -> serde_json::Value {
    json!([{"share": 0.4, "tau_s": 0.1}, {"share": 0.3, "tau_s": 0.8}])
}

/// With the folder, from which a model reads on.
fn open(
    branches: serde_json::Value,
    part: f64,
    alpha: Option<f64>,
) -> (tempfile::TempDir, Arc<Model>) {
    let folder = with_groups(BUNDLE);
    let model = relaxing_in(
        folder.path(),
        (branches, part),
        alpha,
        &ModelOptions::default(),
    );
    (folder, model)
}

/// Everything that a case may need.
struct Means {
    forces: Vec<f32>,
    ties: Vec<Tie>,
    tools: Vec<Tool>,
    supports: Vec<GroupMotion<'static>>,
}

impl Means {
    fn of(scene: &Scene) -> Means {
        let node = middle(scene);
        let at = place(scene, node);
        let mut forces = vec![0.0; 3 * scene.node_count()];
        forces[3 * node as usize + 2] = 20.0;
        let shape = Shape::Sphere { radius: 3.0 };
        let tool = [at.x, at.y, at.z + 1.5];
        let pose = SupportPose {
            position: [1.5, 0.0, 0.5],
            rotation: [0.0, 0.0, 0.0, 1.0],
        };
        Means {
            forces,
            ties: vec![thread(scene, node, 10.0, 0.0, 4.0)],
            tools: vec![Tool::new(&shape, tool, [0.0, 0.0, 0.0, 1.0]).unwrap()],
            supports: vec![GroupMotion {
                group: 0,
                pose: Some(pose),
                ..GroupMotion::default()
            }],
        }
    }

    fn input<'a>(&'a self, case: &str) -> StepInput<'a> {
        const PRESSURE: [Pressure<'static>; 1] = [Pressure {
            nodes: &[],
            pascal: 60.0,
        }];
        let loads = Loads {
            gravity: match case {
                "gravity" => [0.0, 2.0, -3.0],
                _ => [0.0; 3],
            },
            forces: (case == "forces").then_some(&self.forces),
            pressures: match case {
                "pressure" => &PRESSURE,
                _ => &[],
            },
            ties: match case {
                "tie" => &self.ties,
                _ => &[],
            },
            supports: match case {
                "group" => &self.supports,
                _ => &[],
            },
            ..Loads::default()
        };
        StepInput {
            contact: match case {
                "tool" => Contact::Tools(&self.tools),
                _ => Contact::None,
            },
            loads,
            ..StepInput::default()
        }
    }
}

/// The field after each of `steps` steps, and the force of a tie or a tool, mN.
fn run(model: &Arc<Model>, case: &str, steps: u32) -> Vec<(Vec<f32>, f32)> {
    let options = SceneOptions {
        threads: 1,
        ..thorough()
    };
    let scene = scene(model, &options);
    let means = Means::of(&scene);
    let mut u = vec![0.0; 3 * scene.node_count()];
    let mut step = |_| {
        scene.step(means.input(case), Some(&mut u)).unwrap();
        let tied = scene.tie_readings().unwrap();
        let tied = tied
            .first()
            .map(|reading| upt::Vector::from(reading.force).length());
        let pushed = scene.with_contact_report(|report| {
            let force = report.readings.first().map(|reading| reading.force);
            force.map(|force| upt::Vector::from(force).length())
        });
        (u.clone(), tied.or(pushed).unwrap_or(0.0))
    };
    (0..steps).map(&mut step).collect()
}

fn apart(a: &[f32], b: &[f32]) -> f32 {
    let square = |values: &mut dyn Iterator<Item = f32>| values.map(|x| x * x).sum::<f32>();
    let off = square(&mut a.iter().zip(b).map(|(a, b)| a - b));
    (off / square(&mut b.iter().copied())).sqrt()
}

#[test]
fn every_load_ends_where_it_takes_tissue_of_what_lasts() {
    for alpha in [None, Some(-10.0)] {
        let (_a, own) = open(branches(), 1.0, alpha);
        let (_b, soft) = open(json!([]), LASTING, alpha);
        let (_c, stiff) = open(json!([]), 1.0, alpha);
        for case in CASES {
            let [own, soft, stiff] = [(&own, 160), (&soft, 160), (&stiff, 4)]
                .map(|(model, steps)| run(model, case, steps));
            let [(first, begun), (last, ended)] = [&own[3], &own[159]];
            let (wanted, held) = &soft[159];
            let off = apart(last, wanted);
            assert!(off < 0.01, "{case} {alpha:?}: {off}");
            assert!(
                (ended - held).abs() <= 0.01 * held,
                "{case}: {ended} of {held} mN"
            );
            let is_led = matches!(case, "group" | "tool");
            assert!(is_led || apart(first, wanted) > 0.1, "{case}: it creeps");
            if case == "tool" {
                // At first nearer to tissue that does not relax than to what is left.
                assert!(*begun > 1.2 * held && *begun < stiff[3].1, "{begun} mN");
            }
        }
    }
}

/// All of them at once, by steps on a worker and by steps of the host's thread, with frames between them: the same bits, from a snapshot too.
#[test]
fn steps_frames_and_snapshots_agree_under_loads() {
    let (_folder, model) = open(branches(), 1.0, None);
    let options = SceneOptions {
        threads: 1,
        ..thorough()
    };
    let scenes = [0; 3].map(|_| scene(&model, &options));
    let [plain, shown, restored] = &scenes;
    let means = Means::of(plain);
    let mut u = [0; 3].map(|_| vec![0.0; 3 * plain.node_count()]);
    let mut frame = vec![0.0; 3 * plain.node_count()];
    for t in 0..24 {
        let case = CASES[t / 4];
        let input = means.input(case);
        if t == 14 {
            restored.restore(&plain.save().unwrap()).unwrap();
        }
        plain.step(input, Some(&mut u[0])).unwrap();
        shown.step(input, Some(&mut u[1])).unwrap();
        assert_eq!(bits(&u[0]), bits(&u[1]), "{case}, step {t}");
        if t >= 14 {
            restored.step(input, Some(&mut u[2])).unwrap();
            assert_eq!(bits(&u[0]), bits(&u[2]), "{case}, restored, step {t}");
        }
        let contact = input.contact;
        for seconds in [0.0, 0.03] {
            shown
                .present(contact, seconds, View::Region, &mut frame)
                .unwrap();
            let off = apart(&frame, &u[1]);
            assert!(seconds > 0.0 || off == 0.0, "{case}, step {t}: {off}");
        }
    }
}
