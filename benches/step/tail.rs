//! Where the slowest steps lose their time: each stage in the slowest hundredth against its own median.

use upt::SceneTiming;

use gauge::median;

const STAGES: [&str; 8] = [
    "check",
    "prior",
    "encode",
    "aggregate",
    "latent",
    "decode",
    "guard",
    "rest",
];

/// A step's time and that of its stages, ms.
type Sample = (f64, [f64; STAGES.len()]);

/// Stage times of many steps.
#[derive(Default)]
pub struct Tail {
    steps: Vec<Sample>,
}

impl Tail {
    /// Notes a step that took `ms` by the clock outside.
    pub fn push(&mut self, ms: f64, s: &SceneTiming) {
        let own = [
            s.check_ms,
            s.prior_ms,
            s.encode_ms,
            s.aggregate_ms,
            s.latent_ms,
            s.decode_ms,
            s.guard_ms,
        ];
        let mut stages = [0.0; STAGES.len()];
        stages[..own.len()].copy_from_slice(&own);
        stages[own.len()] = ms - own.iter().sum::<f64>();
        self.steps.push((ms, stages));
    }

    /// Mean excess of each stage in the slowest hundredth of the steps over its median, as text.
    pub fn text(&mut self) -> String {
        self.steps.sort_by(|a, b| a.0.total_cmp(&b.0));
        let middle = self.steps[self.steps.len() / 2].0;
        let slowest = &self.steps[self.steps.len() * 99 / 100..];
        let mean = |pick: &dyn Fn(&Sample) -> f64| {
            slowest.iter().map(pick).sum::<f64>() / slowest.len() as f64
        };
        let mut text = format!(
            "slowest {} of {} steps: {:+.3} ms over the median of {middle:.3}",
            slowest.len(),
            self.steps.len(),
            mean(&|step| step.0) - middle
        );
        for (at, name) in STAGES.iter().enumerate() {
            let usual = median(self.steps.iter().map(|step| step.1[at]));
            let excess = mean(&|step| step.1[at]) - usual;
            if excess.abs() > 0.01 * middle {
                text += &format!(", {name} {excess:+.3}");
            }
        }
        text
    }
}
