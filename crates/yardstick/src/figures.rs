//! What a case through the library came to, beside the reference solver's answer to the same poses.

use serde::Serialize;

use super::cases::ToolCase;
use super::drive::Felt;
use super::measure::{Moment, Outcome, Truth};

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contact_found_again_counts_after_a_loss_only() {
        assert_eq!(found_again([0, 3, 3, 0, 0].into_iter()), 0);
        assert_eq!(found_again([0, 3, 0, 2, 1, 0, 4].into_iter()), 2);
    }
}
