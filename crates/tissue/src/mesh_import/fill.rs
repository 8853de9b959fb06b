//! Fills a closed surface with tetrahedra, and sees to it that they hold the solid.
//!
//! A uniform lattice comes first. Where it loses a wall, a neck or a tunnel, tetrahedra are bisected
//! until their edges are shorter than the body is thick ([`thickness`]). What then still loses more than
//! [`LEAST_SHARE`] allows is refused, with the thinnest place and the nodes that it needs.

use super::solid::{FINE, Solid, characteristic, two_digits};
use super::walls::Walls;
use super::{ImportError, RawSurface, RawTets, Resolution};
use crate::mesh_quality::dihedral_angles;
use crate::stuffing::{Offset, StuffError, Stuffed, stuff_graded, volume6};

/// The part of the solid's volume that the tetrahedra hold at least.
const LEAST_SHARE: f64 = 0.97;
/// Walls are resolved by edges of their thickness over the first of these, necks by one of the others.
const FINER: [f64; 4] = [FINE, 2.0, 3.0, 4.5];
/// Dihedral angles, degrees, from which on a mesh is fit for simulation.
const SOUND_DEG: f64 = 5.0;
/// Tunnels that a mesh may have and its surface not, where the body is not thin: two places that nearly touch.
const FEW_HOLES: i64 = 2;
/// Bisection goes down to this part of the spacing.
const FINEST: f64 = 1.0 / 64.0;
/// Node counts within this part of the wanted one are accepted; within the second without a word.
const COUNT_TOLERANCE: f64 = 0.02;
const SAID_BEYOND: f64 = 0.15;
/// Part of the thinnest wall that its edges take, so that the rest of it is no thinner.
const SNUG: f64 = 0.97;
/// Meshes that are made in search of a count.
const TRIES: usize = 5;
/// The nodes that a refusal advises are tried where they are so few, so often; more are advised with a margin.
const TRIED_NODES: u64 = 20_000;
const TRIED: usize = 4;
const MARGIN: f64 = 1.4;

/// A surface's tetrahedra and what there is to say about them.
pub struct Filled {
    pub raw: RawTets,
    pub notes: Vec<String>,
}

/// Tetrahedra of one lattice.
struct Attempt {
    made: Stuffed,
    /// Of the solid's volume.
    share: f64,
    /// As many tunnels and gaps as the surface.
    whole: bool,
    /// Tunnels that the surface does not have.
    holes: i64,
    /// No slivers.
    sound: bool,
}

impl Attempt {
    /// Whether no tissue is lost.
    fn holds(&self) -> bool {
        self.whole && self.sound && self.share >= LEAST_SHARE
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
    let solid = Solid::of(surface)?;
    let mut notes = Vec::new();
    let attempt = match resolution {
        Resolution::Spacing(spacing) => solid.at_spacing(spacing, &mut notes),
        Resolution::Nodes(wanted) => solid.to_count(wanted.max(8), &mut notes),
    }
    .map_err(|error| solid.with_enough_nodes(error))?;
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

fn boundary(made: &Stuffed) -> Vec<[u32; 3]> {
    crate::mesh::boundary_faces(&made.tets).unwrap_or_default()
}

impl Solid {
    /// A refusal with a number of nodes that is enough: tried, or with a margin.
    fn with_enough_nodes(&self, refused: ImportError) -> ImportError {
        let &ImportError::Thin { mut nodes, .. } = &refused else {
            return refused;
        };
        for _ in 0..TRIED {
            if nodes > TRIED_NODES {
                break;
            }
            match self.to_count(nodes as usize, &mut Vec::new()) {
                Err(ImportError::Thin { nodes: more, .. }) => nodes = more,
                _ => return refused.with_nodes(nodes),
            }
        }
        refused.with_nodes(two_digits(MARGIN * nodes as f64))
    }

    /// A lattice that is finer where the body is thinner than `fine` times its edges, or a uniform one.
    fn attempt(&self, spacing: f64, fine: Option<f64>) -> Result<Attempt, StuffError> {
        if let Some(fine) = fine {
            let walls = Walls::of(&self.samples, fine, spacing);
            self.judged(stuff_graded(&self.field, spacing, |corners, size| {
                size > FINEST * spacing && walls.finer_than(&corners, size)
            })?)
        } else {
            self.judged(stuff_graded(&self.field, spacing, |_, _| false)?)
        }
    }

    fn judged(&self, made: Stuffed) -> Result<Attempt, StuffError> {
        let corners = |tet: &[u32; 4]| tet.map(|node| made.positions[node as usize]);
        let volume6 = |tet: &[u32; 4]| {
            let [a, b, c, d] = corners(tet);
            volume6(a, b, c, d)
        };
        let volume = made.tets.iter().map(volume6).sum::<f64>() / 6.0;
        let sound = |angle: &f64| (SOUND_DEG..180.0 - SOUND_DEG).contains(angle);
        let sound = |tet: &[u32; 4]| dihedral_angles(corners(tet)).iter().all(sound);
        let less = self.euler - characteristic(&boundary(&made));
        Ok(Attempt {
            share: volume / self.volume,
            whole: less == 0,
            holes: less / 2,
            sound: made.tets.iter().all(sound),
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
        let uniform = match self.attempt(spacing, None) {
            Err(StuffError::Empty(_)) => None,
            found => Some(self.rounded(found?, spacing, notes)),
        };
        let graded = |fine| {
            self.attempt(spacing, Some(fine))
                .map(|found| (found, spacing))
        };
        self.better(uniform.map(|found| (found, spacing)), None, notes, graded)
    }

    fn to_count(&self, wanted: usize, notes: &mut Vec<String>) -> Result<Attempt, ImportError> {
        let spacing = self.spacing_of(wanted as f64, false);
        // Else most of it falls through the lattice.
        let hopeful = self.thinner_than(0.85 * spacing) < 0.2 * self.volume;
        let uniform = hopeful.then(|| self.search(wanted, None).ok()).flatten();
        let uniform = uniform.map(|(found, at)| (self.rounded(found, at, notes), at));
        let attempt = self.better(uniform, Some(wanted), notes, |fine| {
            self.graded_to_count(wanted, fine)
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
        graded: impl Fn(f64) -> Result<(Attempt, f64), StuffError>,
    ) -> Result<Attempt, ImportError> {
        let fits = |found: &Attempt| wanted.is_none_or(|wanted| found.count_within(wanted));
        let uniform = match uniform {
            Some((found, _)) if found.holds() && fits(&found) => return Ok(found),
            other => other,
        };
        let mut found = None;
        for fine in FINER {
            found = graded(fine).ok();
            // A neck may need more; a wall has holes for another reason, or too many nodes already.
            let is_neck = |(found, at): &(Attempt, f64)| {
                !found.holds() && self.thinner_than(*at) < 0.1 * self.volume
            };
            if !found.as_ref().is_some_and(is_neck) {
                break;
            }
        }
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
            _ => Err(self.too_thin(share, wanted)),
        }
    }

    /// Whether a mesh holds the solid but for bridges or gaps that are small beside it. Holes in a wall are not.
    fn passable(&self, attempt: &Attempt, spacing: f64) -> bool {
        attempt.share >= LEAST_SHARE
            && attempt.sound
            && attempt.holes <= FEW_HOLES
            && self.thinner_than(1.3 * spacing) < 0.2 * self.volume
    }

    fn graded_to_count(&self, wanted: usize, fine: f64) -> Result<(Attempt, f64), StuffError> {
        let coarse = self.coarsest();
        if self.nodes_at(coarse, true) > 1.5 * wanted as f64 {
            return Err(StuffError::Empty(coarse));
        }
        let (found, spacing) = self.search(wanted, Some(fine))?;
        if found.made.positions.len() as f64 > 1.5 * wanted as f64 {
            return Err(StuffError::Empty(spacing));
        }
        Ok((found, spacing))
    }

    /// The spacing whose mesh has about so many nodes.
    fn search(&self, wanted: usize, fine: Option<f64>) -> Result<(Attempt, f64), StuffError> {
        let wanted = wanted as f64;
        let mut spacing = self.spacing_of(wanted, fine.is_some());
        if let Some((fine, wall)) = fine.zip(self.thinnest()) {
            // Bisected some times, which each time makes it a third of an octave smaller, it fits the wall.
            let fit = SNUG * wall.thickness / fine;
            let steps = (3.0 * (spacing / fit).log2()).round().max(0.0);
            spacing = fit * 2f64.powf(steps / 3.0);
        }
        let mut best: Option<(f64, Attempt, f64)> = None;
        let mut failed = StuffError::Empty(spacing);
        for _ in 0..TRIES {
            let found = match self.attempt(spacing, fine) {
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
