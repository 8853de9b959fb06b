//! One case through the library, compared with what the reference solver recorded of it.

use anyhow::{Context, Result};
use tissue::mesh::{Boundary, Mesh};
use tissue::metrics;

use super::cases::ToolCase;
use super::drive::{Driver, Felt, Load};
use super::yard::{Yard, jump};

/// The tissue slips off a tool where a node goes this much farther in a step than any point of any tool, mm; a grasp that
/// tears off counts as well.
pub const SLIP_MM: f64 = 1.0;
/// Steps around a slip-off that are counted apart: before, and after.
pub const SLIP_WINDOW: (usize, usize) = (1, 2);
/// Steps that a tool is held still at least before motion counts as motion under a still tool: 1 s.
const SETTLE: usize = 20;
/// Steps of the hold.
const HOLD: usize = 2 * SETTLE;
/// Forces below this are too small for the ratio of their parts, mN.
const SMALL_MN: f64 = 1.0;

/// What the truth is measured by, once a case.
pub struct Truth {
    /// By step, the first is that from rest: penetration and jump, mm.
    pub penetration: Vec<f64>,
    pub jump: Vec<f64>,
    /// Steps that lie in a slip-off.
    pub slip: Vec<bool>,
    pub slips: usize,
    /// By step and tool.
    pub felt: Vec<Vec<Felt>>,
    /// Largest motion of a node in a step after tools were still for 1 s, mm; none where the case has no such step.
    pub still_mm: Option<f64>,
    pub friction_excess: Option<f64>,
}

/// One step of a prediction.
#[derive(Clone, Debug)]
pub struct Moment {
    pub mse_mm2: f64,
    pub error_mm: f64,
    pub det: f64,
    pub penetration_mm: f64,
    pub jump_mm: f64,
    pub ms: f64,
    pub contact_ms: f64,
    pub flags: u32,
    pub felt: Vec<Felt>,
}

/// A case of a prediction.
pub struct Outcome {
    pub moments: Vec<Moment>,
    /// Largest motion of a node in a step after tools were still for 1 s, mm; none where they never rest in contact.
    pub still_mm: Option<f64>,
    /// Largest sum of drags less friction times the sum of pushes, over the latter, of a tool; none where loads are not told.
    pub friction_excess: Option<f64>,
    /// The state that pictures show.
    pub pictured: Vec<[f32; 3]>,
}

impl Truth {
    pub fn of(case: &ToolCase, mesh: &Mesh, boundary: Boundary, yard: &mut Yard) -> Self {
        let frames = case.poses.len();
        let trajectory = &case.trajectory;
        let mut truth = Self {
            penetration: Vec::new(),
            jump: Vec::new(),
            slip: vec![false; frames - 1],
            slips: 0,
            felt: Vec::new(),
            still_mm: None,
            friction_excess: friction(case, mesh, boundary),
        };
        let mut still = 0;
        let mut slipped_before = false;
        for frame in 1..frames {
            let field = trajectory.frame(frame);
            let jump = jump(trajectory.frame(frame - 1), field);
            let motion = f64::from(case.motion(frame));
            truth
                .penetration
                .push(yard.penetration(field, &case.bodies, &case.at(frame)));
            truth.jump.push(jump);
            let slipped = case.tears(frame) || case.touches(frame - 1) && jump > motion + SLIP_MM;
            truth.slips += usize::from(slipped && !slipped_before);
            slipped_before = slipped;
            if slipped {
                let (before, after) = SLIP_WINDOW;
                let last = (frame + after).min(frames - 1);
                truth.slip[(frame - 1).saturating_sub(before)..last].fill(true);
            }
            still = if motion < 1e-4 && case.touches(frame) {
                still + 1
            } else {
                0
            };
            if still > SETTLE {
                truth.still_mm = Some(truth.still_mm.unwrap_or(0.0).max(jump));
            }
            truth.felt.push(felt(case, frame));
        }
        truth
    }
}

/// Force, torque and contacts that the reference solver recorded.
fn felt(case: &ToolCase, frame: usize) -> Vec<Felt> {
    let tracks = case.tracks();
    let rows = frame * case.tools.len()..(frame + 1) * case.tools.len();
    rows.map(|row| {
        let w = tracks.wrenches[row].map(f64::from);
        Felt {
            force: [w[0], w[1], w[2]],
            torque: [w[3], w[4], w[5]],
            contacts: tracks.contacts[row],
            ..Felt::default()
        }
    })
    .collect()
}

/// How far the recorded forces at samples leave Coulomb's cone, as [`Outcome::friction_excess`].
fn friction(case: &ToolCase, mesh: &Mesh, boundary: Boundary) -> Option<f64> {
    let tracks = case.tracks();
    let samples = mesh.samples(boundary);
    let mut worst: Option<f64> = None;
    for frame in 1..case.poses.len() {
        let rows = tracks.sample_offsets[frame] as usize..tracks.sample_offsets[frame + 1] as usize;
        if rows.is_empty() || case.poses[frame].iter().any(|to| to.grasp) {
            continue;
        }
        let loads: Vec<Load> = rows
            .map(|row| case.load(frame, row, &samples, &mesh.positions))
            .collect();
        worst = worse(worst, excess(case, &loads));
    }
    worst
}

fn worse(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.max(b)),
        (a, b) => a.or(b),
    }
}

/// The largest over the tools of (drags - friction * pushes) / pushes; none where none pushes.
fn excess(case: &ToolCase, loads: &[Load]) -> Option<f64> {
    let tools = case.tools.iter().enumerate();
    let each = tools.filter_map(|(index, tool)| {
        let own = loads.iter().filter(|load| load.tool == index);
        let (push, drag) = own.fold((0.0, 0.0), |(push, drag), load| {
            (push + load.push.max(0.0), drag + load.drag)
        });
        (push > SMALL_MN).then(|| drag / push - f64::from(tool.friction))
    });
    each.reduce(f64::max)
}

/// Drives a case from rest to its end, and once more to its longest rest, which goes on for 2 s.
pub fn measure(
    case: &ToolCase,
    truth: &Truth,
    driver: &mut Driver,
    yard: &mut Yard,
) -> Result<Outcome> {
    let nodes = case.trajectory.frame(0).len();
    driver.reset()?;
    driver.take(&case.tools)?;
    let mut outcome = Outcome {
        moments: Vec::new(),
        still_mm: None,
        friction_excess: None,
        pictured: Vec::new(),
    };
    let (mut field, mut before) = (vec![[0.0f32; 3]; nodes], vec![[0.0f32; 3]; nodes]);
    let pictured = case.moment();
    for frame in 1..case.poses.len() {
        let step = driver
            .step(&case.poses[frame], &mut field)
            .with_context(|| format!("step {frame}"))?;
        let true_field = case.trajectory.frame(frame);
        if !truth.slip[frame - 1] && !case.poses[frame].iter().any(|to| to.grasp) {
            outcome.friction_excess = worse(outcome.friction_excess, excess(case, &step.loads));
        }
        outcome.moments.push(Moment {
            mse_mm2: metrics::mse_mm2(true_field, &field),
            error_mm: metrics::max_error_mm(true_field, &field),
            det: yard.smallest_det(&field),
            penetration_mm: yard.penetration(&field, &case.bodies, &case.at(frame)),
            jump_mm: jump(&before, &field),
            ms: step.ms,
            contact_ms: step.contact_ms,
            flags: step.flags,
            felt: step.felt,
        });
        before.copy_from_slice(&field);
        if frame == pictured {
            outcome.pictured.clone_from(&field);
        }
    }
    if let Some(hold) = case.hold() {
        driver.reset()?;
        driver.take(&case.tools)?;
        let mut largest = 0.0f64;
        for step in 1..=hold + HOLD {
            driver.step(&case.poses[step.min(hold)], &mut field)?;
            if step > hold + SETTLE {
                largest = largest.max(jump(&before, &field));
            }
            before.copy_from_slice(&field);
        }
        outcome.still_mm = Some(largest);
    }
    Ok(outcome)
}
