//! What is known of a solid before it is filled: its volume, its thinnest place, and the nodes that it needs.

use super::thickness::{Sample, samples};
use super::{ImportError, RawSurface, SurfaceDistance, closed_surface};

/// A wall is resolved by edges of its thickness over this.
pub const FINE: f64 = 1.05;
/// A lattice has two nodes a cube, and so many more a square of the surface.
const NODES_A_SQUARE: f64 = 1.35;
/// Where a lattice is finer it has so many times the nodes of a uniform one: what is finer reaches beyond the wall.
const BISECTED: f64 = 2.0;
/// The part of the surface that may be thinner than what is called the thinnest place: strays in walls,
/// and sharp rims, which are infinitely thin.
const STRAY: f64 = 3e-4;
const RIM: f64 = 3e-3;

/// A closed surface and the solid in it.
pub struct Solid {
    pub field: SurfaceDistance,
    pub samples: Vec<Sample>,
    pub volume: f64,
    pub area: f64,
    /// V - E + F of the surface.
    pub euler: i64,
    /// What is thinner than this, mm, holds a hundredth of the volume.
    rim: f64,
}

impl Solid {
    /// Measures a checked closed surface.
    pub fn of(surface: RawSurface) -> Result<Self, ImportError> {
        let volume = closed_surface::volume(&surface);
        let euler = characteristic(&surface.faces);
        let field = SurfaceDistance::new(surface.clone())?;
        let samples = samples(&surface, &field);
        Ok(Self {
            area: samples.iter().map(|sample| sample.area).sum(),
            rim: rim(&samples, volume),
            field,
            samples,
            volume,
            euler,
        })
    }

    /// Volume that lies in walls thinner than this, by the surface on both sides.
    pub fn thinner_than(&self, thickness: f64) -> f64 {
        let thin = self.samples.iter().filter(|s| s.thickness < thickness);
        thin.map(|s| 0.5 * s.area * s.thickness).sum()
    }

    /// Nodes that a lattice of a spacing has, about; graded, finer where the body is thin, but for sharp rims.
    pub fn nodes_at(&self, spacing: f64, graded: bool) -> f64 {
        let density = |h: f64| 2.0 / (h * h * h);
        let mut nodes =
            self.volume * density(spacing) + NODES_A_SQUARE * self.area / spacing.powi(2);
        for sample in self.samples.iter().filter(|_| graded) {
            let fine = sample.thickness.max(self.rim) / FINE;
            if fine < spacing {
                let within = 0.5 * sample.area * sample.thickness;
                nodes += BISECTED * within * (density(fine) - density(spacing));
                let squares = fine.powi(-2) - spacing.powi(-2);
                nodes += BISECTED * NODES_A_SQUARE * sample.area * squares;
            }
        }
        nodes
    }

    /// The spacing of about so many nodes.
    pub fn spacing_of(&self, nodes: f64, graded: bool) -> f64 {
        let (mut low, mut high) = (0.0, self.volume.cbrt());
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if self.nodes_at(middle, graded) > nodes {
                low = middle;
            } else {
                high = middle;
            }
        }
        high
    }

    /// The coarsest spacing at which flat faces still hold a round body's volume.
    pub fn coarsest(&self) -> f64 {
        0.13 * self.volume.cbrt()
    }

    /// The thinnest wall or neck, or where there is none the thinnest place that is no rim.
    pub fn thinnest(&self) -> Option<&Sample> {
        let walls = self.thinner(|sample| sample.is_wall, STRAY * self.area);
        walls.or_else(|| self.thinner(|sample| sample.thickness.is_finite(), RIM * self.area))
    }

    /// The thinnest of some samples, but for so much of the surface.
    fn thinner(&self, of: impl Fn(&Sample) -> bool, mut but: f64) -> Option<&Sample> {
        let mut found: Vec<&Sample> = self.samples.iter().filter(|sample| of(sample)).collect();
        found.sort_by(|a, b| a.thickness.total_cmp(&b.thickness));
        found.into_iter().find(|sample| {
            but -= sample.area;
            but < 0.0
        })
    }

    /// Why a lattice is refused.
    pub fn too_thin(&self, share: Option<f64>, wanted: Option<usize>) -> ImportError {
        let needed = match self.thinnest() {
            Some(place) if place.thickness < FINE * self.coarsest() => {
                let uniform = self.nodes_at(place.thickness / FINE, false);
                uniform.min(self.nodes_at(self.coarsest(), true))
            }
            _ => self.nodes_at(self.coarsest(), false),
        };
        // So many were tried.
        let needed = needed.max(1.3 * wanted.unwrap_or(0) as f64);
        ImportError::Thin {
            volume_ml: 1e-3 * self.volume,
            share: share.map(|share| 100.0 * share),
            thickness_mm: self.thinnest().map_or(f64::NAN, |s| s.thickness),
            at: self.thinnest().map_or([f64::NAN; 3], Sample::middle),
            nodes: two_digits(1.05 * needed),
        }
    }
}

/// The thickness beneath which a hundredth of the volume lies.
fn rim(samples: &[Sample], volume: f64) -> f64 {
    let mut thin: Vec<(f64, f64)> = (samples.iter().filter(|s| s.thickness.is_finite()))
        .map(|s| (s.thickness, 0.5 * s.area * s.thickness))
        .collect();
    thin.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut left = 0.01 * volume;
    thin.into_iter()
        .find(|&(_, own)| {
            left -= own;
            left < 0.0
        })
        .map_or(f64::INFINITY, |(thickness, _)| thickness)
}

/// Two digits, rounded up.
pub fn two_digits(count: f64) -> u64 {
    let unit = 10f64.powf(count.max(10.0).log10().floor() - 1.0);
    ((count / unit).ceil() * unit) as u64
}

/// V - E + F of triangles with two at each edge.
pub fn characteristic(faces: &[[u32; 3]]) -> i64 {
    let mut nodes: Vec<u32> = faces.iter().flatten().copied().collect();
    nodes.sort_unstable();
    nodes.dedup();
    nodes.len() as i64 - faces.len() as i64 / 2
}
