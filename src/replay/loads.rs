//! What acts on the body beside contact, in a line of a recording.
//!
//! The types here are the wire format: their names and fields are what a line of JSON has, and an
//! unknown field is refused, so that a recording with loads that this library does not know is not
//! played without them. What is null, empty or absent is not written, and reads as the same value
//! to the bit. Zero is asked for by its bits, because -0.0 would otherwise come back as 0.0, and a
//! replay compares hashes.

use std::borrow::Cow;

use ::contact::{End, Spring, TiePoint, Vector};
use serde::{Deserialize, Serialize};

use super::drive::Rows;

/// The loads of a step.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Loading<'a> {
    /// In the mesh's frame, and in the world's where the line has a support, m/s².
    #[serde(skip_serializing_if = "is_null")]
    pub gravity: [f32; 3],
    /// m/s².
    #[serde(skip_serializing_if = "is_null")]
    pub gravity_at_rest: [f32; 3],
    /// The rows of forces that are not zero, mN.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub forces: Option<Rows<'a>>,
    /// At points of the tissue, in the host's order: sums in floating point depend on it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub point_forces: Vec<PointForce>,
    /// On the boundary, added up where they overlap.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub pressures: Vec<Pressure<'a>>,
    /// Where what holds the whole body is at the end of the step; absent where the host gives none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub support: Option<Pose>,
    /// Groups of held nodes that the host leads or lets go.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub supports: Vec<Support<'a>>,
    /// All ties of the step: a line tells each step's whole list, not the changes since the last.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub ties: Vec<Tie>,
}

impl Loading<'_> {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        is_null(&self.gravity)
            && is_null(&self.gravity_at_rest)
            && self.forces.is_none()
            && self.point_forces.is_empty()
            && self.pressures.is_empty()
            && self.support.is_none()
            && self.supports.is_empty()
            && self.ties.is_empty()
    }
}

/// To the bit.
fn is_null(vector: &[f32; 3]) -> bool {
    vector.iter().all(|x| x.to_bits() == 0)
}

/// To the bit.
pub(super) fn is_zero(value: &f64) -> bool {
    value.to_bits() == 0
}

/// `upt_point_force`.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointForce {
    /// Of the intact mesh, around the point.
    pub nodes: [u32; 4],
    /// Of these nodes, with the sum 1; all zero means the first node alone.
    pub weights: [f32; 4],
    /// mN.
    pub force: [f32; 3],
}

/// `upt_pressure`.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pressure<'a> {
    /// Empty: the domain.
    #[serde(default)]
    pub nodes: Cow<'a, [u32]>,
    /// Positive presses on the surface.
    pub pascal: f32,
}

/// Where a support is.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pose {
    /// mm.
    pub position: [f32; 3],
    /// Unit quaternion x, y, z, w.
    pub rotation: [f32; 4],
}

/// `upt_support`.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Support<'a> {
    /// Its place in the bundle's list of groups.
    pub group: u32,
    /// The group holds nothing in this step.
    #[serde(default)]
    pub let_go: bool,
    /// Of the whole group as one rigid body, in the mesh's frame; absent with the other: as it was
    /// meshed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pose: Option<Pose>,
    /// Instead of a pose: one vector for each of its nodes `[n,3]`, mm, at the end of the step.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub displacements: Option<Cow<'a, [f32]>>,
}

/// `upt_tie`.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tie {
    /// The end that is on the tissue.
    pub point: Point,
    /// The other end.
    pub to: Far,
    /// mN/mm; 0 for a place of the list that holds nothing.
    pub stiffness: f32,
    /// Length up to which a thread hangs loose, mm.
    #[serde(default)]
    pub slack_mm: f32,
    /// mN s/mm.
    #[serde(default)]
    pub damping: f32,
    /// A rod, which pushes where it is shorter than its slack length; otherwise a thread.
    #[serde(default)]
    pub pushes: bool,
    /// Tension beyond which it breaks, mN; 0 for a tie that never does.
    #[serde(default)]
    pub break_mn: f32,
}

/// A point of the tissue.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Point {
    /// Of the intact mesh, also where the body has been cut.
    pub nodes: [u32; 3],
    /// With the sum 1; a node that is not needed repeats the first with the weight 0.
    pub weights: [f32; 3],
}

/// The far end of a tie.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Far {
    /// A place in the world, mm.
    World([f32; 3]),
    /// A place in the mesh's frame, which goes with what holds the body, mm.
    Support([f32; 3]),
    /// A place in the frame of one of the step's instruments, by its index in their list, mm.
    Instrument { instrument: u32, place: [f32; 3] },
    /// Another point of the tissue, as a suture has it.
    Tissue(Point),
}

impl From<TiePoint> for Point {
    fn from(TiePoint { nodes, weights }: TiePoint) -> Point {
        Point { nodes, weights }
    }
}

impl From<Point> for TiePoint {
    fn from(Point { nodes, weights }: Point) -> TiePoint {
        TiePoint { nodes, weights }
    }
}

impl From<&::contact::Tie> for Tie {
    fn from(tie: &::contact::Tie) -> Tie {
        let Spring {
            stiffness,
            slack_mm,
            damping,
            pushes,
        } = tie.spring;
        Tie {
            point: tie.point.into(),
            to: match tie.end {
                End::World(place) => Far::World(place.to_array()),
                End::Support(place) => Far::Support(place.to_array()),
                End::Tool { tool, place } => Far::Instrument {
                    instrument: tool,
                    place: place.to_array(),
                },
                End::Tissue(point) => Far::Tissue(point.into()),
            },
            stiffness,
            slack_mm,
            damping,
            pushes,
            break_mn: tie.break_mn,
        }
    }
}

impl From<&Tie> for ::contact::Tie {
    fn from(tie: &Tie) -> ::contact::Tie {
        ::contact::Tie {
            point: tie.point.into(),
            end: match tie.to {
                Far::World(place) => End::World(Vector::from(place)),
                Far::Support(place) => End::Support(Vector::from(place)),
                Far::Instrument { instrument, place } => End::Tool {
                    tool: instrument,
                    place: Vector::from(place),
                },
                Far::Tissue(point) => End::Tissue(point.into()),
            },
            spring: Spring {
                stiffness: tie.stiffness,
                slack_mm: tie.slack_mm,
                damping: tie.damping,
                pushes: tie.pushes,
            },
            break_mn: tie.break_mn,
        }
    }
}
