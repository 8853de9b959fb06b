//! What an operation refuses; the body is then what it was.

/// Why an operation was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TopologyError {
    /// A number that is not finite.
    #[error("{field}[{index}] is not finite; check what the host computes it from")]
    NotFinite { field: &'static str, index: usize },
    /// Positions of another body.
    #[error("{found} positions for {nodes} nodes; a cut adds nodes, and each has one")]
    Positions { found: usize, nodes: usize },
    /// A blade that passes nothing.
    #[error(
        "the blade sweeps no area: give at least two poses of an edge of at least two points, with the edge moved across itself"
    )]
    NoArea,
    /// A blade that no tissue meets.
    #[error(
        "a blade with a fracture energy of {energy} J/m² and a threshold of {threshold_mn} mN; both must be 0 or more"
    )]
    Blade { energy: f64, threshold_mn: f64 },
    /// Edges of another number of points.
    #[error(
        "blade[{index}] has {found} points, the edge before it {expected}: each pose is of the same edge"
    )]
    EdgeLength {
        index: usize,
        found: usize,
        expected: usize,
    },
    /// A tetrahedron without volume, or with its corners the other way round.
    #[error(
        "tetrahedron {index} has a volume of {volume:e} mm³; corners must be those of a positive volume"
    )]
    Volume { index: usize, volume: f64 },
    /// An index beyond its list.
    #[error("{field}[{index}] is {found}; there are {count}")]
    Index {
        field: &'static str,
        index: usize,
        found: u32,
        count: usize,
    },
    /// A stiffness that no element may have.
    #[error("a stiffness factor of {factor} is not between 0.001 and 1000")]
    Factor { factor: f32 },
    /// A stretch at which tissue at rest would part.
    #[error("tissue that tears at {stretch} times its length; give a number above 1, such as 1.5")]
    Stretch { stretch: f64 },
    /// Nothing would be left.
    #[error("nothing of the body would be left; remove less")]
    NothingLeft,
    /// What was kept is of another mesh, or damaged.
    #[error("no cuts of this mesh lead to what was kept; it is of another mesh, or damaged")]
    Kept,
    /// The system has no memory.
    #[error("no memory for {bytes} bytes of a cut body; free some, or cut less at once")]
    Memory { bytes: usize },
    /// More copies than a body may have.
    #[error(
        "the body would have {nodes} nodes, with room for {most}; make a scene with more room, or undo"
    )]
    Room { nodes: usize, most: usize },
}
