//! A row of the report and all that was measured for it.

use host::Effort;
use serde::{Deserialize, Serialize};

/// The method of rows that run a bundle's linear response without what the bundle learned.
pub const PRIOR_ALONE: &str = "linear response alone";

/// One line of `report.json`: a method in one configuration, over all cases.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Row {
    /// `surrogate`, `paper split in ONNX Runtime`, `linear response alone`, `predict zero`, `linear elastic`, `coarse TLED`, `TLED`.
    pub method: String,
    /// The bundle's name; empty for plain methods.
    pub bundle: String,
    /// SHA-256 of the bundle's manifest; empty for plain methods.
    pub bundle_sha256: String,
    pub provider: String,
    pub precision: String,
    /// The nodes that each step decodes: `all`, `surface`, `domain`.
    pub region: String,
    pub boundary: String,
    /// Corrections a step in contact; 0 for none and for other methods.
    #[serde(flatten)]
    pub corrections: Effort,
    pub threads: u32,
    /// Nodes of the mesh, `K`.
    pub nodes: u64,
    /// Nodes that a step returns.
    pub decoded: u64,
    pub cases: u64,
    /// Mean and standard deviation over the cases.
    pub mse_mm2: f64,
    pub mse_std: f64,
    pub relative_l2: f64,
    /// None where it was left out.
    pub hausdorff_mm: Option<f64>,
    pub hausdorff_std: Option<f64>,
    pub max_mm: f64,
    pub max_std: f64,
    /// Of single steps of 50 ms of tissue, wall time.
    pub ms_p50: f64,
    pub ms_p95: f64,
    pub ms_p99: f64,
    pub ms_max: f64,
    pub first_step_ms: f64,
    /// Opening and making ready to step.
    pub load_s: f64,
    /// What the library says it holds; for other methods the growth of resident memory from before loading to after the
    /// last step (0 where the system does not tell).
    pub memory_mb: f64,
    /// Largest difference from the float32 path of the same bundle over a rollout, mm; none for plain methods.
    pub deviation: Option<f64>,
}

/// Error of one frame that a picture shows.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Pictured {
    pub case: usize,
    pub step: usize,
    /// `[K][3]`, mm.
    pub displacement: Vec<[f32; 3]>,
}

/// A row with the data behind its figures.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Measurement {
    pub row: Row,
    /// Smallest, mean and largest MSE over the cases, a row a step, mm².
    pub curve: Vec<[f64; 3]>,
    /// ms of every timed step.
    pub latencies: Vec<f64>,
    /// Mean ms of each stage, where the library tells.
    pub stages: Vec<(String, f64)>,
    pub pictured: Vec<Pictured>,
}

impl Row {
    /// A short name for legends: what it is, without what all share.
    pub fn family(&self) -> String {
        match (self.method.as_str(), self.bundle.as_str()) {
            ("surrogate", bundle) if self.corrections.most > 0 => {
                format!("{bundle}, k = {}", self.corrections)
            }
            ("surrogate", bundle) => bundle.to_owned(),
            (method, "") => method.to_owned(),
            (method, bundle) => format!("{bundle}, {method}"),
        }
    }

    /// The family without its number of corrections, and that number, for rows of a bundle: the points of one curve.
    pub fn curve(&self) -> Option<(String, Effort)> {
        (self.method == "surrogate").then(|| (self.bundle.clone(), self.corrections))
    }

    /// What distinguishes a row within its family.
    pub fn variant(&self) -> String {
        let threads = if self.threads == 1 {
            "1 thread".into()
        } else {
            format!("{} threads", self.threads)
        };
        if self.is_plain() {
            return threads;
        }
        format!(
            "{} {} {}, {threads}",
            self.provider, self.precision, self.region
        )
    }

    /// Nothing learned is in it.
    pub fn is_plain(&self) -> bool {
        self.bundle.is_empty() || self.method == PRIOR_ALONE
    }
}

/// Mean and (population) standard deviation.
pub fn mean_and_deviation(values: &[f64]) -> (f64, f64) {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values
        .iter()
        .map(|value| (value - mean).powi(2))
        .sum::<f64>()
        / count;
    (mean, variance.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deviation_is_of_the_population() {
        assert_eq!(mean_and_deviation(&[1.0, 3.0]), (2.0, 1.0));
    }
}
