//! Rows of the yardstick: a bundle, a way of driving it, corrections and a programme.

use serde::Serialize;

use super::cases::ToolCase;
use super::drive::Felt;
use super::measure::{Moment, Outcome, Truth};
use crate::effort::Effort;
use crate::quantile::median;

/// Programme of the row over all programmes without a grasp.
pub const ALL: &str = "all but grasp";
const INVERTED: u32 = upt::ffi::UPT_FLAG_INVERTED | upt::ffi::UPT_FLAG_FELL_BACK;

/// The figures of one case.
#[derive(Clone, Debug, Serialize)]
pub struct CaseFigures {
    pub case: String,
    pub programme: String,
    pub steps: usize,
    /// Over the steps without those of slip-offs.
    pub mse_mm2: f64,
    /// Over all steps.
    pub mse_with_slips_mm2: f64,
    pub slips: usize,
    pub max_error_mm: f64,
    pub min_det: f64,
    pub inverted_steps: usize,
    /// Of them, steps without a flag that says so.
    pub silent_steps: usize,
    pub penetration_mm: f64,
    pub jump_mm: f64,
    pub true_jump_mm: f64,
    /// Relative L2 error over the steps, by tool.
    pub force_error: Vec<f64>,
    pub torque_error: Vec<f64>,
    pub friction_excess: Option<f64>,
    pub still_mm: Option<f64>,
    pub true_still_mm: Option<f64>,
    pub found_again: usize,
    /// By tool and step, of the tissue on the tool.
    pub force_mn: Vec<Vec<[f32; 3]>>,
    /// By step.
    pub mse_by_step_mm2: Vec<f32>,
    #[serde(skip)]
    pub ms: Vec<f64>,
    #[serde(skip)]
    pub contact_ms: Vec<f64>,
}

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

impl CaseFigures {
    pub fn of(case: &ToolCase, truth: &Truth, outcome: &Outcome) -> Self {
        let moments = &outcome.moments;
        let counted = |slips: bool| {
            let own = moments.iter().zip(&truth.slip);
            let (sum, count) = own
                .filter(|(_, slip)| slips || !**slip)
                .fold((0.0, 0.0f64), |(sum, count), (m, _)| {
                    (sum + m.mse_mm2, count + 1.0)
                });
            sum / count.max(1.0)
        };
        let touching = || {
            let touches = |m: &&Moment| m.felt.iter().any(|felt| felt.contacts > 0);
            moments.iter().filter(touches)
        };
        let inverted = || moments.iter().filter(|m| m.det <= 0.0);
        let apart = |value: &dyn Fn(usize) -> f64| {
            let steps = (0..moments.len()).filter(|step| !truth.slip[*step]);
            steps.map(value).fold(0.0, f64::max)
        };
        let tools = case.tools.len();
        let error = |value: fn(&Felt) -> [f64; 3]| -> Vec<f64> {
            let each = (0..tools).map(|tool| relative(truth, outcome, tool, value));
            each.flatten().collect()
        };
        Self {
            case: case.name.clone(),
            programme: case.programme.clone(),
            steps: moments.len(),
            mse_mm2: counted(false),
            mse_with_slips_mm2: counted(true),
            slips: truth.slips,
            max_error_mm: apart(&|step| moments[step].error_mm),
            min_det: moments.iter().map(|m| m.det).fold(1.0, f64::min),
            inverted_steps: inverted().count(),
            silent_steps: inverted().filter(|m| m.flags & INVERTED == 0).count(),
            penetration_mm: moments.iter().map(|m| m.penetration_mm).fold(0.0, f64::max),
            jump_mm: apart(&|step| moments[step].jump_mm),
            true_jump_mm: apart(&|step| truth.jump[step]),
            force_error: error(|felt| felt.force),
            torque_error: error(|felt| felt.torque),
            friction_excess: outcome.friction_excess,
            still_mm: outcome.still_mm,
            true_still_mm: truth.still_mm,
            found_again: (0..tools)
                .map(|tool| {
                    let own = found_again(moments.iter().map(|m| m.felt[tool].contacts));
                    let true_count = found_again(truth.felt.iter().map(|felt| felt[tool].contacts));
                    own.saturating_sub(true_count)
                })
                .sum(),
            force_mn: (0..tools)
                .map(|tool| {
                    let forces = moments.iter().map(|m| m.felt[tool].force);
                    forces.map(|force| force.map(|v| v as f32)).collect()
                })
                .collect(),
            mse_by_step_mm2: moments.iter().map(|m| m.mse_mm2 as f32).collect(),
            ms: touching().map(|m| m.ms).collect(),
            contact_ms: touching().map(|m| m.contact_ms).collect(),
        }
    }

    /// The truth's own figures, where a prediction's have a meaning for it.
    pub fn of_truth(case: &ToolCase, truth: &Truth) -> Self {
        let largest = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
        let dets = case.trajectory.min_det_f.iter().copied();
        Self {
            case: case.name.clone(),
            programme: case.programme.clone(),
            steps: truth.jump.len(),
            mse_mm2: 0.0,
            mse_with_slips_mm2: 0.0,
            slips: truth.slips,
            max_error_mm: 0.0,
            min_det: f64::from(dets.fold(1.0, f32::min)),
            inverted_steps: 0,
            silent_steps: 0,
            penetration_mm: largest(&truth.penetration),
            jump_mm: largest(&truth.jump),
            true_jump_mm: largest(&truth.jump),
            force_error: Vec::new(),
            torque_error: Vec::new(),
            friction_excess: truth.friction_excess,
            still_mm: truth.still_mm,
            true_still_mm: truth.still_mm,
            found_again: 0,
            force_mn: (0..case.tools.len())
                .map(|tool| {
                    let forces = truth.felt.iter().map(|felt| felt[tool].force);
                    forces.map(|force| force.map(|v| v as f32)).collect()
                })
                .collect(),
            mse_by_step_mm2: vec![0.0; truth.jump.len()],
            ms: Vec::new(),
            contact_ms: Vec::new(),
        }
    }
}

/// Relative L2 error of a tool's force or torque over the steps without slip-offs; none where the truth has none.
fn relative(
    truth: &Truth,
    outcome: &Outcome,
    tool: usize,
    value: fn(&Felt) -> [f64; 3],
) -> Option<f64> {
    let (mut wrong, mut all) = (0.0, 0.0);
    for (step, moment) in outcome.moments.iter().enumerate() {
        if truth.slip[step] {
            continue;
        }
        let (a, b) = (value(&truth.felt[step][tool]), value(&moment.felt[tool]));
        for k in 0..3 {
            wrong += (a[k] - b[k]).powi(2);
            all += a[k].powi(2);
        }
    }
    (all > 0.0).then(|| (wrong / all).sqrt())
}

/// Steps at which contact begins after it was lost.
fn found_again(contacts: impl Iterator<Item = u32>) -> usize {
    let (mut touched, mut lost, mut count) = (false, false, 0);
    for contacts in contacts {
        let touches = contacts > 0;
        count += usize::from(lost && touches && !touched);
        lost |= touched && !touches;
        touched = touches;
    }
    count
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contact_found_again_counts_after_a_loss_only() {
        assert_eq!(found_again([0, 3, 3, 0, 0].into_iter()), 0);
        assert_eq!(found_again([0, 3, 0, 2, 1, 0, 4].into_iter()), 2);
    }
}
