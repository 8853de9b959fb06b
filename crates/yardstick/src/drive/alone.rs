//! A driver whose tissue answers linearly.

use std::time::Instant;

use anyhow::Result;
use contact::Vector;
use tissue::solver::ToolPose;
use upt::contact::{Mode, Tool};

use super::{Driver, Felt, Step, Taken, load};

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
            penetration_mm: f64::from(reading.penetration_mm),
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
