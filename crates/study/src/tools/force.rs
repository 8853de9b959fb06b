//! Force over time at each tool: the truth, and each way of driving the library.

use super::section::TRUTH;
use picture::plot::{Axes, Scale, escape};
use yardstick::cases::ToolCase;
use yardstick::drive::Felt;
use yardstick::measure::{Outcome, Truth};

fn size(felt: &Felt) -> f64 {
    felt.force.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// One plot a tool; `shown` are predictions with their colours.
pub fn plots(case: &ToolCase, truth: &Truth, shown: &[(&Outcome, &str)]) -> String {
    let dt = case.trajectory.header.dt_s;
    let tools = 0..case.tools.len();
    let plots = tools.map(|tool| {
        let steps = truth.felt.len();
        let line = |force: &dyn Fn(usize) -> f64| -> Vec<(f64, f64)> {
            let points = (0..steps).map(|step| ((step + 1) as f64 * dt, force(step)));
            points.collect()
        };
        let true_line = line(&|step| size(&truth.felt[step][tool]));
        // A prediction that leaves the plot is drawn at its edge: what the truth does stays readable.
        let top = true_line.iter().map(|at| at.1).fold(1.0, f64::max);
        let mut axes = Axes::new(
            640.0,
            240.0,
            Scale::linear(0.0, steps as f64 * dt),
            Scale::linear(0.0, 1.6 * top),
            "time, s",
            "force, mN",
        );
        axes.line(&true_line, TRUTH, 3.0, false);
        for (outcome, colour) in shown {
            let own = line(&|step| size(&outcome.moments[step].felt[tool]));
            axes.line(&own, colour, 1.6, false);
        }
        let caption = match case.tools.len() {
            1 => "Force on the tool".to_owned(),
            _ => format!("Force on tool {}", tool + 1),
        };
        format!(
            "<figure>{}<figcaption>{}</figcaption></figure>",
            axes.finish(),
            escape(&caption)
        )
    });
    plots.collect()
}
