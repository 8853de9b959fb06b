//! Fills a closed surface with tetrahedra, and sees to it that they hold the solid.
//!
//! A uniform lattice comes first. Where it loses a wall, a neck or a tunnel, tetrahedra are bisected
//! until their edges are shorter than the body is thick ([`thickness`]). What then still loses more than
//! [`LEAST_SHARE`] allows is refused, with the thinnest place and the nodes that it needs.

use super::thickness::{Sample, samples};
use super::walls::Walls;
use super::{ImportError, RawSurface, RawTets, Resolution, SurfaceDistance, closed_surface};
use crate::stuffing::{Offset, StuffError, Stuffed, stuff_graded, volume6};

/// The part of the solid's volume that the tetrahedra hold at least.
const LEAST_SHARE: f64 = 0.97;
/// A wall is resolved by edges of its thickness over this.
const FINE: f64 = 1.05;
/// Bisection goes down to this part of the spacing.
const FINEST: f64 = 1.0 / 16.0;
/// Node counts within this part of the wanted one are accepted; within the second without a word.
const COUNT_TOLERANCE: f64 = 0.02;
const SAID_BEYOND: f64 = 0.15;
/// Meshes that are made in search of a count.
const TRIES: usize = 5;
/// A lattice has two nodes a cube, and so many more a square of the surface.
const NODES_A_SQUARE: f64 = 1.35;
/// The part of the surface that may be thinner than what is called the thinnest place: sharp rims are
/// infinitely thin.
const RIM: f64 = 3e-3;

/// A surface's tetrahedra and what there is to say about them.
pub struct Filled {
    pub raw: RawTets,
    pub notes: Vec<String>,
}

struct Solid {
    field: SurfaceDistance,
    samples: Vec<Sample>,
    volume: f64,
    area: f64,
    /// V - E + F of the surface.
    euler: i64,
    /// What is thinner than this, mm, holds a hundredth of the volume.
    rim: f64,
}

/// Tetrahedra of one lattice.
struct Attempt {
    made: Stuffed,
    /// Of the solid's volume.
    share: f64,
    whole: bool,
}

impl Attempt {
    /// Whether no tissue is lost.
    fn holds(&self) -> bool {
        self.whole && self.share >= LEAST_SHARE
    }

    fn count_within(&self, wanted: usize) -> bool {
        (self.made.positions.len() as f64 / wanted as f64 - 1.0).abs() <= SAID_BEYOND
    }
}

/// Fills a checked closed surface.
///
/// # Errors
/// [`ImportError::Thin`] where tissue would be lost.
pub fn fill(surface: RawSurface, resolution: Resolution) -> Result<Filled, ImportError> {
    let volume = closed_surface::volume(&surface);
    let euler = characteristic(&surface.faces);
    let field = SurfaceDistance::new(surface.clone())?;
    let samples = samples(&surface, &field);
    let area = samples.iter().map(|sample| sample.area).sum();
    let solid = Solid {
        rim: rim(&samples, volume),
        field,
        samples,
        volume,
        area,
        euler,
    };
    let mut notes = Vec::new();
    let attempt = match resolution {
        Resolution::Spacing(spacing) => solid.at_spacing(spacing, &mut notes)?,
        Resolution::Nodes(wanted) => solid.to_count(wanted.max(8), &mut notes)?,
    };
    if !attempt.whole {
        notes.push(format!(
            "the mesh has another number of tunnels or gaps than the surface (Euler characteristic {} for {}): a bridge or a gap is \
             thinner than the tetrahedra",
            characteristic(&boundary(&attempt.made)),
            solid.euler
        ));
    }
    Ok(Filled {
        raw: RawTets {
            positions: attempt.made.positions,
            tets: attempt.made.tets,
        },
        notes,
    })
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

fn boundary(made: &Stuffed) -> Vec<[u32; 3]> {
    crate::mesh::boundary_faces(&made.tets).unwrap_or_default()
}

/// V - E + F of triangles with two at each edge.
fn characteristic(faces: &[[u32; 3]]) -> i64 {
    let mut nodes: Vec<u32> = faces.iter().flatten().copied().collect();
    nodes.sort_unstable();
    nodes.dedup();
    nodes.len() as i64 - faces.len() as i64 / 2
}

impl Solid {
    /// Volume that lies in walls thinner than this, by the surface on both sides.
    fn thinner_than(&self, thickness: f64) -> f64 {
        let thin = self.samples.iter().filter(|s| s.thickness < thickness);
        thin.map(|s| 0.5 * s.area * s.thickness).sum()
    }

    /// Nodes that a lattice of a spacing has, about; graded, finer where the body is thin, but for sharp rims.
    fn nodes_at(&self, spacing: f64, graded: bool) -> f64 {
        let density = |h: f64| 2.0 / (h * h * h);
        let mut nodes =
            self.volume * density(spacing) + NODES_A_SQUARE * self.area / spacing.powi(2);
        for sample in self.samples.iter().filter(|_| graded) {
            let fine = sample.thickness.max(self.rim) / FINE;
            if fine < spacing {
                nodes += 0.5 * sample.area * sample.thickness * (density(fine) - density(spacing));
                nodes += NODES_A_SQUARE * sample.area * (fine.powi(-2) - spacing.powi(-2));
            }
        }
        nodes
    }

    /// The spacing of about so many nodes.
    fn spacing_of(&self, nodes: f64, graded: bool) -> f64 {
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
    fn coarsest(&self) -> f64 {
        0.15 * self.volume.cbrt()
    }

    /// The thinnest place that is no rim.
    fn thinnest(&self) -> Option<&Sample> {
        let mut by_thickness: Vec<&Sample> = self.samples.iter().collect();
        by_thickness.sort_by(|a, b| a.thickness.total_cmp(&b.thickness));
        let mut left = RIM * self.area;
        by_thickness.into_iter().find(|sample| {
            left -= sample.area;
            left < 0.0 && sample.thickness.is_finite()
        })
    }

    /// Why a lattice is refused.
    fn too_thin(&self, share: Option<f64>) -> ImportError {
        let needed = match self.thinnest() {
            Some(place) if place.thickness < FINE * self.coarsest() => {
                let uniform = self.nodes_at(place.thickness / FINE, false);
                uniform.min(self.nodes_at(self.coarsest(), true))
            }
            _ => self.nodes_at(self.coarsest(), false),
        };
        // Two digits, rounded up.
        let unit = 10f64.powf(needed.max(10.0).log10().floor() - 1.0);
        ImportError::Thin {
            volume_ml: 1e-3 * self.volume,
            share: share.map(|share| 100.0 * share),
            thickness_mm: self.thinnest().map_or(f64::NAN, |s| s.thickness),
            at: self.thinnest().map_or([f64::NAN; 3], Sample::middle),
            nodes: ((1.05 * needed / unit).ceil() * unit) as u64,
        }
    }

    fn attempt(&self, spacing: f64, graded: bool) -> Result<Attempt, StuffError> {
        if graded {
            let walls = Walls::of(&self.samples, FINE, spacing);
            self.judged(stuff_graded(&self.field, spacing, |corners, longest| {
                longest > FINEST * spacing && walls.finer_than(&corners, longest)
            })?)
        } else {
            self.judged(stuff_graded(&self.field, spacing, |_, _| false)?)
        }
    }

    fn judged(&self, made: Stuffed) -> Result<Attempt, StuffError> {
        let volume6 = |tet: &[u32; 4]| {
            let [a, b, c, d] = tet.map(|node| made.positions[node as usize]);
            volume6(a, b, c, d)
        };
        let volume = made.tets.iter().map(volume6).sum::<f64>() / 6.0;
        let whole = characteristic(&boundary(&made)) == self.euler;
        Ok(Attempt {
            share: volume / self.volume,
            whole,
            made,
        })
    }

    /// Where nothing but the flatness of large faces costs volume, the surface is moved outward by what
    /// they lack.
    fn rounded(&self, attempt: Attempt, spacing: f64, notes: &mut Vec<String>) -> Attempt {
        let flat = attempt.whole
            && (0.85..LEAST_SHARE).contains(&attempt.share)
            && self.thinner_than(1.2 * spacing) < 0.1 * self.volume;
        if !flat {
            return attempt;
        }
        let by = (1.0 - attempt.share) * self.volume / self.area;
        let moved = Offset {
            inner: &self.field,
            by,
        };
        let found = stuff_graded(&moved, spacing, |_, _| false)
            .and_then(|made| self.judged(made))
            .ok()
            .filter(|found| {
                found.whole && (LEAST_SHARE..=2.0 - LEAST_SHARE).contains(&found.share)
            });
        match found {
            Some(found) => {
                notes.push(format!(
                    "so few nodes round the body off: its surface is {by:.2} mm farther out, to keep the volume"
                ));
                found
            }
            None => attempt,
        }
    }

    fn at_spacing(&self, spacing: f64, notes: &mut Vec<String>) -> Result<Attempt, ImportError> {
        let uniform = match self.attempt(spacing, false) {
            Err(StuffError::Empty(_)) => None,
            found => Some(self.rounded(found?, spacing, notes)),
        };
        let graded = || self.attempt(spacing, true).map(|found| (found, spacing));
        self.better(uniform.map(|found| (found, spacing)), None, notes, graded)
    }

    fn to_count(&self, wanted: usize, notes: &mut Vec<String>) -> Result<Attempt, ImportError> {
        let spacing = self.spacing_of(wanted as f64, false);
        // Else most of it falls through the lattice.
        let hopeful = self.thinner_than(0.85 * spacing) < 0.2 * self.volume;
        let uniform = hopeful.then(|| self.search(wanted, false).ok()).flatten();
        let uniform = uniform.map(|(found, at)| (self.rounded(found, at, notes), at));
        let attempt = self.better(uniform, Some(wanted), notes, || {
            self.graded_to_count(wanted)
        })?;
        if !attempt.count_within(wanted) {
            notes.push(format!(
                "{} nodes, not {wanted}: no spacing comes nearer and holds the body",
                attempt.made.positions.len()
            ));
        }
        Ok(attempt)
    }

    /// The uniform lattice where it holds the body, else the graded one.
    fn better(
        &self,
        uniform: Option<(Attempt, f64)>,
        wanted: Option<usize>,
        notes: &mut Vec<String>,
        graded: impl FnOnce() -> Result<(Attempt, f64), StuffError>,
    ) -> Result<Attempt, ImportError> {
        let fits = |found: &Attempt| wanted.is_none_or(|wanted| found.count_within(wanted));
        let uniform = match uniform {
            Some((found, _)) if found.holds() && fits(&found) => return Ok(found),
            other => other,
        };
        let found = graded().ok();
        let share = (uniform.iter().chain(&found)).map(|(found, _)| found.share);
        let share = share.reduce(f64::max);
        if let Some((found, spacing)) = found
            && (found.holds()
                && (fits(&found) || !uniform.as_ref().is_some_and(|(u, _)| u.holds()))
                || self.passable(&found, spacing) && uniform.is_none())
        {
            let finest = self.thinnest().map_or(spacing, |place| place.thickness);
            notes.push(format!(
                "edges of {spacing:.1} mm, and finer where the body is as thin as {finest:.1} mm"
            ));
            return Ok(found);
        }
        match uniform {
            Some((found, spacing)) if found.holds() || self.passable(&found, spacing) => Ok(found),
            _ => Err(self.too_thin(share)),
        }
    }

    /// Whether a mesh holds the solid but for bridges or gaps that are small beside it. Holes in a wall are not.
    fn passable(&self, attempt: &Attempt, spacing: f64) -> bool {
        attempt.share >= LEAST_SHARE && self.thinner_than(1.3 * spacing) < 0.2 * self.volume
    }

    fn graded_to_count(&self, wanted: usize) -> Result<(Attempt, f64), StuffError> {
        let coarse = self.coarsest();
        if self.nodes_at(coarse, true) > 1.5 * wanted as f64 {
            return Err(StuffError::Empty(coarse));
        }
        let (found, spacing) = self.search(wanted, true)?;
        if found.made.positions.len() as f64 > 1.5 * wanted as f64 {
            return Err(StuffError::Empty(spacing));
        }
        Ok((found, spacing))
    }

    /// The spacing whose mesh has about so many nodes.
    fn search(&self, wanted: usize, graded: bool) -> Result<(Attempt, f64), StuffError> {
        let wanted = wanted as f64;
        let mut spacing = self.spacing_of(wanted, graded);
        let mut best: Option<(f64, Attempt, f64)> = None;
        let mut failed = StuffError::Empty(spacing);
        for _ in 0..TRIES {
            let found = match self.attempt(spacing, graded) {
                Ok(found) => found,
                Err(error) => {
                    failed = error;
                    spacing *= 0.7;
                    continue;
                }
            };
            let ratio = found.made.positions.len() as f64 / wanted;
            let miss = ratio.max(1.0 / ratio) - 1.0;
            let holds = found.holds();
            // A mesh that holds the body is worth some nodes more; there is nothing else to try with a graded one.
            let worth = miss + if holds { 0.0 } else { SAID_BEYOND };
            if best.as_ref().is_none_or(|(least, ..)| worth < *least) {
                best = Some((worth, found, spacing));
            }
            if miss <= COUNT_TOLERANCE && holds {
                break;
            }
            let aim = if holds || ratio < 1.0 - COUNT_TOLERANCE {
                1.0
            } else {
                1.0 + SAID_BEYOND
            };
            if ratio >= aim - COUNT_TOLERANCE && ratio <= aim + COUNT_TOLERANCE {
                break;
            }
            spacing *= (ratio / aim).cbrt().clamp(0.6, 1.6);
        }
        best.map(|(_, found, spacing)| (found, spacing))
            .ok_or(failed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_has_the_characteristic_of_a_ball() {
        assert_eq!(
            characteristic(&[[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]),
            2
        );
    }
}
