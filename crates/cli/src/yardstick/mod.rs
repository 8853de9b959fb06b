//! The yardstick from pose to picture: the library is driven by the poses of rigid tools alone, step by step from its own last
//! state, and is measured by the reference solver's answer to the same poses.
//!
//! | module | what |
//! |---|---|
//! | [`cases`] | trajectories with tools |
//! | [`drive`] | how the library is driven |
//! | [`yard`] | det F and penetration of one state |
//! | [`measure`], [`CaseFigures`] | a case, step by step, and what it came to |

pub mod cases;
pub mod drive;
mod figures;
pub mod measure;
pub mod prior_alone;
pub mod yard;

use anyhow::{Context, Result};
use tissue::mesh::{Boundary, Mesh};

use crate::bundle_folder::BundleFolder;
use crate::effort::Effort;
use crate::{host, progress};
use cases::ToolCases;
use drive::{Drive, Driver};
pub use figures::CaseFigures;
use measure::{Outcome, Truth};
use yard::Yard;

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
        let bar = progress::cases(cases.list.len(), &self.name());
        let (mut outcomes, mut figures) = (Vec::new(), Vec::new());
        for (case, truth) in cases.list.iter().zip(truths) {
            let outcome = measure::measure(case, truth, &mut driver, yard)
                .with_context(|| case.name.clone())?;
            figures.push(CaseFigures::of(case, truth, &outcome));
            outcomes.push(outcome);
            bar.inc(1);
        }
        bar.finish_and_clear();
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
    Ok(method.measure(threads, cases, mesh, &truths, &mut yard)?.1)
}
