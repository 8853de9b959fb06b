//! Rows of the yardstick: a bundle, a way of driving it, corrections and a programme.

use gauge::median;
use host::Effort;
use serde::Serialize;
use yardstick::CaseFigures;

/// Programme of the row over all programmes without a grasp.
pub const ALL: &str = "all but grasp";

/// A row of the table.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    pub bundle: String,
    pub drive: &'static str,
    #[serde(flatten)]
    pub corrections: Effort,
    pub programme: String,
    pub cases: usize,
    /// Mean and median over the cases.
    pub mse_mean_mm2: f64,
    pub mse_median_mm2: f64,
    /// Over the programmes, the largest mean; of one programme its own.
    pub mse_worst_programme_mm2: f64,
    pub mse_with_slips_mm2: f64,
    pub slips: usize,
    pub max_error_mm: f64,
    pub min_det: f64,
    /// Share of the steps.
    pub inverted: f64,
    /// Share of the steps that are inverted without a flag.
    pub inverted_silent: f64,
    /// Worst of the cases, and the median of their worst.
    pub penetration_mm: f64,
    pub penetration_median_mm: f64,
    /// Largest motion of a node in a step over the truth's largest: median and worst of the cases.
    pub jump_median: f64,
    pub jump_worst: f64,
    /// Median over the tools of the cases.
    pub force_error: Option<f64>,
    pub torque_error: Option<f64>,
    /// Worst of the cases.
    pub friction_excess: Option<f64>,
    /// Worst of the cases, as it is and less the truth's where that is known.
    pub still_mm: Option<f64>,
    pub still_beyond_mm: Option<f64>,
    pub found_again: usize,
    /// Of the steps in which a tool touches: the whole step, and its contact solves.
    pub ms_median: Option<f64>,
    pub contact_ms_median: Option<f64>,
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// None of none.
fn middle(values: Vec<f64>) -> Option<f64> {
    (!values.is_empty()).then(|| median(values))
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, f64::max)
}

impl Row {
    /// The row of `cases`, all of one programme or [`ALL`].
    fn over(label: &Label, programme: &str, cases: &[&CaseFigures]) -> Self {
        let each = |value: fn(&CaseFigures) -> f64| -> Vec<f64> {
            cases.iter().map(|case| value(case)).collect()
        };
        let mse = each(|case| case.mse_mm2);
        let steps: usize = cases.iter().map(|case| case.steps).sum();
        let share = |count: fn(&CaseFigures) -> usize| {
            let count: usize = cases.iter().map(|case| count(case)).sum();
            count as f64 / steps.max(1) as f64
        };
        let jumps = each(|case| case.jump_mm / case.true_jump_mm.max(1e-6));
        let pooled = |value: fn(&CaseFigures) -> &[f64]| {
            middle(cases.iter().flat_map(|case| value(case)).copied().collect())
        };
        let known = |value: fn(&CaseFigures) -> Option<f64>| {
            cases.iter().filter_map(|case| value(case)).reduce(f64::max)
        };
        let mut programmes: Vec<&str> = cases.iter().map(|case| case.programme.as_str()).collect();
        programmes.sort_unstable();
        programmes.dedup();
        let worst = largest(programmes.iter().map(|programme| {
            let own = cases.iter().filter(|case| case.programme == *programme);
            mean(&own.map(|case| case.mse_mm2).collect::<Vec<_>>())
        }));
        Self {
            bundle: label.bundle.clone(),
            drive: label.drive,
            corrections: label.corrections,
            programme: programme.to_owned(),
            cases: cases.len(),
            mse_mean_mm2: mean(&mse),
            mse_median_mm2: middle(mse).unwrap_or(0.0),
            mse_worst_programme_mm2: worst,
            mse_with_slips_mm2: mean(&each(|case| case.mse_with_slips_mm2)),
            slips: cases.iter().map(|case| case.slips).sum(),
            max_error_mm: largest(each(|case| case.max_error_mm).into_iter()),
            min_det: cases.iter().map(|case| case.min_det).fold(1.0, f64::min),
            inverted: share(|case| case.inverted_steps),
            inverted_silent: share(|case| case.silent_steps),
            penetration_mm: largest(each(|case| case.penetration_mm).into_iter()),
            penetration_median_mm: middle(each(|case| case.penetration_mm)).unwrap_or(0.0),
            jump_worst: largest(jumps.iter().copied()),
            jump_median: middle(jumps).unwrap_or(0.0),
            force_error: pooled(|case| &case.force_error),
            torque_error: pooled(|case| &case.torque_error),
            friction_excess: known(|case| case.friction_excess),
            still_mm: known(|case| case.still_mm),
            still_beyond_mm: known(|case| {
                let still = case.still_mm?;
                Some((still - case.true_still_mm.unwrap_or(0.0)).max(0.0))
            }),
            found_again: cases.iter().map(|case| case.found_again).sum(),
            ms_median: pooled(|case| &case.ms),
            contact_ms_median: pooled(|case| &case.contact_ms),
        }
    }
}

/// What all rows of a method share.
#[derive(Clone, Debug)]
pub struct Label {
    pub bundle: String,
    pub drive: &'static str,
    pub corrections: Effort,
}

/// A row a programme, in the order in which they occur, and one over all but grasp where there are several.
pub fn rows(label: &Label, cases: &[CaseFigures]) -> Vec<Row> {
    let mut programmes: Vec<&str> = Vec::new();
    for case in cases {
        if !programmes.contains(&case.programme.as_str()) {
            programmes.push(&case.programme);
        }
    }
    let of = |wanted: &dyn Fn(&str) -> bool| -> Vec<&CaseFigures> {
        cases
            .iter()
            .filter(|case| wanted(&case.programme))
            .collect()
    };
    let mut rows: Vec<Row> = programmes
        .iter()
        .map(|programme| Row::over(label, programme, &of(&|name| name == *programme)))
        .collect();
    let most = of(&|name| name != "grasp");
    if programmes.len() > 1 && !most.is_empty() {
        rows.push(Row::over(label, ALL, &most));
    }
    rows
}
