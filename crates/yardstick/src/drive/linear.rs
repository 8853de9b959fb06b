//! Linear elasticity with the same contact: the response of a bundle's tables alone, its contact solved as the library does
//! without corrections. No host can ask for it, so this reaches behind the C interface.

use std::time::Instant;

use anyhow::Result;
use contact::Samples;
use upt::contact::{Compliance, ContactProblem, ContactReport, State, Tool};
use upt::kernels::Isa;

use crate::bundle_folder::BundleFolder;
use crate::prior_alone::PriorAlone;

/// The state of a body that answers linearly.
pub struct Linear {
    prior: PriorAlone,
    problem: ContactProblem,
    rest: Vec<f32>,
    state: Vec<[f32; 3]>,
    pub(super) told: ContactReport,
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
            problem: ContactProblem::new(samples.into(), prior.mesh().clone(), Isa::detect())?,
            prior,
            rest: rest.as_flattened().to_vec(),
            state: vec![[0.0; 3]; rest.len()],
            told: ContactReport::default(),
        })
    }

    pub fn reset(&mut self) {
        self.prior.reset();
        self.problem.reset();
        self.state.fill([0.0; 3]);
    }

    /// The step; the time of its contact solve, ms.
    pub(super) fn step(&mut self, tools: &[Tool], out: &mut [[f32; 3]]) -> Result<f64> {
        let started = Instant::now();
        let start = self.state.as_flattened();
        let state = State {
            rest: &self.rest,
            u: start,
            start,
        };
        self.problem.begin(tools, &[], &self.rest, start)?;
        let (mut nodes, mut vectors) = (Vec::new(), Vec::new());
        if self.problem.is_near(state)? {
            let compliance = Compliance::at_rest(self.prior.table(), self.prior.held(), None);
            let found = self.problem.prescribe(compliance, state)?;
            nodes.extend_from_slice(found.0);
            vectors.extend_from_slice(found.1.as_chunks().0);
        }
        let contact_ms = started.elapsed().as_secs_f64() * 1e3;
        self.prior.step(&nodes, &vectors, out)?;
        let state = State {
            u: out.as_flattened(),
            ..state
        };
        self.problem.finish(state, true);
        self.problem.commit();
        self.problem
            .report(&mut self.told, &self.rest, out.as_flattened());
        self.state.copy_from_slice(out);
        Ok(contact_ms)
    }
}
