//! Why a shape is refused.
//!
//! Each message names the place or the field and says what to do about it: a host shows it to
//! whoever has made the tool.

/// A shape that no tool can have.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShapeError {
    #[error("{field} is {value} mm; it must be a length {wanted}")]
    Length {
        field: &'static str,
        value: f32,
        wanted: &'static str,
    },
    #[error(
        "corner radius {radius} mm exceeds the smallest half extent {smallest} mm; make the box thicker or the radius smaller"
    )]
    Corner { radius: f32, smallest: f32 },
    #[error("point {index} is not finite or farther than 10 m from the origin")]
    Point { index: usize },
    #[error("face {index} names a node beyond the {count} points")]
    Face { index: usize, count: usize },
    #[error(
        "the surface is not closed: the edge from point {a} to {b} does not belong to one face on each side; give a watertight surface, or take its hull"
    )]
    Open { a: u32, b: u32 },
    #[error(
        "the surface crosses or touches itself at [{}, {}, {}] mm, so that its inside is not known; unite its parts (a Boolean union) or take its hull", .at[0], .at[1], .at[2]
    )]
    Crossing { at: [f32; 3] },
    #[error(
        "a part of the surface is inside out at [{}, {}, {}] mm: turn the faces of that part, outward or around a hollow inward", .at[0], .at[1], .at[2]
    )]
    InsideOut { at: [f32; 3] },
    #[error("the {count} points of the tool have no volume ({reason}); give a solid tool")]
    Flat { count: usize, reason: String },
    #[error(
        "it is {thickness} mm thick, less than contact can be solved for; lengths are mm, and a rod must be 0.5 mm thick and a blade 0.2 mm"
    )]
    Thin { thickness: f32 },
    #[error(
        "it is {thickness} mm thick at [{}, {}, {}] mm, and contact needs 0.2 mm; thicken or blunt it there, or take its hull", .at[0], .at[1], .at[2]
    )]
    Wall { at: [f32; 3], thickness: f32 },
    #[error(
        "the hull is too pointed at [{}, {}, {}] mm: a millimetre behind that corner it is {thickness} mm thick, and contact needs 0.2 mm; blunt it", .corner[0], .corner[1], .corner[2]
    )]
    Pointed { corner: [f32; 3], thickness: f32 },
}
