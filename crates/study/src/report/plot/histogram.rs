//! The distribution of step times, one curve a method over logarithmic bins.

use picture::plot::colour;
use picture::plot::{Axes, Scale, legend};

/// Times of single steps, ms.
pub struct Latencies {
    pub name: String,
    pub milliseconds: Vec<f64>,
}

pub fn latency_histogram(series: &[Latencies]) -> String {
    const BINS: usize = 90;
    let x = Scale::log(
        series
            .iter()
            .flat_map(|one| one.milliseconds.iter().copied()),
    );
    let counted: Vec<Vec<f64>> = series
        .iter()
        .map(|one| {
            let mut bins = vec![0.0; BINS];
            for value in &one.milliseconds {
                bins[((x.share(*value) * BINS as f64) as usize).min(BINS - 1)] +=
                    100.0 / one.milliseconds.len() as f64;
            }
            bins
        })
        .collect();
    let highest = counted.iter().flatten().copied().fold(1.0, f64::max);
    let mut axes = Axes::new(
        860.0,
        320.0,
        x,
        Scale::linear(0.0, highest),
        "ms a step",
        "share of the steps, %",
    );
    let ratio = (x.high() / x.low()).ln() / BINS as f64;
    let edge = |bin: usize| x.low() * (ratio * bin as f64).exp();
    let mut entries = Vec::new();
    for (index, bins) in counted.iter().enumerate() {
        let area: Vec<(f64, f64, f64)> = (0..BINS)
            .flat_map(|bin| [(edge(bin), 0.0, bins[bin]), (edge(bin + 1), 0.0, bins[bin])])
            .collect();
        let line: Vec<(f64, f64)> = area.iter().map(|row| (row.0, row.2)).collect();
        axes.area(&area, colour(index));
        if line.len() > 1 {
            axes.line(&line, colour(index), 1.5, false);
        }
        entries.push((series[index].name.clone(), colour(index)));
    }
    legend(&entries) + &axes.finish()
}
