//! Linear elasticity with the same contact: the response of a bundle's tables alone, its contact solved as the library does
//! without corrections. No host can ask for it, so this reaches behind the C interface.

use std::time::Instant;

use anyhow::Result;
use contact::{Samples, Vector};
use tissue::solver::ToolPose;
use upt::contact::{Compliance, Mode, Problem, State, Told, Tool};

use super::{Driver, Felt, Step, Taken, load};
use crate::report::method::BundleFolder;
use crate::report::prior_alone::PriorAlone;

/// The state of a body that answers linearly.
pub struct Linear {
    prior: PriorAlone,
    problem: Problem,
    rest: Vec<f32>,
    state: Vec<[f32; 3]>,
    told: Told,
}

impl Linear {
    /// A body at rest; `decay` is the factor a step after a release.
    pub fn new(
        bundle: &BundleFolder,
        samples: Samples,
        rest: &[[f32; 3]],
        decay: f32,
        threads: u32,
    ) -> Result<Self> {
        let prior = PriorAlone::new(bundle, decay, threads)?;
        Ok(Self {
            problem: Problem::new(samples.into(), prior.mesh().clone())?,
            prior,
            rest: rest.as_flattened().to_vec(),
            state: vec![[0.0; 3]; rest.len()],
            told: Told::default(),
        })
    }

    pub fn reset(&mut self) {
        self.prior.reset();
        self.problem.reset();
        self.state.fill([0.0; 3]);
    }

    /// The step; the time of its contact solve, ms.
    fn step(&mut self, tools: &[Tool], out: &mut [[f32; 3]]) -> Result<f64> {
        let started = Instant::now();
        let start = self.state.as_flattened();
        let state = State {
            rest: &self.rest,
            u: start,
            start,
        };
        self.problem.begin(tools, &self.rest, start)?;
        let (mut nodes, mut vectors) = (Vec::new(), Vec::new());
        if self.problem.is_near(state)? {
            let compliance = Compliance {
                prior: self.prior.table(),
                held: self.prior.held(),
                inertia: None,
            };
            let found = self.problem.prescribe(compliance, state)?;
            nodes.extend_from_slice(found.0);
            vectors.extend_from_slice(found.1.as_chunks().0);
        }
        let contact_ms = started.elapsed().as_secs_f64() * 1e3;
        self.prior.step(&nodes, &vectors, out)?;
        self.problem.finish(State {
            u: out.as_flattened(),
            ..state
        });
        self.problem.commit();
        self.problem
            .tell(&mut self.told, &self.rest, out.as_flattened());
        self.state.copy_from_slice(out);
        Ok(contact_ms)
    }
}

/// A tool as the library's contact takes it.
fn placed(taken: &Taken, to: &ToolPose) -> Tool {
    Tool {
        body: taken.body.clone(),
        pose: to.pose,
        mode: if to.grasp { Mode::Grasp } else { Mode::Slide },
        friction: taken.tool.friction,
        tear_off_mn: taken.tool.tear_off_mn,
    }
}

impl Driver {
    pub(super) fn linear(&mut self, poses: &[ToolPose], out: &mut [[f32; 3]]) -> Result<Step> {
        let tools = self.tools.iter().zip(poses);
        let tools: Vec<Tool> = tools.map(|(taken, to)| placed(taken, to)).collect();
        let linear = self.linear.as_mut().expect("made with the driver");
        let started = Instant::now();
        let contact_ms = linear.step(&tools, out)?;
        let ms = started.elapsed().as_secs_f64() * 1e3;
        let felt = linear.told.readings.iter().map(|reading| Felt {
            force: reading.force.map(f64::from),
            torque: reading.torque.map(f64::from),
            contacts: reading.contacts,
        });
        let loads = linear.told.pushes.iter().map(|push| {
            let tool = push.tool as usize;
            let point = Vector::from(push.point);
            let nearest = self.tools[tool].body.nearest_at(&poses[tool].pose, point);
            load(tool, -Vector::from(push.force), nearest.normal)
        });
        Ok(Step {
            ms,
            contact_ms,
            flags: 0,
            felt: felt.collect(),
            loads: loads.collect(),
        })
    }
}
