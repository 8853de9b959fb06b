//! Poses into the step.

use std::time::Instant;

use anyhow::Result;
use contact::Vector;
use tissue::solver::ToolPose;
use upt::ffi;

use super::{Driver, Felt, Step, load};

impl Driver {
    pub(super) fn solved(
        &mut self,
        instruments: &[ffi::upt_instrument],
        poses: &[ToolPose],
        out: &mut [[f32; 3]],
    ) -> Result<Step> {
        let started = Instant::now();
        self.scene.step_instruments(instruments, out)?;
        let ms = started.elapsed().as_secs_f64() * 1e3;
        let stats = self.scene.stats()?;
        let readings = self.scene.readings(instruments.len())?;
        let contacts = self.scene.instrument_contacts()?;
        let felt = readings.iter().map(|reading| Felt {
            force: reading.force.map(f64::from),
            torque: reading.torque.map(f64::from),
            contacts: reading.contact_count,
            penetration_mm: f64::from(reading.penetration_mm),
        });
        let loads = contacts.iter().map(|contact| {
            let tool = contact.instrument as usize;
            let body = &self.tools[tool].body;
            let nearest = body.nearest_at(&poses[tool].pose, Vector::from(contact.position));
            load(tool, -Vector::from(contact.force), nearest.normal)
        });
        Ok(Step {
            ms,
            contact_ms: self.scene.timing()?.contact_ms,
            flags: stats.flags,
            felt: felt.collect(),
            loads: loads.collect(),
        })
    }
}
