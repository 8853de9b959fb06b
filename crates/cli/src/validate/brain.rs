//! Human brain: four regions in tension, compression and shear, one set of constants a region.
//!
//! Budday et al., Acta Biomaterialia 48 (2017) 319-340, as tabulated for Linka, St. Pierre and Kuhl (2023, 10.1016/j.actbio.2023.01.055).

use std::path::Path;

use anyhow::Result;
use elements::{Law, Ogden};
use gauge::median;

use super::section::{Section, verdict};
use crate::fit::data::{self, Sample};
use crate::fit::plot;
use crate::fit::stretches::best;
use crate::fit::wanted::Wanted;
use crate::materials;

/// Worst and median R² that are promised.
const BAR: [f64; 2] = [0.93, 0.97];
/// Laws of the table.
const LAWS: [(&str, Wanted); 4] = [
    ("neo-Hookean", Wanted::NeoHookean),
    ("Mooney-Rivlin", Wanted::MooneyRivlin),
    ("Ogden, 1 term", Wanted::Ogden(1)),
    ("Ogden, 2 terms", Wanted::Ogden(2)),
];

/// One row a law and region: constants, shear modulus, R² of each curve.
fn row(text: &mut String, name: &str, sample: &Sample, terms: &Ogden) -> Vec<f64> {
    let r2: Vec<f64> = sample.curves.iter().map(|curve| curve.r2(terms)).collect();
    let cells: Vec<String> = r2.iter().map(|r2| format!("{r2:.3}")).collect();
    let constants: Vec<String> = (terms.terms.iter())
        .map(|term| format!("({:.3}, {:.2})", 1e-3 * term.mu_pa, term.alpha))
        .collect();
    *text += &format!(
        "| {} | {name} | {} | {:.2} | {} |\n",
        sample.name,
        constants.join(", "),
        1e-3 * terms.shear_pa(),
        cells.join(" | ")
    );
    r2
}

pub fn section(path: &Path) -> Result<Section> {
    let samples = data::read(path)?;
    let modes: Vec<&str> = samples[0].curves.iter().map(|c| c.mode.as_str()).collect();
    let mut text = format!(
        "| region | law | mu (kPa), alpha of each term | shear modulus, kPa | R² {} |\n|---|---|---|---:|{}\n",
        modes.join(" | R² "),
        "---:|".repeat(modes.len())
    );
    let mut plots = Vec::new();
    let mut of_law: Vec<Vec<f64>> = vec![Vec::new(); LAWS.len() + 1];
    for sample in &samples {
        let mut fits = Vec::new();
        for (at, (name, wanted)) in LAWS.iter().enumerate() {
            let terms = best(&sample.curves[..], &wanted.exponents())?;
            of_law[at].extend(row(&mut text, name, sample, &terms));
            fits.push(terms);
        }
        let file = sample.name.replace(' ', "-");
        if let Ok(Law::Ogden(terms)) = materials::law(&file) {
            let name = format!("`--law {file}`");
            of_law[LAWS.len()].extend(row(&mut text, &name, sample, &terms));
        }
        let drawn = [("Ogden", &fits[2]), ("neo-Hookean", &fits[0])];
        plots.push((
            format!("reality-{file}.svg"),
            plot::draw(&sample.curves, &drawn),
        ));
    }
    text += "\n| law | R² of all curves, worst | median | bar 0.93 / 0.97 |\n|---|---:|---:|---|\n";
    let names = LAWS
        .iter()
        .map(|(name, _)| *name)
        .chain(["the named tissues of `upt materials`"]);
    for (name, r2) in names.zip(&of_law).filter(|(_, r2)| !r2.is_empty()) {
        let (worst, middle) = (r2.iter().copied().fold(f64::INFINITY, f64::min), median(r2));
        text += &format!(
            "| {name} | {worst:.3} | {middle:.3} | {} |\n",
            verdict(worst >= BAR[0] && middle >= BAR[1])
        );
    }
    Ok(Section {
        name: "brain",
        text,
        plots,
    })
}
