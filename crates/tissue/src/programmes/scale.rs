//! How large the table's tools are on a body: as they are on a brain, smaller on a smaller or thinner body.

use super::Specification;
use super::site::Sites;
use crate::mesh::Mesh;
use crate::schemes::Range;
use contact::Vector;

/// A body has the table's tools if it is so wide across its second longest axis, mm.
pub const REFERENCE_WIDTH_MM: f64 = 70.0;
/// And if it is so thick beneath its domain, in the median, mm.
pub const REFERENCE_THICKNESS_MM: f64 = 40.0;
/// A scaled tool goes in by at most this part of the thickness beneath its site.
pub const DEEPEST_SHARE: f64 = 0.3;
/// No tool's radius is below this, mm: samples of a surface are up to 1.7 mm apart.
const LEAST_RADIUS_MM: f64 = 1.5;
/// Sites whose thickness is measured, at most.
const SITES: usize = 256;
/// A way through the body that is shorter than this is the face that it starts on, mm.
const SKIN_MM: f32 = 0.5;

/// What the table's lengths are multiplied by, and how deep tools may go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolScale {
    /// For lengths and speeds; times stay, forces go with its square.
    pub factor: f64,
    /// The deepest that a tool goes in, as a part of the thickness beneath its site; none: as deep as the table says.
    pub deepest_share: Option<f64>,
}

/// Two digits after the point say enough, and files and messages can hold them.
fn two_digits(factor: f64) -> f64 {
    ((100.0 * factor).floor() / 100.0).max(0.01)
}

/// A body's size, as far as tools depend on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodySize {
    /// Across its second longest axis, mm.
    pub width_mm: f64,
    /// Beneath the domain, the median over its sites, mm.
    pub thickness_mm: f64,
}

impl ToolScale {
    /// The table as it is.
    pub const TABLE: Self = Self {
        factor: 1.0,
        deepest_share: None,
    };

    /// A scale of one's own; 1 is the table as it is.
    ///
    /// # Errors
    /// Says what a factor must be.
    pub fn of_factor(factor: f64) -> Result<Self, String> {
        if !(0.01..=100.0).contains(&factor) {
            return Err(format!(
                "the scale of tools is {factor}; it must be 0.01 to 100"
            ));
        }
        Ok(Self::from_factor(factor))
    }

    /// The scale for a body: 1 where it is as large as a brain, else the smaller one of width and thickness over a brain's.
    pub fn of_body(size: BodySize) -> Self {
        let factor =
            (size.width_mm / REFERENCE_WIDTH_MM).min(size.thickness_mm / REFERENCE_THICKNESS_MM);
        Self::from_factor(two_digits(factor).min(1.0))
    }

    fn from_factor(factor: f64) -> Self {
        Self {
            factor,
            deepest_share: (factor != 1.0).then_some(DEEPEST_SHARE),
        }
    }

    /// This one, or a smaller factor.
    pub fn at_most(self, factor: f64) -> Self {
        if factor < self.factor {
            Self::from_factor(two_digits(factor))
        } else {
            self
        }
    }

    /// A row of the table on this body.
    pub(super) fn of(&self, row: &Specification) -> Specification {
        let by = |range: Range| range.map(|x| x * self.factor);
        Specification {
            radius_mm: by(row.radius_mm).map(|x| x.max(LEAST_RADIUS_MM.min(row.radius_mm[0]))),
            depth_mm: by(row.depth_mm),
            press_mm_s: by(row.press_mm_s),
            slide_mm: by(row.slide_mm),
            slide_mm_s: by(row.slide_mm_s),
            pull_mm: by(row.pull_mm),
            tear_off_mn: by(by(row.tear_off_mn)),
            lift_mm_s: by(row.lift_mm_s),
            second_mm: row.second_mm.map(by),
            ..*row
        }
    }

    /// The deepest that a tool goes in at a site, mm.
    pub(super) fn deepest(&self, thickness: &Thickness, at: Vector, inward: Vector) -> f64 {
        self.deepest_share.map_or(f64::INFINITY, |share| {
            share * f64::from(thickness.along(at, inward))
        })
    }
}

impl std::fmt::Display for ToolScale {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.factor {
            1.0 => write!(f, "the table's sizes")?,
            factor => write!(f, "{factor} of the table's sizes")?,
        }
        match self.deepest_share {
            Some(share) => write!(f, ", at most {share} of the thickness deep"),
            None => Ok(()),
        }
    }
}

impl BodySize {
    /// Across the second longest axis, mm.
    pub fn width(mesh: &Mesh) -> f64 {
        let mut extent = [0, 1, 2].map(|k| {
            let values = mesh.positions.iter().map(|p| p[k]);
            let low = values.clone().fold(f32::INFINITY, f32::min);
            f64::from(values.fold(f32::NEG_INFINITY, f32::max) - low)
        });
        extent.sort_by(f64::total_cmp);
        extent[1]
    }

    /// Measures a mesh; without a domain there is no thickness to mind.
    pub fn of(mesh: &Mesh) -> Self {
        let (sites, thickness) = (Sites::new(mesh), Thickness::new(mesh));
        let count = mesh.domain.len();
        let mut found: Vec<f32> = (0..count.min(SITES))
            .filter_map(|i| sites.draw((i as f64 + 0.5) / count.min(SITES) as f64, false, 5.0))
            .map(|site| thickness.along(site.at, -site.outward))
            .collect();
        found.sort_by(f32::total_cmp);
        Self {
            width_mm: Self::width(mesh),
            thickness_mm: found
                .get(found.len() / 2)
                .map_or(f64::INFINITY, |t| f64::from(*t)),
        }
    }
}

/// The surface at rest, for the way through the body.
pub(super) struct Thickness {
    faces: Vec<[Vector; 3]>,
}

impl Thickness {
    pub fn new(mesh: &Mesh) -> Self {
        let corner = |node: u32| Vector::from(mesh.positions[node as usize]);
        Self {
            faces: mesh.surface.iter().map(|face| face.map(corner)).collect(),
        }
    }

    /// From a point of the surface along a direction to where it comes out, mm.
    pub fn along(&self, from: Vector, direction: Vector) -> f32 {
        let hits = self
            .faces
            .iter()
            .filter_map(|face| hit(face, from, direction));
        hits.filter(|t| *t > SKIN_MM).fold(f32::INFINITY, f32::min)
    }
}

/// Where a ray passes through a triangle, after Möller and Trumbore.
fn hit([a, b, c]: &[Vector; 3], from: Vector, direction: Vector) -> Option<f32> {
    let (ab, ac) = (*b - *a, *c - *a);
    let p = direction.cross(ac);
    let volume = ab.dot(p);
    if volume.abs() < 1e-9 {
        return None;
    }
    let off = from - *a;
    let q = off.cross(ab);
    let (u, v) = (off.dot(p) / volume, direction.dot(q) / volume);
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then(|| ac.dot(q) / volume)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::box_phantom;
    use crate::programmes::TABLE;

    #[test]
    fn the_table_is_what_it_was_on_a_large_body() {
        assert!(TABLE.iter().all(|row| ToolScale::TABLE.of(row) == *row));
        let large = ToolScale::of_body(BodySize {
            width_mm: 138.0,
            thickness_mm: 55.0,
        });
        assert_eq!(large, ToolScale::TABLE);
        assert_eq!(ToolScale::of_factor(1.0), Ok(ToolScale::TABLE));
    }

    #[test]
    fn width_and_thickness_of_a_box_decide() {
        let size = BodySize::of(&box_phantom([60.0, 40.0, 20.0], [6, 4, 2]).unwrap());
        assert!(
            (size.width_mm - 40.0).abs() < 1e-3 && (size.thickness_mm - 20.0).abs() < 1e-3,
            "{size:?}"
        );
        let scale = ToolScale::of_body(size);
        assert_eq!(
            scale,
            ToolScale {
                factor: 0.5,
                deepest_share: Some(DEEPEST_SHARE)
            }
        );
        let press = scale.of(&TABLE[0]);
        assert_eq!((press.radius_mm, press.depth_mm), ([2.0, 6.0], [1.0, 7.5]));
        assert_eq!(press.hold_s, TABLE[0].hold_s);
        assert!(ToolScale::of_factor(0.0).is_err() && ToolScale::of_factor(f64::NAN).is_err());
    }
}
