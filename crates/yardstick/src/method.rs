//! A bundle in one configuration, through all cases: driven by the poses of rigid tools alone, step by step from its own last state,
//! and measured by the reference solver's answer to the same poses.

use anyhow::{Context, Result};
use host::Effort;
use tissue::mesh::{Boundary, Mesh};

use crate::bundle_folder::BundleFolder;
use crate::cases::ToolCases;
use crate::drive::{Drive, Driver};
use crate::figures::CaseFigures;
use crate::measure::{self, Outcome, Truth};
use crate::watch::Watch;
use crate::yard::Yard;

/// A bundle in one configuration.
pub struct Method {
    pub bundle: BundleFolder,
    pub drive: Drive,
    pub corrections: Effort,
}

impl Method {
    pub fn name(&self) -> String {
        if self.drive == Drive::Linear {
            return format!("{}, {}", self.bundle.name, self.drive.name());
        }
        format!(
            "{}, {}, k = {}",
            self.bundle.name,
            self.drive.name(),
            self.corrections
        )
    }

    /// Drives all cases, whose truths are measured already.
    ///
    /// # Errors
    /// Names the case or the bundle.
    pub fn measure(
        &self,
        threads: u32,
        cases: &ToolCases,
        mesh: &Mesh,
        truths: &[Truth],
        yard: &mut Yard,
        watch: &Watch,
    ) -> Result<(Vec<Outcome>, Vec<CaseFigures>)> {
        let settings = host::ModelSettings {
            threads,
            corrections: Some(self.corrections),
            ..host::ModelSettings::default()
        };
        let model = host::Model::open(&self.bundle.path, &settings)?;
        let mut driver = match self.drive {
            Drive::Linear => Driver::of_linear(
                &model,
                &self.bundle,
                mesh,
                cases.boundary.parse().map_err(anyhow::Error::msg)?,
                cases.release_decay(),
                threads,
            )?,
            drive => Driver::new(&model, drive)?,
        };
        let bar = watch.bar(cases.list.len() as u64, &self.name());
        let (mut outcomes, mut figures) = (Vec::new(), Vec::new());
        for (case, truth) in cases.list.iter().zip(truths) {
            let outcome = measure::measure(case, truth, &mut driver, yard)
                .with_context(|| case.name.clone())?;
            figures.push(CaseFigures::of(case, truth, &outcome));
            outcomes.push(outcome);
            bar.inc(1);
        }
        Ok((outcomes, figures))
    }
}

/// The figures of a bundle that tools drive, with `corrections` a step, case by case.
///
/// # Errors
/// Names the case or the bundle.
pub fn solved(
    bundle: &BundleFolder,
    corrections: Effort,
    cases: &ToolCases,
    mesh: &Mesh,
    threads: u32,
    watch: &Watch,
) -> Result<Vec<CaseFigures>> {
    let boundary: Boundary = cases.boundary.parse().map_err(anyhow::Error::msg)?;
    let mut yard = Yard::new(mesh, boundary);
    let truth = |case| Truth::of(case, mesh, boundary, &mut yard);
    let truths: Vec<Truth> = cases.list.iter().map(truth).collect();
    let method = Method {
        bundle: bundle.clone(),
        drive: Drive::Solved,
        corrections,
    };
    let (_, figures) = method.measure(threads, cases, mesh, &truths, &mut yard, watch)?;
    Ok(figures)
}
