//! The reference solver's state at any moment, between recorded frames that are shorter than a step.

use anyhow::{Result, bail};
use contact::{Pose, pose};
use tissue::schemes::FRAME_S;
use tissue::solver::ToolPose;

use yardstick::cases::{ToolCase, ToolCases};
use yardstick::measure::{SLIP_MM, SLIP_WINDOW};
use yardstick::yard::jump;

/// A case's frames in time.
pub struct Truth {
    /// Recorded frames in a step.
    pub parts: usize,
    /// Steps of the case.
    pub steps: usize,
    /// By step, the first is that from rest: whether it lies in a slip-off.
    slip: Vec<bool>,
}

impl Truth {
    /// # Errors
    /// Those of a case.
    pub fn of_all(cases: &ToolCases) -> Result<Vec<Self>> {
        cases.list.iter().map(Self::of).collect()
    }

    /// # Errors
    /// Frames that are as long as a step, or no whole part of one.
    pub fn of(case: &ToolCase) -> Result<Self> {
        let frame_s = case.trajectory.header.dt_s;
        let parts = (FRAME_S / frame_s).round() as usize;
        if parts < 2 || (parts as f64 * frame_s - FRAME_S).abs() > 1e-9 {
            bail!(
                "{}: field `dt_s` is {frame_s}; measuring what is shown between steps needs shorter frames: `upt dataset --tools all --frame-ms 5`",
                case.name
            );
        }
        let steps = (case.poses.len() - 1) / parts;
        let mut slip = vec![false; steps];
        let (before, after) = SLIP_WINDOW;
        for step in 1..=steps {
            let [from, to] = [parts * (step - 1), parts * step];
            let pairs = case.poses[from].iter().zip(&case.poses[to]);
            let motion = pairs
                .zip(&case.bodies)
                .map(|((from, to), body)| body.motion(&from.pose, &to.pose))
                .fold(0.0, f32::max);
            let way = jump(case.trajectory.frame(from), case.trajectory.frame(to));
            let tears = (from + 1..=to).any(|frame| case.tears(frame));
            if tears || case.touches(from) && way > f64::from(motion) + SLIP_MM {
                slip[(step - 1).saturating_sub(before)..(step + after).min(steps)].fill(true);
            }
        }
        Ok(Self { parts, steps, slip })
    }

    /// Length of the case, s.
    pub fn seconds(&self) -> f64 {
        self.steps as f64 * FRAME_S
    }

    /// Whether a moment lies in a step around a slip-off; what is drawn there comes from it or from one step before.
    pub fn slips(&self, seconds: f64) -> bool {
        let step = (seconds / FRAME_S - 1e-9).floor().max(0.0) as usize;
        self.slip[step.min(self.steps - 1)]
    }

    fn place(&self, case: &ToolCase, seconds: f64) -> (usize, f32) {
        let at = (seconds / FRAME_S * self.parts as f64).max(0.0);
        let last = case.poses.len() - 1;
        let frame = ((at + 1e-9).floor() as usize).min(last);
        let part = (at - frame as f64).max(0.0);
        match frame == last || part < 1e-6 {
            true => (frame, 0.0),
            false => (frame, part as f32),
        }
    }

    /// The displacements at a moment, mm.
    pub fn field(&self, case: &ToolCase, seconds: f64, out: &mut [[f32; 3]]) {
        let (frame, part) = self.place(case, seconds);
        out.copy_from_slice(case.trajectory.frame(frame));
        if part > 0.0 {
            let next = case.trajectory.frame(frame + 1);
            for (out, next) in out.as_flattened_mut().iter_mut().zip(next.as_flattened()) {
                *out += part * (next - *out);
            }
        }
    }

    /// The tools' poses at a moment.
    pub fn poses(&self, case: &ToolCase, seconds: f64) -> Vec<ToolPose> {
        let (frame, part) = self.place(case, seconds);
        let next = &case.poses[(frame + 1).min(case.poses.len() - 1)];
        let pairs = case.poses[frame].iter().zip(next);
        pairs
            .map(|(from, to)| ToolPose {
                pose: pose::between(&from.pose, &to.pose, part),
                grasp: if part > 0.0 { to.grasp } else { from.grasp },
            })
            .collect()
    }
}

/// Poses without what the hand does.
pub fn places(poses: &[ToolPose]) -> Vec<Pose> {
    poses.iter().map(|to| to.pose).collect()
}
