//! Forces for a hand: the contact of one tool at 1 kHz, between the steps of a scene (`docs/guide/haptics.md`).
//!
//! After each step the scene publishes a small contact problem near the tool; a thread of the host's own solves it at the pose of
//! each millisecond. Neither waits for the other.
//!
//! | module | what |
//! |---|---|
//! | `snapshot` | what a step publishes: samples near the tool, how they move, forces, velocities |
//! | `publish` | the scene's end: fills it |
//! | `ends` | what both ends see of each other |
//! | `modes` | the natural modes between two steps |
//! | `render` | the hand's end: a wrench at a pose |
//! | `solver` | the samples between two steps, and contact at a pose |
//! | `stiffness` | how the wrench changes with the pose |
//! | `passivity` | no more energy to the hand than came from it |
//!
//! At this boundary metres, newtons and newton metres; inside millimetres and millinewtons.
//!
//! REQ-050: The force of a hand brings no energy into it, and a limit bounds it.
//!
//! REQ-051: A hand and the steps run on two threads; the age of the last step is told.

mod ends;
mod modes;
mod passivity;
pub(crate) mod publish;
mod pushed;
mod render;
mod snapshot;
mod solver;
mod stiffness;

pub use render::Haptics;

use crate::contact::Tool;

/// A hand without a scene.
#[cfg(test)]
pub(crate) fn test_hand(options: &HapticOptions) -> Haptics {
    let modes = modes::Modes::new(&[], 0.0).unwrap();
    let (_, snapshot) =
        exchange::exchange([0; 3].map(|modes| snapshot::ContactSnapshot::new(modes).unwrap()));
    let (pose, _) = exchange::exchange([options.tool.pose; 3]);
    Haptics::new(options, modes, snapshot, pose, Default::default()).unwrap()
}

/// How a tool is rendered.
#[derive(Clone, Debug)]
pub struct HapticOptions {
    /// Its place in the list of tools that drives the steps.
    pub instrument: u32,
    /// Shape, friction and mode; its pose says where it is first.
    pub tool: Tool,
    /// What a new step puts elsewhere is blended in over this time, s.
    pub blend_s: f64,
    /// The observer and its damper are at work.
    pub passivity: bool,
    /// What the damper gives at most, N s/m: the device must render it stably.
    pub damping_limit_n_s_per_m: f32,
    /// Longest force, N; 0: none.
    pub force_limit_n: f32,
    /// How old a step is when it arrives, s: the time since the poses that it was given were taken. None: as long as it took.
    pub latency_s: Option<f64>,
}

impl HapticOptions {
    /// The defaults for a tool.
    pub fn new(instrument: u32, tool: Tool) -> HapticOptions {
        HapticOptions {
            instrument,
            tool,
            blend_s: 0.025,
            passivity: true,
            damping_limit_n_s_per_m: 5.0,
            force_limit_n: 0.0,
            latency_s: None,
        }
    }
}

/// Where a tool is at a moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HapticPose {
    /// The host's clock, s.
    pub time_s: f64,
    /// In the mesh's frame.
    pub position_m: [f32; 3],
    /// Unit quaternion x, y, z, w.
    pub rotation: [f32; 4],
    /// Linear and angular velocity, m/s and rad/s, for the damper; none: from the last two poses.
    pub velocity: Option<[[f32; 3]; 2]>,
}

/// What a hand feels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HapticForce {
    /// On the tool, in the mesh's frame.
    pub force_n: [f32; 3],
    /// On the tool about its position.
    pub torque_n_m: [f32; 3],
    /// `-d(force, torque) / d(position, rotation)`, row-major; N/m, N/rad, N m/m, N m/rad. Of contact alone.
    pub stiffness: [f32; 36],
    /// Samples that push or hold the tool.
    pub contacts: u32,
    /// There is a force.
    pub contact: bool,
    /// The damper is at work.
    pub damped: bool,
    /// How old the last step is, s.
    pub age_s: f64,
    /// Energy given to the hand since it last touched, beyond what came from it, J; the damper takes it back.
    pub excess_energy_j: f64,
    /// Steps seen.
    pub steps: u64,
}

impl HapticForce {
    /// No force.
    pub const NONE: HapticForce = HapticForce {
        force_n: [0.0; 3],
        torque_n_m: [0.0; 3],
        stiffness: [0.0; 36],
        contacts: 0,
        contact: false,
        damped: false,
        age_s: 0.0,
        excess_energy_j: 0.0,
        steps: 0,
    };
}
