//! Presses on a body of the reference solver, and what became of them.

use anyhow::Result;
use tissue::contact::{ContactDomain, Patch};
use tissue::mesh::{Boundary, Mesh};
use tissue::solver::{ContactNode, Solver, SolverError, SolverOptions};

pub(super) const SUBJECT: &str = "reference solver";

pub(super) const FRAME_S: f64 = 0.05;

/// One press: ramp, hold, and by option release.
#[derive(Clone, Copy)]
pub(super) struct Press {
    pub(super) depth_mm: f64,
    pub(super) area_mm2: f64,
    pub(super) ramp_frames: usize,
    pub(super) hold_frames: usize,
    pub(super) free_frames: usize,
}

impl Default for Press {
    fn default() -> Self {
        Self {
            depth_mm: 10.0,
            area_mm2: 150.0,
            ramp_frames: 8,
            hold_frames: 2,
            free_frames: 0,
        }
    }
}

/// What became of a press.
pub(super) struct Outcome {
    pub(super) frames: usize,
    pub(super) most_steps: u32,
    pub(super) min_det_f: f64,
    pub(super) field: Vec<[f32; 3]>,
    pub(super) largest_mm: f32,
    pub(super) finite: bool,
    pub(super) error: Option<SolverError>,
}

impl Outcome {
    pub(super) fn safe(&self) -> bool {
        self.finite
    }

    pub(super) fn complete(&self) -> bool {
        self.finite && self.error.is_none()
    }

    pub(super) fn text(&self) -> String {
        let state = format!(
            "{} frames, at most {} inner steps a frame, |u| at most {:.2} mm, min det F {:.2}",
            self.frames, self.most_steps, self.largest_mm, self.min_det_f
        );
        match &self.error {
            None => state,
            Some(error) => format!("{state}; then: {error}"),
        }
    }
}

pub(super) struct Body {
    pub(super) mesh: Mesh,
    pub(super) domain: ContactDomain,
    pub(super) seed: usize,
}

impl Body {
    pub(super) fn patch(&self, area_mm2: f64) -> Result<Patch> {
        Ok(self.domain.grow(self.seed, area_mm2)?)
    }

    pub(super) fn press(&self, options: SolverOptions, press: Press) -> Result<Outcome> {
        let patch = self.patch(press.area_mm2)?;
        Ok(self.drive(options, &patch, press))
    }

    pub(super) fn drive(&self, options: SolverOptions, patch: &Patch, press: Press) -> Outcome {
        let mut outcome = Outcome {
            frames: 0,
            most_steps: 0,
            min_det_f: 1.0,
            field: vec![[0.0; 3]; self.mesh.node_count()],
            largest_mm: 0.0,
            finite: true,
            error: None,
        };
        let mut solver = match Solver::new(&self.mesh, Boundary::Fixed, options) {
            Ok(solver) => solver,
            Err(error) => {
                outcome.error = Some(error);
                return outcome;
            }
        };
        let touching = press.ramp_frames + press.hold_frames;
        for frame in 1..=touching + press.free_frames {
            let depth = press.depth_mm * (frame as f64 / press.ramp_frames as f64).min(1.0);
            let contact: Vec<ContactNode> = if frame > touching {
                Vec::new()
            } else {
                let displacement = patch.inward.map(|v| (v * depth) as f32);
                patch
                    .nodes
                    .iter()
                    .map(|&node| ContactNode { node, displacement })
                    .collect()
            };
            match solver.step_frame(&contact, FRAME_S) {
                Ok(report) => {
                    outcome.frames = frame;
                    outcome.most_steps = outcome.most_steps.max(report.inner_steps);
                    outcome.min_det_f = outcome.min_det_f.min(report.min_det_f);
                }
                Err(error) => {
                    outcome.error = Some(error);
                    break;
                }
            }
            solver.displacement(&mut outcome.field);
            for u in outcome.field.iter().flatten() {
                outcome.finite &= u.is_finite();
                outcome.largest_mm = outcome.largest_mm.max(u.abs());
            }
        }
        outcome
    }
}

pub(super) fn relative(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    tissue::metrics::relative_l2(a, b)
}
