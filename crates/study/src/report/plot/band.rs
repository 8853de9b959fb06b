//! Error over time: the mean over the cases and the band from the best to the worst case.

use picture::plot::colour;
use picture::plot::{Axes, Scale, legend};

/// One method's error at each step.
pub struct Band {
    pub name: String,
    /// Smallest, mean and largest error over the cases, a row a step, mm².
    pub steps: Vec<[f64; 3]>,
}

/// MSE (log) against time; `dt` is the step, s. Values below 1e-6 mm² are drawn at that floor.
pub fn error_over_time(bands: &[Band], dt: f64) -> String {
    const FLOOR: f64 = 1e-6;
    let longest = bands.iter().map(|band| band.steps.len()).max().unwrap_or(1);
    let values = bands
        .iter()
        .flat_map(|band| band.steps.iter().skip(1))
        .flat_map(|row| row.map(|value| value.max(FLOOR)));
    let mut axes = Axes::new(
        860.0,
        400.0,
        Scale::linear(0.0, longest as f64 * dt),
        Scale::log(values),
        "time, s",
        "MSE, mm² (mean; band: best to worst case)",
    );
    let mut entries = Vec::new();
    for (index, band) in bands.iter().enumerate() {
        let rows: Vec<(f64, [f64; 3])> = band
            .steps
            .iter()
            .enumerate()
            .map(|(step, row)| ((step + 1) as f64 * dt, row.map(|value| value.max(FLOOR))))
            .collect();
        let area: Vec<(f64, f64, f64)> = rows
            .iter()
            .map(|(time, row)| (*time, row[0], row[2]))
            .collect();
        let line: Vec<(f64, f64)> = rows.iter().map(|(time, row)| (*time, row[1])).collect();
        axes.area(&area, colour(index));
        axes.line(&line, colour(index), 2.0, false);
        entries.push((band.name.clone(), colour(index)));
    }
    legend(&entries) + &axes.finish()
}
