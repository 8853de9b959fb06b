//! One attempt at a frame: contact paths, the gain of the inner step, the march, and whether its end is sound.

use super::march::{March, Path, Tally};
use super::options::Pressure;
use super::touch::ToolPose;
use super::{ContactNode, Solver, SolverError};
use std::sync::Mutex;

impl Solver {
    /// Sets the frame's contact paths from the present positions.
    pub(super) fn lead(&mut self, contact: &[ContactNode]) {
        self.paths.clear();
        for entry in contact {
            let slot = self.partition.slot_of_node[entry.node as usize];
            let [x, y, z, _] = self.fields.displacement[slot as usize].0;
            self.paths.push(Path {
                slot,
                start: [x, y, z],
                target: entry.displacement,
            });
        }
        self.paths.sort_unstable_by_key(|path| path.slot);
    }

    /// Gains `g` for the step, increments rescaled to it.
    pub(super) fn set_step(&mut self, dt: f64) {
        let scale = (dt / self.dt) as f32;
        let gain = dt * dt / (1.0 + 0.5 * self.options.material.damping_per_s * dt);
        for chunk in &self.partition.chunks {
            for slot in chunk.first..chunk.first + chunk.owned {
                let increment = &mut self.fields.increment[slot].0;
                if scale != 1.0 {
                    increment.iter_mut().for_each(|v| *v *= scale);
                }
                increment[3] = if self.held[slot] {
                    0.0
                } else {
                    (gain / f64::from(self.mass[slot])) as f32
                };
            }
        }
        for path in &self.paths {
            self.fields.increment[path.slot as usize].0[3] = 0.0;
        }
        self.dt = dt;
    }

    /// Runs one attempt at a frame; returns the external work, mJ.
    pub(super) fn march(
        &mut self,
        tools: &[ToolPose],
        steps: u32,
        duration_s: f64,
    ) -> Result<f64, SolverError> {
        let dt = duration_s / f64::from(steps);
        self.set_step(dt);
        if let Some(touch) = &mut self.touch {
            touch.begin(tools, steps, dt);
        }
        if let Some(load) = &mut self.load {
            load.begin(steps);
        }
        if let Some(ties) = &mut self.ties {
            ties.begin(self.time_s, steps, dt);
        }
        let tallies = self.run(steps);
        let inverted = tallies
            .iter()
            .map(|tally| tally.inverted_at)
            .filter(|step| *step > 0)
            .min();
        if inverted.is_some() || !self.is_finite() {
            return Err(self.explain(inverted, tools, steps, dt));
        }
        Ok(tallies.iter().map(|tally| tally.work).sum::<f64>() * 1e-6)
    }

    pub(super) fn run(&mut self, steps: u32) -> Vec<Tally> {
        let mut fields = std::mem::take(&mut self.fields);
        let mut touch = self.touch.take();
        let mut load = self.load.take();
        let mut ties = self.ties.take();
        let mut relaxing = self.relaxing.take();
        let mut march = self.marcher(steps);
        march.touch = touch.as_mut().map(Mutex::new);
        march.load = load.as_mut().map(Mutex::new);
        march.ties = ties.as_mut().map(Mutex::new);
        march.relaxing = relaxing.as_mut().map(Mutex::new);
        let tallies = march.run(&mut fields, self.pool.as_ref());
        self.touch = touch;
        self.load = load;
        self.ties = ties;
        if let Some(relaxing) = &mut relaxing {
            relaxing.passed(steps, self.dt);
        }
        self.relaxing = relaxing;
        self.fields = fields;
        tallies
    }

    fn marcher(&self, steps: u32) -> March<'_> {
        let damping = self.options.material.damping_per_s;
        March {
            partition: &self.partition,
            kernels: self.kernels,
            averaged: self.options.pressure == Pressure::AverageNodal,
            rest_volume: &self.rest_volume,
            mass: &self.mass,
            beta: ((1.0 - 0.5 * damping * self.dt) / (1.0 + 0.5 * damping * self.dt)) as f32,
            dt: self.dt,
            damping,
            paths: &self.paths,
            touch: None,
            load: None,
            ties: None,
            relaxing: None,
            steps,
        }
    }

    /// Internal forces of the present state into `fields.force`.
    pub(super) fn update_forces(&mut self) {
        let mut fields = std::mem::take(&mut self.fields);
        let mut relaxing = self.relaxing.take();
        let mut march = self.marcher(0);
        march.relaxing = relaxing.as_mut().map(Mutex::new);
        march.forces(&mut fields, self.pool.as_ref());
        self.relaxing = relaxing;
        self.fields = fields;
    }

    /// Every owned displacement is finite and no larger than a hundred metres.
    fn is_finite(&self) -> bool {
        self.partition.chunks.iter().all(|chunk| {
            self.fields.displacement[chunk.first..chunk.first + chunk.owned]
                .iter()
                .all(|node| node.0[..3].iter().all(|v| v.abs() < 1e5))
        })
    }
}
