//! The plots of `upt-study compare`, SVG files that stand alone.

use std::path::Path;

use anyhow::{Context, Result};

use super::observer::{Moment, Series};
use picture::plot::{Axes, Scale, colour};

/// Below this a value is drawn at the bottom of a logarithmic axis.
const FLOOR: f64 = 1e-5;
const STEP_S: f64 = 0.05;

/// Size of the field in both and the error, against steps.
pub fn run(path: &Path, moments: &[Moment]) -> Result<()> {
    let lines: [Series; 3] = [
        ("largest |u| of the solver, mm", |m| m.true_size),
        ("largest |u| of the bundle, mm", |m| m.size),
        ("MSE, mm²", |m| m.mse),
    ];
    draw(path, moments, 1.0, "step", &lines)
}

/// Displacement and energy after a release, against time.
pub fn release(path: &Path, moments: &[Moment]) -> Result<()> {
    let lines: [Series; 3] = [
        ("largest |u| of the solver, mm", |m| m.true_size),
        ("largest |u| of the bundle, mm", |m| m.size),
        ("strain and kinetic energy of the solver, mJ", |m| m.energy),
    ];
    draw(path, moments, STEP_S, "time, s (released at 1 s)", &lines)
}

fn draw(path: &Path, moments: &[Moment], unit: f64, x_label: &str, lines: &[Series]) -> Result<()> {
    let values = moments
        .iter()
        .flat_map(|m| lines.iter().map(|(_, value)| value(m).max(FLOOR)));
    let mut axes = Axes::new(
        1000.0,
        380.0,
        Scale::linear(0.0, moments.len() as f64 * unit),
        Scale::log(values),
        x_label,
        "mm, mm² or mJ",
    );
    for (index, (_, value)) in lines.iter().enumerate() {
        let points: Vec<(f64, f64)> = moments
            .iter()
            .enumerate()
            .map(|(step, m)| ((step + 1) as f64 * unit, value(m).max(FLOOR)))
            .collect();
        axes.line(&points, colour(index), 1.4, false);
    }
    let keys: Vec<(&str, &str)> = (lines.iter().enumerate())
        .map(|(index, (name, _))| (*name, colour(index)))
        .collect();
    std::fs::write(path, axes.standalone(&keys)).with_context(|| format!("{}", path.display()))
}
