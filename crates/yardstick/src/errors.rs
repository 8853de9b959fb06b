//! Errors of a rollout, as the paper defines them: per step, and over a case without its first step.

use tissue::metrics;

/// The paper's Hausdorff distance looks at nodes within this distance of the site at rest, mm.
pub const HAUSDORFF_RADIUS_MM: f64 = 50.0;

/// Errors of one step.
#[derive(Clone, Copy, Debug, Default, serde::Serialize)]
pub struct StepErrors {
    /// Mean over the nodes of the squared distance, mm².
    pub mse_mm2: f64,
    /// Norm of the difference over the norm of the truth, over all nodes; over a case, of all its steps together.
    pub relative_l2: f64,
    /// Mean over the nodes of the true displacement squared, mm².
    pub truth_mm2: f64,
    pub hausdorff_mm: f64,
    /// Largest over nodes and axes, mm.
    pub max_mm: f64,
}

/// Errors of a case: means over the steps from the second on; `max_mm` is the largest of them.
#[derive(Clone, Debug, Default, serde::Serialize)]
pub struct CaseErrors {
    pub overall: StepErrors,
    pub steps: Vec<StepErrors>,
}

/// Compares `predicted` with `truth`, `[K][3]` mm, on the mesh at rest.
pub fn step_errors(
    rest: &[[f32; 3]],
    truth: &[[f32; 3]],
    predicted: &[[f32; 3]],
    site: [f64; 3],
    hausdorff: bool,
) -> StepErrors {
    StepErrors {
        mse_mm2: metrics::mse_mm2(truth, predicted),
        relative_l2: metrics::relative_l2(truth, predicted),
        truth_mm2: metrics::mse_mm2(truth, &vec![[0.0; 3]; truth.len()]),
        hausdorff_mm: if hausdorff {
            metrics::hausdorff_mm(rest, truth, predicted, site, HAUSDORFF_RADIUS_MM)
        } else {
            f64::NAN
        },
        max_mm: metrics::max_error_mm(truth, predicted),
    }
}

impl CaseErrors {
    /// Averages as the paper does: the first step is excluded.
    pub fn over(steps: Vec<StepErrors>) -> Self {
        let counted = if steps.len() > 1 {
            &steps[1..]
        } else {
            &steps[..]
        };
        let mean = |value: fn(&StepErrors) -> f64| {
            counted.iter().map(value).sum::<f64>() / counted.len().max(1) as f64
        };
        let overall = StepErrors {
            mse_mm2: mean(|step| step.mse_mm2),
            relative_l2: (mean(|step| step.mse_mm2) / mean(|step| step.truth_mm2).max(1e-12))
                .sqrt(),
            truth_mm2: mean(|step| step.truth_mm2),
            hausdorff_mm: mean(|step| step.hausdorff_mm),
            max_mm: counted.iter().map(|step| step.max_mm).fold(0.0, f64::max),
        };
        Self { overall, steps }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_step_does_not_count_and_the_largest_error_is_a_maximum() {
        let step = |value: f64| StepErrors {
            mse_mm2: value,
            relative_l2: 99.0,
            truth_mm2: 8.0,
            hausdorff_mm: value,
            max_mm: value,
        };
        let case = CaseErrors::over(vec![step(100.0), step(1.0), step(3.0)]);
        assert_eq!(case.overall.relative_l2, 0.5);
        assert_eq!(case.overall.mse_mm2, 2.0);
        assert_eq!(case.overall.max_mm, 3.0);
        assert_eq!(case.steps.len(), 3);
    }
}
