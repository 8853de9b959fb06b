//! One held-out case: the reference solver and two scenes of the bundle, frame by frame.

use std::sync::Arc;
use std::time::Instant;

use anyhow::Result;
use tissue::contact::ContactDomain;
use tissue::mesh::{Boundary, Mesh};
use tissue::schemes::{FRAME_S, FRAMES, Programme, Scheme};
use tissue::simulate::LEAST_FRAMES;
use tissue::solver::{Solver, SolverOptions};
use upt::{Contact, Corrections, Error, Model, Scene, SceneOptions};

use super::score::{Regions, Score, Step, Touch};
use page::Film;

/// Push of the programmes as they are written, mm.
const PROGRAMME_PUSH_MM: f64 = 15.0;
/// Steps whose time is measured.
const TIMED: usize = 400;

/// Why a case ended, where it had time for so many frames, the body at rest among them.
pub fn no_time(frames: usize) -> String {
    format!("no time after {frames} of {FRAMES} frames")
}

/// A programme and the seed of its sites.
#[derive(Clone, Copy)]
pub struct Case {
    pub scheme: Scheme,
    pub seed: u64,
}

/// What is simulated and replayed.
#[derive(Clone, Copy)]
pub struct Body<'a> {
    pub mesh: &'a Mesh,
    pub boundary: Boundary,
    pub regions: &'a Regions,
}

/// A frame of the reference solver.
pub struct Frame<'a> {
    pub touch: &'a Touch,
    pub truth: &'a [[f32; 3]],
    /// Force at each contact node, mN.
    pub reaction: &'a [[f32; 3]],
}

impl Case {
    /// Simulates the first frames, or those before a load that the mesh cannot carry or before the time is up, but always
    /// [`LEAST_FRAMES`]; then it says why. Programmes are written for a brain: lengths are multiplied by the bundle's deepest push over theirs.
    pub fn simulate(
        &self,
        model: &Model,
        body: &Body<'_>,
        frames: usize,
        until: Option<Instant>,
        each: &mut dyn FnMut(&Frame<'_>) -> Result<()>,
    ) -> Result<Option<String>> {
        let scale = f64::from(model.manifest.envelope.max_push_mm) / PROGRAMME_PUSH_MM;
        let mut enlarged = body.mesh.clone();
        for x in enlarged.positions.iter_mut().flatten() {
            *x = (f64::from(*x) / scale) as f32;
        }
        let domain = ContactDomain::new(&enlarged, body.boundary)?;
        let programme = Programme::new(self.scheme, &domain, self.seed)?;
        let mut solver = Solver::new(
            body.mesh,
            body.boundary,
            SolverOptions {
                material: model.manifest.material,
                ..SolverOptions::default()
            },
        )?;
        let mut truth = vec![[0.0f32; 3]; body.mesh.node_count()];
        for frame in 1..frames.min(FRAMES) {
            if frame > LEAST_FRAMES && until.is_some_and(|until| Instant::now() > until) {
                return Ok(Some(no_time(frame)));
            }
            let mut contact = programme.contact(frame);
            for entry in &mut contact {
                entry.displacement = entry.displacement.map(|x| (f64::from(x) * scale) as f32);
            }
            let report = match solver.step_frame(&contact, FRAME_S) {
                Ok(report) => report,
                Err(error) if error.is_load() => return Ok(Some(error.to_string())),
                Err(error) => return Err(error.into()),
            };
            solver.displacement(&mut truth);
            let nodes = contact.iter().map(|entry| entry.node).collect();
            let vectors = contact.iter().flat_map(|entry| entry.displacement);
            each(&Frame {
                touch: &(nodes, vectors.collect()),
                truth: &truth,
                reaction: &report.reaction,
            })?;
        }
        Ok(None)
    }
}

/// A case through a bundle: a scene with corrections and one without.
pub struct Replay<'a> {
    body: Body<'a>,
    scenes: [Scene; 2],
    fields: [Vec<[f32; 3]>; 2],
    score: Score,
}

impl<'a> Replay<'a> {
    pub fn new(
        case: Case,
        model: &Arc<Model>,
        corrections: Corrections,
        body: Body<'a>,
    ) -> Result<Self> {
        let scene = |corrections| {
            let options = SceneOptions {
                corrections,
                threads: 1,
                ..SceneOptions::default()
            };
            Scene::new(Arc::clone(model), &options)
        };
        let count = body.mesh.node_count();
        Ok(Self {
            body,
            scenes: [scene(corrections)?, scene(Corrections::None)?],
            fields: [vec![[0.0; 3]; count], vec![[0.0; 3]; count]],
            score: Score::new(case.scheme.name(), case.seed, count, body.regions.len()),
        })
    }

    /// Keeps the steps to be played.
    pub fn filmed(mut self) -> Self {
        let title = format!("A held-out contact (scheme {})", self.score.scheme);
        self.score.film = Some(Film::new(self.body.mesh, title, FRAME_S));
        self
    }

    /// Steps both scenes and compares them with the frame.
    pub fn step(&mut self, frame: &Frame<'_>) -> Result<()> {
        let (nodes, vectors) = frame.touch;
        for (scene, field) in self.scenes.iter().zip(&mut self.fields) {
            match scene.step(
                Contact::Sparse { nodes, vectors },
                Some(field.as_flattened_mut()),
            ) {
                Ok(()) => {}
                Err(Error::Guard(_)) => self.score.refused += 1,
                Err(error) => return Err(error.into()),
            }
        }
        let mut forces = vec![[0.0f32; 3]; nodes.len()];
        if self.scenes[0].last_contacts()?.0 == *nodes {
            self.scenes[0].contact_force(forces.as_flattened_mut())?;
        }
        let step = Step {
            truth: frame.truth,
            field: &self.fields[0],
            baseline: &self.fields[1],
            stats: self.scenes[0].stats(),
            forces: &forces,
            true_forces: frame.reaction,
            nodes,
        };
        self.score.add(&step, self.body.mesh, self.body.regions);
        self.score.touches.push(frame.touch.clone());
        Ok(())
    }

    /// `ended`: why before its end, if it did.
    pub fn finish(mut self, ended: Option<String>) -> Score {
        self.score.ended = ended;
        self.score
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
        if scene.step(Contact::Sparse { nodes, vectors }, None).is_ok() && !nodes.is_empty() {
            times.push(scene.timing().step_ms);
        }
        if times.len() == TIMED {
            break;
        }
    }
    Ok(times)
}
