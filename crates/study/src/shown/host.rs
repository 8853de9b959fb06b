//! One case through a virtual host: steps every 50 ms, states that arrive a while later, frames at an even rate.

use anyhow::{Result, bail};
use tissue::metrics;
use tissue::schemes::FRAME_S;

use super::truth::{Truth, places};
use yardstick::cases::ToolCase;
use yardstick::drive::Driver;
use yardstick::yard::{Yard, jump};

/// Ways to draw a frame.
pub const WAYS: [&str; 3] = [
    "one step late (`sample`)",
    "last state",
    "`upt_scene_present`",
];
pub const LATE: usize = 0;
pub const LAST: usize = 1;
pub const PRESENT: usize = 2;
/// Latencies that are tried, ms.
const LATENCIES_MS: [i32; 3] = [-20, 120, 5];

/// When the host does what.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    pub frame_s: f64,
    pub arrival_s: f64,
    /// Length of a step.
    pub step_s: f64,
}

impl Clock {
    /// # Errors
    /// A rate or a delay that no host has.
    pub fn new(hz: f64, arrival_ms: f64) -> Result<Self> {
        if !(hz.is_finite() && (1.0..=2000.0).contains(&hz)) {
            bail!("--shown is {hz}; it must be 1 to 2000 frames a second");
        }
        if !(0.0..1e3 * FRAME_S).contains(&arrival_ms) {
            bail!(
                "--arrival-ms is {arrival_ms}; it must be 0 or more and less than a step of {} ms",
                1e3 * FRAME_S
            );
        }
        Ok(Self {
            frame_s: 1.0 / hz,
            arrival_s: 1e-3 * arrival_ms,
            step_s: FRAME_S,
        })
    }

    /// The same with steps of another length.
    pub fn stepping(self, step_s: f64) -> Self {
        Self { step_s, ..self }
    }

    /// The step whose state has arrived last at a moment; 0 is rest.
    pub fn arrived(&self, seconds: f64) -> usize {
        ((seconds - self.arrival_s + 1e-9) / self.step_s)
            .max(0.0)
            .floor() as usize
    }
}

/// A frame, in one of the [`WAYS`].
#[derive(Clone, Copy, Debug, Default)]
pub struct Drawn {
    pub mse_mm2: f64,
    pub penetration_mm: f64,
    /// What the arrival of a state changed at the very moment of it, mm; 0 in frames without one.
    pub jump_mm: f64,
    /// How far a node went from the frame before, compared with how far it went in truth, mm.
    pub unlike_mm: f64,
}

/// A frame in all ways.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    pub seconds: f64,
    pub slips: bool,
    pub drawn: [Drawn; 3],
    /// Deepest point of the truth in a tool, mm.
    pub true_penetration_mm: f64,
}

/// A case as it was shown.
pub struct Shown {
    pub frames: Vec<Frame>,
    /// By step: its own error at its own time, mm²; slip-offs left out.
    pub step_mse_mm2: Vec<f64>,
    /// The delay by which the frames resemble the truth most, ms, in each way.
    pub latency_ms: [f64; 3],
    /// Frames on the grid of the truth, kept for pictures: moment, and the field in each way.
    pub pictured: Vec<(usize, [Vec<[f32; 3]>; 3])>,
}

/// Drives a case from rest to its end and draws it in all ways.
pub fn show(
    case: &ToolCase,
    truth: &Truth,
    clock: &Clock,
    driver: &mut Driver,
    yard: &mut Yard,
) -> Result<Shown> {
    driver.reset()?;
    driver.take(&case.tools)?;
    let nodes = case.trajectory.frame(0).len();
    let field = || vec![[0.0f32; 3]; nodes];
    let (mut state, mut before, mut true_field) = (field(), field(), field());
    let mut drawn = [field(), field(), field()];
    let mut shown = Shown {
        frames: Vec::new(),
        step_mse_mm2: Vec::new(),
        latency_ms: [0.0; 3],
        pictured: Vec::new(),
    };
    let [first, last, every] = LATENCIES_MS;
    let delays: Vec<f64> = (first..=last)
        .step_by(every as usize)
        .map(|ms| 1e-3 * f64::from(ms))
        .collect();
    let mut by_delay = vec![[0.0f64; 3]; delays.len()];
    let (mut former, mut true_former) = ([field(), field(), field()], field());
    let moments = moments(case, truth);
    let mut step = 0;
    for index in 1.. {
        let seconds = index as f64 * clock.frame_s;
        if seconds > truth.seconds() + 1e-9 {
            break;
        }
        let mut jumps = [0.0; 3];
        while step < clock.arrived(seconds) {
            // The same moment is drawn before and after the state arrives.
            let arrival = (step + 1) as f64 * clock.step_s + clock.arrival_s;
            if step > 0 {
                draw(
                    (case, truth, clock),
                    driver,
                    (arrival, step),
                    &state,
                    &mut drawn,
                )?;
            }
            step += 1;
            before.copy_from_slice(&state);
            let at = step as f64 * clock.step_s;
            driver.step(&truth.poses(case, at), &mut state)?;
            if !truth.slips(at) {
                truth.field(case, at, &mut true_field);
                let mse = metrics::mse_mm2(&true_field, &state);
                shown.step_mse_mm2.push(mse);
            }
            if step > 1 {
                let mut after = [field(), field(), field()];
                draw(
                    (case, truth, clock),
                    driver,
                    (arrival, step),
                    &state,
                    &mut after,
                )?;
                for (way, jumped) in jumps.iter_mut().enumerate() {
                    *jumped = jump(&drawn[way], &after[way]);
                }
            }
        }
        if step == 0 {
            continue;
        }
        draw(
            (case, truth, clock),
            driver,
            (seconds, step),
            &state,
            &mut drawn,
        )?;
        truth.field(case, seconds, &mut true_field);
        let poses = places(&truth.poses(case, seconds));
        let slips = truth.slips(seconds) || truth.slips(seconds - FRAME_S);
        let mut frame = Frame {
            seconds,
            slips,
            drawn: [Drawn::default(); 3],
            true_penetration_mm: yard.penetration(&true_field, &case.bodies, &poses),
        };
        for (way, field) in drawn.iter().enumerate() {
            frame.drawn[way] = Drawn {
                mse_mm2: metrics::mse_mm2(&true_field, field),
                penetration_mm: yard.penetration(field, &case.bodies, &poses),
                jump_mm: jumps[way],
                unlike_mm: unlike([&former[way], field], [&true_former, &true_field]),
            };
            former[way].copy_from_slice(field);
        }
        true_former.copy_from_slice(&true_field);
        shown.frames.push(frame);
        let at = seconds / FRAME_S * truth.parts as f64;
        let on_grid = (at - at.round()).abs() < 1e-6;
        if on_grid && moments.contains(&(at.round() as usize)) {
            shown.pictured.push((at.round() as usize, drawn.clone()));
        }
        if !slips {
            for (delay, sums) in delays.iter().zip(&mut by_delay) {
                truth.field(case, seconds - delay, &mut true_field);
                for (sum, field) in sums.iter_mut().zip(&drawn) {
                    *sum += metrics::mse_mm2(&true_field, field);
                }
            }
        }
    }
    for (way, latency) in shown.latency_ms.iter_mut().enumerate() {
        let errors: Vec<f64> = by_delay.iter().map(|sums| sums[way]).collect();
        *latency = 1e3 * lowest(&delays, &errors);
    }
    Ok(shown)
}

/// One moment in all ways, from the state of `step`.
fn draw(
    (case, truth, clock): (&ToolCase, &Truth, &Clock),
    driver: &mut Driver,
    (seconds, step): (f64, usize),
    state: &[[f32; 3]],
    drawn: &mut [Vec<[f32; 3]>; 3],
) -> Result<()> {
    let since = (seconds - step as f64 * clock.step_s).max(0.0);
    driver.sample(since / clock.step_s, &mut drawn[LATE])?;
    drawn[LAST].copy_from_slice(state);
    let poses = truth.poses(case, seconds);
    driver.present(since, &poses, &mut drawn[PRESENT])?;
    Ok(())
}

/// The largest difference between the ways that a node goes from one state to the next in two motions, mm.
fn unlike([a, b]: [&[[f32; 3]]; 2], [c, d]: [&[[f32; 3]]; 2]) -> f64 {
    let ways = a.iter().zip(b).zip(c.iter().zip(d));
    let apart = ways.map(|((a, b), (c, d))| {
        let off = |k: usize| (b[k] - a[k]) - (d[k] - c[k]);
        (0..3).map(|k| off(k).powi(2)).sum::<f32>()
    });
    f64::from(apart.fold(0.0, f32::max).sqrt())
}

/// Where a curve through points at even distances is lowest: the parabola at its lowest point.
fn lowest(at: &[f64], value: &[f64]) -> f64 {
    let (low, _) =
        value.iter().enumerate().fold(
            (0, f64::INFINITY),
            |best, (i, v)| {
                if *v < best.1 { (i, *v) } else { best }
            },
        );
    if low == 0 || low + 1 == at.len() {
        return at[low];
    }
    let [a, b, c] = [value[low - 1], value[low], value[low + 1]];
    let bend = a - 2.0 * b + c;
    let shift = if bend > 0.0 {
        0.5 * (a - c) / bend
    } else {
        0.0
    };
    at[low] + shift * (at[low + 1] - at[low])
}

/// Frames of the truth for pictures: three around the tools' fastest motion in contact, 0.1 s apart.
fn moments(case: &ToolCase, truth: &Truth) -> Vec<usize> {
    // At 0.1 s frames of 10, 20, ... Hz and the truth's own fall together.
    let every = 2 * truth.parts;
    let count = (case.poses.len() - 1) / every;
    let speed = |moment: usize| {
        let frame = moment * every;
        if case.touches(frame) && !truth.slips(frame as f64 / truth.parts as f64 * FRAME_S) {
            case.motion(frame)
        } else {
            0.0
        }
    };
    let fastest = (1..=count).max_by(|a, b| speed(*a).total_cmp(&speed(*b)));
    let fastest = fastest.unwrap_or(1);
    (fastest.saturating_sub(1).max(1)..=fastest + 1)
        .map(|moment| moment * every)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_arrive_after_their_delay_and_bad_clocks_are_refused() {
        let clock = Clock::new(90.0, 10.0).unwrap();
        assert_eq!(clock.arrived(0.0), 0);
        assert_eq!(clock.arrived(0.059), 0);
        assert_eq!(clock.arrived(0.06), 1);
        assert_eq!(clock.arrived(1.0), 19);
        assert!(Clock::new(0.0, 10.0).is_err());
        assert!(Clock::new(f64::NAN, 10.0).is_err());
        assert!(Clock::new(90.0, 50.0).is_err());
    }

    #[test]
    fn the_lowest_place_lies_between_points() {
        let at = [0.0, 1.0, 2.0, 3.0];
        let value = at.map(|x| (x - 1.3f64).powi(2));
        assert!((lowest(&at, &value) - 1.3).abs() < 1e-9);
        assert_eq!(lowest(&at, &[0.0, 1.0, 2.0, 3.0]), 0.0);
    }
}
