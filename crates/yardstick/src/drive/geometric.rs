//! Poses to nodes and vectors, and these into the step.

use std::time::Instant;

use anyhow::Result;
use contact::Vector;
use tissue::solver::ToolPose;
use upt::ffi;

use super::{Driver, Felt, Step, load};

impl Driver {
    pub(super) fn geometric(
        &mut self,
        instruments: &[ffi::upt_instrument],
        poses: &[ToolPose],
        out: &mut [[f32; 3]],
    ) -> Result<Step> {
        let started = Instant::now();
        self.scene
            .contacts(instruments, &mut self.nodes, &mut self.vectors)?;
        let found_ms = started.elapsed().as_secs_f64() * 1e3;
        self.scene.step(&self.nodes, &self.vectors, out)?;
        let ms = started.elapsed().as_secs_f64() * 1e3;
        let stats = self.scene.stats()?;
        let forces = if self.nodes.is_empty() {
            Vec::new()
        } else {
            self.scene.contact_force(self.nodes.len())?
        };
        let mut step = Step {
            ms,
            contact_ms: found_ms + self.scene.timing()?.prior_ms,
            flags: stats.flags,
            felt: vec![Felt::default(); poses.len()],
            loads: Vec::new(),
        };
        for ((node, u), force) in self.nodes.iter().zip(&self.vectors).zip(forces) {
            let point = self.rest[*node as usize] + Vector::from(*u);
            let nearest = self.tools.iter().zip(poses).enumerate();
            let nearest = nearest
                .map(|(index, (taken, to))| (index, taken.body.nearest_at(&to.pose, point)))
                .min_by(|a, b| a.1.distance.total_cmp(&b.1.distance));
            let Some((index, nearest)) = nearest else {
                continue;
            };
            let force = Vector::from(force);
            let felt = &mut step.felt[index];
            felt.contacts += 1;
            let torque = (point - poses[index].pose.translation).cross(force);
            for k in 0..3 {
                felt.force[k] += f64::from(force[k]);
                felt.torque[k] += f64::from(torque[k]);
            }
            step.loads.push(load(index, -force, nearest.normal));
        }
        Ok(step)
    }
}
