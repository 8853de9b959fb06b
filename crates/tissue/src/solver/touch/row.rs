//! One sample at one tool, and a node that it reaches.

use contact::Vector;

/// One sample at one tool.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    pub tool: u32,
    pub sample: u32,
    /// Place on the tool of a sample that it holds.
    pub bound: Option<Vector>,
    /// Places in the list of reached nodes.
    pub nodes: [u32; 4],
    pub weights: [f32; 4],
    /// Outward normal of a wall that a blade has laid open, when the last search was made.
    pub wall: Option<Vector>,
    /// On the tissue, µN, of the last inner step.
    pub force: Vector,
    /// At the end of the last inner step, mm; none for a row that is new.
    pub last_gap: Option<f32>,
    /// The row of a bound sample: its way from its place.
    pub last_slip: Option<Vector>,
    /// Of this step: where the free update left it.
    pub point: Vector,
    pub normal: Vector,
    pub gap: f32,
    /// Way relative to the tool, mm; of a bound sample that from its place.
    pub slip: Vector,
    /// Way of the tool's material at the sample over the step, mm.
    pub carried: Vector,
    /// Displacement over a step for a unit of force, mm/µN.
    pub gain: f32,
}

/// A node of a row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reached {
    pub slot: u32,
    pub node: u32,
    /// mm/µN.
    pub gain: f32,
    /// Position after the free update and increments after and before it, mm.
    pub at: Vector,
    pub increment: Vector,
    pub earlier: Vector,
    /// What contact adds to the increment, mm.
    pub change: Vector,
}
