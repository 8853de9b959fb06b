//! Region and points of a frame share its contact.

use std::path::Path;
use std::sync::Arc;

use ::contact::Shape;

use crate::contact::Tool;
use crate::options::{Corrections, GuardPolicy, ModelOptions};
use crate::scene::{Contact, Scene, View};
use crate::{Model, SceneOptions};

const STEP_S: f64 = 0.05;

struct Host {
    scene: Scene,
    region: Vec<f32>,
    points: Vec<f32>,
}

impl Host {
    fn new(model: &Arc<Model>) -> Host {
        let options = SceneOptions {
            guard_policy: GuardPolicy::Report,
            sleep: false,
            corrections: Corrections::Fixed(8),
            ..SceneOptions::default()
        };
        let scene = Scene::new(Arc::clone(model), &options).unwrap();
        let places = scene.mesh().positions[..30].to_vec();
        scene.attach_points(Some(&places)).unwrap();
        Host {
            region: vec![f32::NAN; 3 * scene.node_count()],
            points: vec![f32::NAN; 30],
            scene,
        }
    }

    /// A ball of radius 3 mm that goes into a node of the top, there at `t` steps.
    fn tool(&self, t: f64) -> [Tool; 1] {
        let mesh = self.scene.mesh();
        let place = |node: u32| [0, 1, 2].map(|k| mesh.positions[3 * node as usize + k]);
        let nodes = mesh.domain.nodes.iter().map(|&node| place(node));
        let [x, y, z] = nodes.max_by(|a, b| a[2].total_cmp(&b[2])).unwrap();
        let shape = Shape::Sphere { radius: 3.0 };
        let centre = [x, y, z + 3.0 - 0.4 * t as f32];
        [Tool::new(&shape, centre, [0.0, 0.0, 0.0, 1.0]).unwrap()]
    }

    fn step(&self, t: f64) {
        self.scene
            .step(Contact::Tools(&self.tool(t)), None)
            .unwrap();
    }

    fn show(&mut self, t: f64, since: f64) -> Vec<u32> {
        let tool = self.tool(t);
        self.scene
            .present(
                Contact::Tools(&tool),
                since * STEP_S,
                View::Region,
                &mut self.region,
            )
            .unwrap();
        self.region.iter().map(|x| x.to_bits()).collect()
    }

    fn show_points(&mut self, t: f64, since: f64) -> Vec<u32> {
        let tool = self.tool(t);
        self.scene
            .present(
                Contact::Tools(&tool),
                since * STEP_S,
                View::Points,
                &mut self.points,
            )
            .unwrap();
        self.points.iter().map(|x| x.to_bits()).collect()
    }

    fn solves(&self) -> u64 {
        self.scene.tools.presenters.lock().unwrap().solves.made
    }
}

fn model() -> Arc<Model> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/tiny-corrected");
    Model::open(&path, &ModelOptions::default()).unwrap()
}

#[test]
fn points_of_a_frame_take_the_contact_of_its_region() {
    let model = model();
    let [mut both, mut region, mut points] = [(); 3].map(|()| Host::new(&model));
    let mut solves = 0;
    for step in 1..7 {
        let now = f64::from(step);
        for host in [&both, &region, &points] {
            host.step(now);
        }
        for frame in 1..5 {
            let since = 0.22 * f64::from(frame);
            let t = now + since;
            // Now the region first, now the points.
            let shown = match frame % 2 {
                0 => (both.show(t, since), both.show_points(t, since)),
                _ => {
                    let points = both.show_points(t, since);
                    (both.show(t, since), points)
                }
            };
            assert!(shown.0 == region.show(t, since), "region, {t}");
            assert!(shown.1 == points.show_points(t, since), "points, {t}");
            // The frame without the step that arrives is solved too.
            solves += if step > 1 && frame == 1 { 2 } else { 1 };
            assert_eq!(both.solves(), solves, "{t}");
        }
    }
    assert_eq!(region.solves(), solves);
    assert_eq!(points.solves(), solves);
    // Another moment, another place: nothing is taken over.
    both.show(6.9, 0.9);
    both.show_points(6.9, 0.95);
    both.show_points(6.95, 0.95);
    assert_eq!(both.solves(), solves + 3);
    let expected = [
        points.show_points(6.9, 0.95),
        points.show_points(6.95, 0.95),
    ];
    assert!(expected[0] != expected[1]);
    assert!(both.show_points(6.95, 0.95) == expected[1]);
}

#[test]
fn points_of_a_frame_take_the_collision_field_of_its_region() {
    let model = model();
    let [mut both, mut points] = [(); 2].map(|()| Host::new(&model));
    let mesh = both.scene.mesh();
    let free = mesh.domain.nodes.iter();
    let free = free.filter(|node| !mesh.held_nodes.contains(node));
    let nodes: Vec<u32> = free.take(4).copied().collect();
    let at = |t: f32| [0.0, 0.0, -0.3 * t].repeat(4);
    for step in 1..4 {
        let now = step as f32;
        for host in [&both, &points] {
            host.scene
                .step(
                    Contact::Sparse {
                        nodes: &nodes,
                        vectors: &at(now),
                    },
                    None,
                )
                .unwrap();
        }
        let before = both.solves();
        let host = &mut both;
        let vectors = at(now + 0.5);
        host.scene
            .present(
                Contact::Sparse {
                    nodes: &nodes,
                    vectors: &vectors,
                },
                0.5 * STEP_S,
                View::Region,
                &mut host.region,
            )
            .unwrap();
        for host in [&mut both, &mut points] {
            host.scene
                .present(
                    Contact::Sparse {
                        nodes: &nodes,
                        vectors: &vectors,
                    },
                    0.5 * STEP_S,
                    View::Points,
                    &mut host.points,
                )
                .unwrap();
        }
        assert_eq!(both.solves() - before, if step > 1 { 2 } else { 1 });
        let bits = |host: &Host| -> Vec<u32> { host.points.iter().map(|x| x.to_bits()).collect() };
        assert!(bits(&both) == bits(&points), "step {step}");
        // The same nodes elsewhere are another question.
        let vectors = at(now + 0.6);
        both.scene
            .present(
                Contact::Sparse {
                    nodes: &nodes,
                    vectors: &vectors,
                },
                0.5 * STEP_S,
                View::Points,
                &mut both.points,
            )
            .unwrap();
        points
            .scene
            .present(
                Contact::Sparse {
                    nodes: &nodes,
                    vectors: &vectors,
                },
                0.5 * STEP_S,
                View::Points,
                &mut points.points,
            )
            .unwrap();
        assert!(bits(&both) == bits(&points), "step {step}, elsewhere");
    }
}
