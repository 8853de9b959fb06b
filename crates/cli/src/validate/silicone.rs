//! Silicone tissue phantoms: a law fitted to compression up to 20 % must predict the force beyond.
//!
//! Dawood, Zhang, Suulker, Osman, Abdulali, Angelmahr and Althoefer, *Tissue Phantom Materials Database* (2026, CC BY 4.0): cylinders of 50 mm diameter
//! and 30 mm height between plates at 10 mm a minute, mean of ten tests. Read as homogeneous and incompressible; the ends are not glued.

use std::path::Path;

use anyhow::{Result, bail};
use elements::Ogden;
use gauge::median;

use super::section::{Section, verdict};
use crate::fit::curve::{Curve, Mode, nominal_stress};
use crate::fit::data::Table;
use crate::fit::plot;
use crate::fit::stretches::best;
use crate::fit::wanted::Wanted;

/// Median and worst relative error of the force that are promised.
pub const BAR: [f64; 2] = [0.05, 0.10];
/// Radius of the cylinders, mm.
pub const RADIUS_MM: f64 = 25.0;
/// Largest strain of the fit, and the largest of each range that is predicted; a margin for the rounding of the file.
pub const FITTED: f64 = 0.2 + MARGIN;
pub const PREDICTED: [f64; 2] = [0.3 + MARGIN, 0.4 + MARGIN];
const MARGIN: f64 = 1e-6;
const LAWS: [(&str, Wanted); 3] = [
    ("neo-Hookean", Wanted::NeoHookean),
    ("Mooney-Rivlin", Wanted::MooneyRivlin),
    ("Ogden, 1 term", Wanted::Ogden(1)),
];

pub struct Phantom {
    pub name: String,
    pub whole: Curve,
    pub fitted: Curve,
    /// Largest standard deviation over the mean between 20 and 30 %.
    pub spread: f64,
}

pub fn read(path: &Path) -> Result<Vec<Phantom>> {
    let table = Table::read(path)?;
    let [name, strain, force, spread] = [
        &["phantom", "sample"][..],
        &["strain"],
        &["force_n_mean", "force_n"],
        &["force_n_sd"],
    ]
    .map(|names| table.needed(names));
    let (name, strain, force, spread) = (name?, strain?, force?, spread?);
    let area = std::f64::consts::PI * RADIUS_MM * RADIUS_MM * 1e-6;
    let mut phantoms: Vec<Phantom> = Vec::new();
    for row in table.rows() {
        let (e, f) = (table.number(row, strain)?, table.number(row, force)?);
        let empty = || Curve {
            mode: Mode::Compression,
            points: Vec::new(),
        };
        if phantoms
            .last()
            .is_none_or(|phantom| phantom.name != row[name])
        {
            phantoms.push(Phantom {
                name: row[name].clone(),
                whole: empty(),
                fitted: empty(),
                spread: 0.0,
            });
        }
        let Some(phantom) = phantoms.last_mut() else {
            bail!("{}: has no phantom", path.display());
        };
        let point = [1.0 - e, -f / area];
        phantom.whole.points.push(point);
        if e <= FITTED {
            phantom.fitted.points.push(point);
        } else if e <= PREDICTED[0] {
            phantom.spread = phantom.spread.max(table.number(row, spread)? / f);
        }
    }
    for phantom in &phantoms {
        phantom
            .fitted
            .check(&format!("{}: {}", path.display(), phantom.name))?;
    }
    Ok(phantoms)
}

/// Root mean square and largest relative error of the force beyond the fit, up to a strain, of a stress by stretch.
pub fn beyond(curve: &Curve, stress: impl Fn(f64) -> f64, up_to: f64) -> [f64; 2] {
    let relative: Vec<f64> = (curve.points.iter())
        .filter(|[x, _]| 1.0 - x > FITTED && 1.0 - x <= up_to)
        .map(|[x, y]| stress(*x) / y - 1.0)
        .collect();
    let square = relative.iter().map(|e| e * e).sum::<f64>() / relative.len() as f64;
    [
        square.sqrt(),
        relative.iter().fold(0.0, |m, e| e.abs().max(m)),
    ]
}

fn errors(phantom: &Phantom, law: &Ogden, up_to: f64) -> [f64; 2] {
    let stress = |x| nominal_stress(law, Mode::Compression, x);
    beyond(&phantom.whole, stress, up_to)
}

pub fn section(path: &Path) -> Result<Section> {
    let phantoms = read(path)?;
    let mut text = String::from(
        "| law, fitted to 20 % | predicted to | error of the force, rms a phantom: median | worst | largest error at any strain: median | worst | bar 5 / 10 % (rms) |\n|---|---:|---:|---:|---:|---:|---|\n",
    );
    let mut best_law: Option<(f64, usize)> = None;
    let mut all = Vec::new();
    for (at, (name, wanted)) in LAWS.iter().enumerate() {
        let mut laws = Vec::new();
        for phantom in &phantoms {
            laws.push(best(
                std::slice::from_ref(&phantom.fitted),
                &wanted.exponents(),
            )?);
        }
        for up_to in PREDICTED {
            let found = phantoms
                .iter()
                .zip(&laws)
                .map(|(p, law)| errors(p, law, up_to));
            let (rms, most): (Vec<f64>, Vec<f64>) = found.map(|[a, b]| (a, b)).unzip();
            let worst = |list: &[f64]| list.iter().copied().fold(0.0, f64::max);
            let middle = median(&rms);
            let reached = middle <= BAR[0] && worst(&rms) <= BAR[1];
            text += &format!(
                "| {name} | {:.0} % | {:.1} % | {:.1} % | {:.1} % | {:.1} % | {} |\n",
                100.0 * up_to,
                100.0 * middle,
                100.0 * worst(&rms),
                100.0 * median(&most),
                100.0 * worst(&most),
                verdict(reached)
            );
            if up_to == PREDICTED[0] && best_law.is_none_or(|(least, _)| middle < least) {
                best_law = Some((middle, at));
            }
        }
        all.push(laws);
    }
    let chosen = best_law.map_or(0, |(_, at)| at);
    text += &format!(
        "\nEach phantom, {} (the best of the three at 30 %):\n\n| phantom | shear modulus, kPa | error to 30 %, rms | to 40 % | spread of ten tests |\n|---|---:|---:|---:|---:|\n",
        LAWS[chosen].0
    );
    for (phantom, law) in phantoms.iter().zip(&all[chosen]) {
        text += &format!(
            "| {} | {:.1} | {:.1} % | {:.1} % | {:.1} % |\n",
            phantom.name,
            1e-3 * law.shear_pa(),
            100.0 * errors(phantom, law, PREDICTED[0])[0],
            100.0 * errors(phantom, law, PREDICTED[1])[0],
            100.0 * phantom.spread
        );
    }
    // The middle one by stiffness, as a picture.
    let shears: Vec<f64> = all[chosen].iter().map(Ogden::shear_pa).collect();
    let middle = median(&shears);
    let at = (0..shears.len()).min_by(|a, b| {
        let off = |at: usize| (shears[at] - middle).abs();
        off(*a).total_cmp(&off(*b))
    });
    let plots = at.map(|at| {
        let laws = [(LAWS[chosen].0, &all[chosen][at]), (LAWS[2].0, &all[2][at])];
        let drawn = plot::draw(std::slice::from_ref(&phantoms[at].whole), &laws);
        ("reality-silicone.svg".to_owned(), drawn)
    });
    Ok(Section {
        name: "silicone",
        text,
        plots: plots.into_iter().collect(),
    })
}
