//! What the solver keeps of each slot (`elements::Partition`): displacement, increment, force.

/// Four floats on a 16-byte boundary.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Node(pub [f32; 4]);

/// Slot arrays (owned and ghost), see `partition`.
#[derive(Clone, Default)]
pub(crate) struct Fields {
    /// Displacement, mm; fourth component: nodal dilatation `J - 1` (averaged elements only).
    pub displacement: Vec<Node>,
    /// Displacement over the last inner step, mm; fourth component: `g`, mm/µN.
    pub increment: Vec<Node>,
    /// Internal force, µN. Averaged elements first have the current nodal volume × 4 times bulk modulus, nJ, in the
    /// third component. The fourth holds nothing.
    pub force: Vec<Node>,
}
