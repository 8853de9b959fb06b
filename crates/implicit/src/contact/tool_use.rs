//! How tools are used in a step: what the envelope of a bundle asks for.

/// The tools that push in a step, as the envelope sees them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolUse {
    /// Smallest and largest of their sizes (half their smallest extent), mm.
    pub size_mm: [f32; 2],
    /// Of the fastest point of any of them, mm/s.
    pub speed_mm_s: f32,
    /// How many push.
    pub count: usize,
}
