//! What a tool looks like in its own frame, mm. [`crate::Body`] answers queries about it.

use crate::error::ShapeError;
use crate::triangles::Triangles;
use serde::{Deserialize, Serialize};

/// A rigid tool's shape, centred on its own origin except where points say otherwise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Shape {
    /// A ball.
    Sphere { radius: f32 },
    /// All points within `radius` of a segment along local y, `half_length` to either side; 0 is a sphere.
    Capsule { half_length: f32, radius: f32 },
    /// A box with sharp edges.
    Box { half_extents: [f32; 3] },
    /// A box with rounded edges: `half_extents` are those of the whole, `radius` at most the smallest.
    Spatula { half_extents: [f32; 3], radius: f32 },
    /// The convex hull of points (of a tool's own STL or OBJ), each point moved out by `margin`.
    Hull { points: Vec<[f32; 3]>, margin: f32 },
    /// A closed surface of triangles that need not be convex, each point moved out by `margin`.
    Mesh {
        points: Vec<[f32; 3]>,
        faces: Vec<[u32; 3]>,
        margin: f32,
    },
}

/// No tool is as large, mm.
const LARGEST: f32 = 1e4;
/// No rod is thinner than this, mm: it would pass between the points at which contact is looked at.
pub const THINNEST_MM: f32 = 0.5;

impl Shape {
    /// The convex hull of points, such as those of an STL or OBJ file, with only its corners kept.
    ///
    /// # Errors
    /// [`ShapeError`] for points that are not finite or have no volume between them.
    pub fn hull_of(points: &[[f32; 3]]) -> Result<Self, ShapeError> {
        let all = Shape::Hull {
            points: points.to_vec(),
            margin: 0.0,
        };
        all.check()?;
        let hull = Triangles::hull(points)?;
        Ok(Shape::Hull {
            points: hull.corners().iter().map(|p| p.to_array()).collect(),
            margin: 0.0,
        })
    }

    /// Sizes are finite and positive, a rounded box is as thick as its corners. Hulls are built by [`crate::Body::new`].
    ///
    /// # Errors
    /// [`ShapeError`], naming the field.
    pub fn check(&self) -> Result<(), ShapeError> {
        match self {
            Shape::Sphere { radius } => {
                positive("radius", *radius)?;
                thick(2.0 * radius)
            }
            Shape::Capsule {
                half_length,
                radius,
            } => {
                not_negative("half_length", *half_length)?;
                positive("radius", *radius)?;
                thick(2.0 * radius)
            }
            Shape::Box { half_extents } => {
                all_positive(*half_extents)?;
                is_thick_blade(*half_extents)
            }
            Shape::Spatula {
                half_extents,
                radius,
            } => {
                all_positive(*half_extents)?;
                positive("radius", *radius)?;
                let smallest = half_extents.iter().copied().fold(f32::INFINITY, f32::min);
                if *radius > smallest {
                    return Err(ShapeError::Corner {
                        radius: *radius,
                        smallest,
                    });
                }
                is_thick_blade(*half_extents)
            }
            Shape::Hull { points, margin } | Shape::Mesh { points, margin, .. } => {
                let far = |p: &[f32; 3]| !p.iter().all(|v| v.abs() < LARGEST);
                if let Some(index) = points.iter().position(far) {
                    return Err(ShapeError::Point { index });
                }
                not_negative("margin", *margin)
            }
        }
    }
}

/// Refuses a length that is not finite or not above 0, naming its field.
fn positive(field: &'static str, value: f32) -> Result<(), ShapeError> {
    if value.is_finite() && value > 0.0 && value < LARGEST {
        Ok(())
    } else {
        Err(ShapeError::Length {
            field,
            value,
            wanted: "above 0 mm",
        })
    }
}

/// A rod's thickness, mm.
fn thick(thickness: f32) -> Result<(), ShapeError> {
    match thickness < THINNEST_MM {
        true => Err(ShapeError::Thin { thickness }),
        false => Ok(()),
    }
}

/// A blade may be thin in one direction, if it is no thinner than two fifths of a rod.
fn is_thick_blade(mut half_extents: [f32; 3]) -> Result<(), ShapeError> {
    half_extents.sort_unstable_by(f32::total_cmp);
    let [thickness, width, _] = half_extents.map(|half| 2.0 * half);
    thick(width)?;
    match thickness < 0.4 * THINNEST_MM {
        true => Err(ShapeError::Thin { thickness }),
        false => Ok(()),
    }
}

/// The same for one that may be 0.
fn not_negative(field: &'static str, value: f32) -> Result<(), ShapeError> {
    if value.is_finite() && (0.0..LARGEST).contains(&value) {
        Ok(())
    } else {
        Err(ShapeError::Length {
            field,
            value,
            wanted: "of 0 mm or more",
        })
    }
}

fn all_positive(half_extents: [f32; 3]) -> Result<(), ShapeError> {
    half_extents
        .into_iter()
        .try_for_each(|value| positive("half_extents", value))
}
