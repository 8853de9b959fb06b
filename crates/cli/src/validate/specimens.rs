//! Human brain as it was tested: cubes of 5 mm whose ends are glued to plates, so that they barrel and waist, and bend as they are sheared ([`super::glued`]).

use std::path::Path;

use anyhow::Result;
use gauge::median;

use super::glued::{self, Fit};
use super::section::{Section, verdict};
use crate::fit::data::{self, Sample};

/// R² of every curve that is promised.
const BAR: f64 = 0.90;
/// Poisson's ratios: that of the solver's tissue, the other one of Hinrichsen et al. (2023), and lower ones.
const POISSONS: [f64; 5] = [0.49, 0.45, 0.42, 0.38, 0.34];

/// The fits of a region, in the order of [`POISSONS`].
fn fits(sample: &Sample) -> Result<Vec<Fit>> {
    let given = POISSONS.iter();
    given
        .map(|poisson| glued::fit(&sample.curves, *poisson))
        .collect()
}

fn list(values: &[f64]) -> String {
    let cells: Vec<String> = values.iter().map(|v| format!("{v:.3}")).collect();
    cells.join(" | ")
}

pub fn section(path: &Path) -> Result<Section> {
    let samples = data::read(path)?;
    let modes: Vec<&str> = samples[0].curves.iter().map(|c| c.mode.as_str()).collect();
    let mut text = format!(
        "| region | Poisson's ratio | shear modulus, kPa | alpha | R² glued: {} | stress over homogeneous: {} |\n|---|---:|---:|---:|{}\n",
        modes.join(" | "),
        modes.join(" | "),
        "---:|".repeat(2 * modes.len())
    );
    let regions: Vec<Result<Vec<Fit>>> = std::thread::scope(|scope| {
        let threads: Vec<_> = (samples.iter())
            .map(|sample| scope.spawn(move || fits(sample)))
            .collect();
        let ends = threads.into_iter().map(std::thread::ScopedJoinHandle::join);
        ends.map(|end| end.unwrap_or_else(|_| anyhow::bail!("a fit ended early")))
            .collect()
    });
    let mut all = [const { Vec::new() }; POISSONS.len()];
    for (sample, region) in samples.iter().zip(regions) {
        for (fit, all) in region?.iter().zip(&mut all) {
            let tissue = fit.tissue;
            text += &format!(
                "| {} | {:.2} | {:.2} | {:.1} | {} | {} |\n",
                sample.name,
                tissue.poisson,
                1e-3 * tissue.shear_pa,
                tissue.alpha,
                list(&fit.r2),
                list(&fit.shapes),
            );
            all.extend(&fit.r2);
        }
    }
    text += "\n| glued specimens, Ogden, 1 term | R² of all curves, worst | median | bar 0.90 |\n|---|---:|---:|---|\n";
    for (poisson, all) in POISSONS.iter().zip(&all) {
        let worst = all.iter().copied().fold(f64::INFINITY, f64::min);
        text += &format!(
            "| Poisson's ratio {poisson:.2}, {} curves | {worst:.3} | {:.3} | {} |\n",
            all.len(),
            median(all),
            verdict(worst >= BAR)
        );
    }
    Ok(Section {
        name: "specimens",
        text,
        plots: Vec::new(),
    })
}
