//! One held-out case: the reference solver and two scenes of the bundle, frame by frame.

use std::sync::Arc;

use anyhow::Result;
use tissue::contact::ContactDomain;
use tissue::mesh::{Boundary, Mesh};
use tissue::schemes::{FRAME_S, FRAMES, Programme, Scheme};
use tissue::solver::{Solver, SolverOptions};
use upt::{Contact, Corrections, Error, Model, Scene, SceneOptions, StepInput};

use super::score::{Regions, Score, Step};

/// Push of the programmes as they are written, mm.
const PROGRAMME_PUSH_MM: f64 = 15.0;
/// Steps whose time is measured.
const TIMED: usize = 400;

/// A programme and the seed of its sites.
pub struct Case {
    pub scheme: Scheme,
    pub seed: u64,
}

/// Nodes and vectors of one step's contact.
pub type Touch = (Vec<u32>, Vec<f32>);

impl Case {
    /// Simulates and replays. Programmes are written for a brain: lengths are multiplied by the bundle's deepest push over theirs.
    pub fn run(
        &self,
        model: &Arc<Model>,
        mesh: &Mesh,
        boundary: Boundary,
        regions: &Regions,
        done: &(dyn Fn() + Sync),
    ) -> Result<Score> {
        let scale = f64::from(model.manifest.envelope.max_push_mm) / PROGRAMME_PUSH_MM;
        let mut enlarged = mesh.clone();
        for x in enlarged.positions.iter_mut().flatten() {
            *x = (f64::from(*x) / scale) as f32;
        }
        let domain = ContactDomain::new(&enlarged, boundary)?;
        let programme = Programme::new(self.scheme, &domain, self.seed)?;
        let stated = &model.manifest.material;
        let mut solver = Solver::new(
            mesh,
            boundary,
            SolverOptions {
                material: *stated,
                ..SolverOptions::default()
            },
        )?;
        let scene = |corrections| {
            let options = SceneOptions {
                corrections,
                threads: 1,
                ..SceneOptions::default()
            };
            Scene::new(Arc::clone(model), &options)
        };
        let scenes = [scene(Corrections::Recommended)?, scene(Corrections::None)?];
        let mut truth = vec![[0.0f32; 3]; mesh.node_count()];
        let mut fields = [truth.clone(), truth.clone()];
        let mut score = Score::new(
            self.scheme.name(),
            self.seed,
            mesh.node_count(),
            regions.len(),
        );
        for frame in 1..FRAMES {
            let mut contact = programme.contact(frame);
            for entry in &mut contact {
                entry.displacement = entry.displacement.map(|x| (f64::from(x) * scale) as f32);
            }
            let report = solver.step_frame(&contact, FRAME_S)?;
            solver.displacement(&mut truth);
            let nodes: Vec<u32> = contact.iter().map(|entry| entry.node).collect();
            let vectors: Vec<f32> = contact
                .iter()
                .flat_map(|entry| entry.displacement)
                .collect();
            for (scene, field) in scenes.iter().zip(&mut fields) {
                let input = StepInput {
                    displacement: None,
                    contact: Contact::Sparse {
                        nodes: &nodes,
                        vectors: &vectors,
                    },
                };
                match scene.step(input, Some(field.as_flattened_mut())) {
                    Ok(()) => {}
                    Err(Error::Guard(_)) => score.refused += 1,
                    Err(error) => return Err(error.into()),
                }
            }
            let mut forces = vec![[0.0f32; 3]; nodes.len()];
            if scenes[0].last_contacts()?.0 == nodes {
                scenes[0].contact_force(forces.as_flattened_mut())?;
            }
            score.add(
                &Step {
                    truth: &truth,
                    field: &fields[0],
                    baseline: &fields[1],
                    stats: scenes[0].stats(),
                    forces: &forces,
                    true_forces: &report.reaction,
                    nodes: &nodes,
                },
                mesh,
                regions,
            );
            score.touches.push((nodes, vectors));
            done();
        }
        Ok(score)
    }
}

/// Milliseconds of steps of a scene alone on its thread, in contact.
pub fn speed(model: &Arc<Model>, scores: &[Score]) -> Result<Vec<f64>> {
    let options = SceneOptions {
        threads: 1,
        ..SceneOptions::default()
    };
    let scene = Scene::new(Arc::clone(model), &options)?;
    let mut times = Vec::new();
    for (nodes, vectors) in scores.iter().flat_map(|score| &score.touches) {
        let input = StepInput {
            displacement: None,
            contact: Contact::Sparse { nodes, vectors },
        };
        if scene.step(input, None).is_ok() && !nodes.is_empty() {
            times.push(scene.stats().step_ms);
        }
        if times.len() == TIMED {
            break;
        }
    }
    times.sort_by(f64::total_cmp);
    Ok(times)
}
