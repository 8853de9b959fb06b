//! The bodies that a file holds: parts of tetrahedra, and closed surfaces, of which some bound a void of another.

use super::choice::{Names, choose};
use super::found_body::FoundBody;
use super::{ImportError, ImportOptions, RawSurface, RawTets, Repair, SurfaceDistance};
use crate::stuffing::{Field, volume6};
use std::collections::HashMap;

fn centroid(corners: &[[f64; 3]]) -> [f64; 3] {
    let part = 1.0 / corners.len() as f64;
    [0, 1, 2].map(|k| corners.iter().map(|p| part * p[k]).sum())
}

/// A closed part of a surface.
struct Part {
    faces: Vec<usize>,
    /// Signed: negative where the faces look inward.
    volume: f64,
    centre: [f64; 3],
    low: [f64; 3],
    high: [f64; 3],
}

impl Part {
    fn of(surface: &RawSurface, faces: Vec<usize>) -> Self {
        let origin = surface.positions[surface.faces[faces[0]][0] as usize];
        let mut part = Self {
            faces,
            volume: 0.0,
            centre: [0.0; 3],
            low: [f64::INFINITY; 3],
            high: [f64::NEG_INFINITY; 3],
        };
        for &face in &part.faces {
            let corners = surface.faces[face].map(|node| surface.positions[node as usize]);
            let [a, b, c] = corners;
            let own = volume6(origin, a, b, c) / 6.0;
            part.volume += own;
            for k in 0..3 {
                part.centre[k] += own * (origin[k] + a[k] + b[k] + c[k]) / 4.0;
                for corner in corners {
                    part.low[k] = part.low[k].min(corner[k]);
                    part.high[k] = part.high[k].max(corner[k]);
                }
            }
        }
        let volume = part.volume;
        part.centre = part.centre.map(|x| x / volume);
        part
    }

    fn surface(&self, surface: &RawSurface) -> RawSurface {
        RawSurface {
            positions: surface.positions.clone(),
            faces: self.faces.iter().map(|&face| surface.faces[face]).collect(),
        }
    }
}

/// The parts of a closed surface that share no edge, by their first faces.
fn parts(surface: &RawSurface) -> Vec<Part> {
    let mut parent: Vec<u32> = (0..surface.faces.len() as u32).collect();
    fn root(parent: &mut [u32], mut face: u32) -> u32 {
        while parent[face as usize] != face {
            parent[face as usize] = parent[parent[face as usize] as usize];
            face = parent[face as usize];
        }
        face
    }
    let mut of_edge = HashMap::with_capacity(2 * surface.faces.len());
    for (&[a, b, c], face) in surface.faces.iter().zip(0..) {
        for [one, other] in [[a, b], [b, c], [c, a]] {
            let first = *of_edge
                .entry([one.min(other), one.max(other)])
                .or_insert(face);
            let (first, face) = (root(&mut parent, first), root(&mut parent, face));
            parent[first.max(face) as usize] = first.min(face);
        }
    }
    let mut place = HashMap::new();
    let mut faces: Vec<Vec<usize>> = Vec::new();
    for index in 0..surface.faces.len() {
        let top = root(&mut parent, index as u32);
        let at = *place.entry(top).or_insert(faces.len());
        if at == faces.len() {
            faces.push(Vec::new());
        }
        faces[at].push(index);
    }
    faces
        .into_iter()
        .map(|faces| Part::of(surface, faces))
        .collect()
}

/// The smallest part around each.
fn around(surface: &RawSurface, parts: &[Part]) -> Result<Vec<Option<usize>>, ImportError> {
    let mut by_size: Vec<usize> = (0..parts.len()).collect();
    by_size.sort_by(|&a, &b| parts[a].volume.abs().total_cmp(&parts[b].volume.abs()));
    let mut fields: Vec<Option<SurfaceDistance>> = parts.iter().map(|_| None).collect();
    let mut found = vec![None; parts.len()];
    for (rank, &inner) in by_size.iter().enumerate() {
        for &outer in &by_size[rank + 1..] {
            let (one, other) = (&parts[inner], &parts[outer]);
            let within = |k: usize| other.low[k] <= one.low[k] && one.high[k] <= other.high[k];
            if !(0..3).all(within) {
                continue;
            }
            let field = match &mut fields[outer] {
                Some(field) => field,
                empty => empty.insert(SurfaceDistance::new(other.surface(surface))?),
            };
            let corner = surface.faces[one.faces[0]][0];
            let inward = field.value(surface.positions[corner as usize]);
            if inward * other.volume > 0.0 {
                found[inner] = Some(outer);
                break;
            }
        }
    }
    Ok(found)
}

/// Turns what looks inward and lies in nothing, with all that lies in it; with `repair`, or it is an error.
///
/// # Errors
/// [`ImportError::InsideOut`].
pub fn orient(
    surface: &mut RawSurface,
    repair: bool,
    repairs: &mut Vec<Repair>,
) -> Result<(), ImportError> {
    let parts = parts(surface);
    if parts.iter().all(|part| part.volume > 0.0) {
        return Ok(());
    }
    let around = around(surface, &parts)?;
    let outermost = |mut at: usize| {
        while let Some(outer) = around[at] {
            at = outer;
        }
        at
    };
    let turned: Vec<&Part> = (0..parts.len())
        .filter(|&at| parts[outermost(at)].volume < 0.0)
        .map(|at| &parts[at])
        .collect();
    let Some(first) = turned.first() else {
        return Ok(());
    };
    if !repair {
        return Err(ImportError::InsideOut {
            volume_mm3: first.volume,
        });
    }
    let faces = turned.iter().flat_map(|part| &part.faces);
    faces
        .clone()
        .for_each(|&face| surface.faces[face].swap(1, 2));
    repairs.push(Repair {
        what: "faces of an inside-out surface turned",
        count: faces.count(),
        first: first.faces[0],
    });
    Ok(())
}

/// Keeps one body of an oriented surface, with its voids: closed parts within it that look inward.
///
/// # Errors
/// [`ImportError::Bodies`] where there are several.
pub fn keep_one(
    surface: &mut RawSurface,
    options: &ImportOptions,
    names: impl FnOnce() -> Names,
    repairs: &mut Vec<Repair>,
    notes: &mut Vec<String>,
) -> Result<(), ImportError> {
    let parts = parts(surface);
    if parts.len() < 2 && options.part.is_none() {
        return Ok(());
    }
    let around = around(surface, &parts)?;
    // Bodies, in the order of the file.
    let solid: Vec<usize> = (0..parts.len())
        .filter(|&at| parts[at].volume > 0.0)
        .collect();
    // The body whose void a part is: the nearest around it that looks outward.
    let owner = |mut at: usize| {
        while parts[at].volume < 0.0 {
            at = around[at]?;
        }
        Some(at)
    };
    let mut volume: Vec<f64> = parts.iter().map(|part| part.volume).collect();
    for at in (0..parts.len()).filter(|&at| parts[at].volume < 0.0) {
        if let Some(owner) = owner(at) {
            volume[owner] += parts[at].volume;
        }
    }
    let names = names();
    let bodies: Vec<FoundBody> = (solid.iter())
        .map(|&at| {
            let first = surface.faces[parts[at].faces[0]];
            let corners = first.map(|node| surface.positions[node as usize]);
            FoundBody {
                name: names.at(centroid(&corners)),
                volume_mm3: volume[at],
                centre: parts[at].centre,
            }
        })
        .collect();
    let kept = solid[choose(&bodies, options, notes)?];
    let mut voids = 0.0;
    let mut chosen: Vec<usize> = Vec::new();
    for (at, part) in parts.iter().enumerate() {
        if owner(at) == Some(kept) {
            chosen.extend(&part.faces);
            voids -= part.volume.min(0.0);
        }
    }
    if voids > 0.0 {
        notes.push(format!("voids of {:.3} ml stay empty", 1e-3 * voids));
    }
    chosen.sort_unstable();
    if let Some(first) = (0..surface.faces.len()).find(|at| chosen.get(*at) != Some(at)) {
        repairs.push(Repair {
            what: "faces of other bodies dropped",
            count: surface.faces.len() - chosen.len(),
            first,
        });
    }
    surface.faces = chosen.into_iter().map(|face| surface.faces[face]).collect();
    Ok(())
}

/// Keeps one of the bodies of tetrahedra that share no node.
///
/// # Errors
/// [`ImportError::Bodies`] where there are several.
pub fn keep_one_of_tets(
    raw: &mut RawTets,
    options: &ImportOptions,
    names: impl FnOnce() -> Names,
    repairs: &mut Vec<Repair>,
    notes: &mut Vec<String>,
) -> Result<(), ImportError> {
    let (label, count) = crate::mesh::components(raw.positions.len(), &raw.tets);
    let mut first: Vec<Option<usize>> = vec![None; count];
    let mut sums = vec![(0.0, [0.0; 3]); count];
    for (index, tet) in raw.tets.iter().enumerate() {
        let corners = tet.map(|node| raw.positions[node as usize]);
        let [a, b, c, d] = corners;
        let (volume, middle) = (volume6(a, b, c, d) / 6.0, centroid(&corners));
        let body = label[tet[0] as usize] as usize;
        first[body].get_or_insert(index);
        sums[body].0 += volume;
        (0..3).for_each(|k| sums[body].1[k] += volume * middle[k]);
    }
    // Nodes without a tetrahedron are no bodies.
    let mut found: Vec<(usize, usize)> = (first.iter().enumerate())
        .filter_map(|(body, first)| Some(((*first)?, body)))
        .collect();
    if found.len() < 2 && options.part.is_none() {
        return Ok(());
    }
    found.sort_unstable();
    let names = names();
    let bodies: Vec<FoundBody> = (found.iter())
        .map(|&(first, body)| {
            let (volume_mm3, moment) = sums[body];
            let corners = raw.tets[first].map(|node| raw.positions[node as usize]);
            FoundBody {
                name: names.at(centroid(&corners)),
                volume_mm3,
                centre: moment.map(|x| x / volume_mm3),
            }
        })
        .collect();
    let (_, kept) = found[choose(&bodies, options, notes)?];
    let outside = |tet: &[u32; 4]| label[tet[0] as usize] as usize != kept;
    if let Some(first) = raw.tets.iter().position(outside) {
        let before = raw.tets.len();
        raw.tets.retain(|tet| !outside(tet));
        repairs.push(Repair {
            what: "tets of other bodies dropped",
            count: before - raw.tets.len(),
            first,
        });
    }
    Ok(())
}
