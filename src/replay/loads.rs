//! What acts on the body beside contact, in a line of a recording.

use std::borrow::Cow;

use ::contact::{End, Spring, TiePoint, Vector};
use serde::{Deserialize, Serialize};

use super::drive::Rows;

/// The loads of a step.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Loading<'a> {
    /// m/s².
    #[serde(skip_serializing_if = "is_null")]
    pub gravity: [f32; 3],
    /// m/s².
    #[serde(skip_serializing_if = "is_null")]
    pub gravity_at_rest: [f32; 3],
    /// The rows of forces that are not zero, mN.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub forces: Option<Rows<'a>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub point_forces: Vec<PointForce>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub pressures: Vec<Pressure<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub support: Option<Pose>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub supports: Vec<Support<'a>>,
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
    pub nodes: [u32; 4],
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
    pub group: u32,
    #[serde(default)]
    pub let_go: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pose: Option<Pose>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub displacements: Option<Cow<'a, [f32]>>,
}

/// `upt_tie`.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tie {
    pub point: Point,
    pub to: Far,
    pub stiffness: f32,
    #[serde(default)]
    pub slack_mm: f32,
    #[serde(default)]
    pub damping: f32,
    #[serde(default)]
    pub pushes: bool,
    #[serde(default)]
    pub break_mn: f32,
}

/// A point of the tissue.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Point {
    pub nodes: [u32; 3],
    pub weights: [f32; 3],
}

/// The far end of a tie.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Far {
    World([f32; 3]),
    Support([f32; 3]),
    Instrument { instrument: u32, place: [f32; 3] },
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
