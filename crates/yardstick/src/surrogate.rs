//! A bundle that steps through a recorded contact, node by node, as a host would replay it.

use std::time::Instant;

use anyhow::{Result, bail};
use upt::ffi;

use crate::bundle_folder::BundleFolder;
use host::Effort;

use crate::setting::{Precision, Provider, Region};

/// A bundle in one configuration.
pub struct Surrogate {
    scene: host::Scene,
    model: host::Model,
    /// Nodes of the region, empty for all; and the others, decoded after the timed call.
    region: Vec<u32>,
    others: Vec<u32>,
    returned: Vec<[f32; 3]>,
}

/// The settings of a replay of a trajectory whose tissue has the damping `damping_per_s`, 1/s.
pub fn settings(
    threads: u32,
    provider: Provider,
    precision: Precision,
    corrections: Effort,
    damping_per_s: f64,
) -> host::ModelSettings {
    host::ModelSettings {
        threads,
        provider: provider.code(),
        precision: precision.code(),
        exact: true,
        corrections: Some(corrections),
        // Without corrections the bundle knows one damping only: what it errs by then is part of the row.
        damping_per_s: match corrections.most {
            0 => 0.0,
            _ => damping_per_s,
        },
        ..host::ModelSettings::default()
    }
}

impl Surrogate {
    /// Opens the bundle, with a scene at rest.
    ///
    /// # Errors
    /// Those of the library, and a precision that this machine has not.
    pub fn new(
        bundle: &BundleFolder,
        settings: &host::ModelSettings,
        region: Region,
    ) -> Result<Self> {
        let model = host::Model::open(&bundle.path, settings)?;
        let mut scene = host::Scene::create(&model, ffi::UPT_KERNEL_AUTO)?;
        let count = model.info().node_count as usize;
        let region = match region {
            Region::All => Vec::new(),
            Region::Surface => model.indices(ffi::UPT_SET_SURFACE_NODES)?,
            Region::Domain => model.indices(ffi::UPT_SET_DOMAIN_NODES)?,
        };
        if !region.is_empty() {
            scene.set_region(&region)?;
        }
        let stats = scene.stats()?;
        if stats.precision != settings.precision {
            bail!(
                "{}: precision {} is not available on this machine; the library would run another",
                bundle.name,
                settings.precision
            );
        }
        let inside: std::collections::HashSet<u32> = region.iter().copied().collect();
        let others = if region.is_empty() {
            Vec::new()
        } else {
            (0..count as u32)
                .filter(|node| !inside.contains(node))
                .collect()
        };
        let returned = vec![[0.0; 3]; region.len()];
        Ok(Self {
            scene,
            model,
            region,
            others,
            returned,
        })
    }

    /// Nodes that a step returns.
    pub fn decoded(&self) -> usize {
        if self.region.is_empty() {
            self.model.info().node_count as usize
        } else {
            self.region.len()
        }
    }

    /// One step; its wall time in ms. `out` `[K]` holds the whole field after it.
    pub fn step(
        &mut self,
        nodes: &[u32],
        vectors: &[[f32; 3]],
        out: &mut [[f32; 3]],
    ) -> Result<f64> {
        let started = Instant::now();
        if self.region.is_empty() {
            self.scene.step(nodes, vectors, out)?;
            return Ok(started.elapsed().as_secs_f64() * 1e3);
        }
        self.scene.step(nodes, vectors, &mut self.returned)?;
        let elapsed = started.elapsed().as_secs_f64() * 1e3;
        // The rest of the field is decoded outside the timed call, so that all rows are judged on all nodes.
        let mut rest = vec![[0.0; 3]; self.others.len()];
        self.scene.decode(&self.others, &mut rest)?;
        for (list, values) in [(&self.region, &self.returned), (&self.others, &rest)] {
            for (node, value) in list.iter().zip(values) {
                out[*node as usize] = *value;
            }
        }
        Ok(elapsed)
    }

    /// Back to rest.
    pub fn reset(&mut self) -> Result<()> {
        self.scene.reset()
    }

    /// What the last step came to.
    pub fn stats(&self) -> Result<ffi::upt_scene_stats> {
        self.scene.stats()
    }

    /// How long it took.
    pub fn timing(&self) -> Result<ffi::upt_scene_timing> {
        self.scene.timing()
    }

    /// Estimated error of the last corrected step, root mean square over all nodes, mm; none without corrections.
    pub fn estimated_mm(&self) -> Result<Option<f32>> {
        let stats = self.scene.stats()?;
        Ok((stats.corrections > 0).then_some(stats.error_mm))
    }

    /// Force of the tissue on the instruments at the `count` contact nodes of the last step, mN.
    pub fn contact_force(&mut self, count: usize) -> Result<Vec<[f32; 3]>> {
        self.scene.contact_force(count)
    }

    /// Host memory that the library says it holds, MB.
    pub fn memory_mb(&self) -> Result<f64> {
        let bytes = self.model.info().memory_bytes + self.scene.stats()?.memory_bytes;
        Ok(bytes as f64 / 1e6)
    }
}
