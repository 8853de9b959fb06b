//! Whether triangles bound bodies: closed, each edge with two faces, one direction.

use super::{ImportError, RawSurface, Repair, bodies, surface_repair};
use std::collections::BTreeMap;

/// Checks a surface. Corners that differ in their last digits are welded where that closes it. With `repair`, drops degenerate and
/// repeated faces, turns faces that are turned against their neighbours, and turns inside-out bodies.
/// Holes and edges of more than two faces are always errors.
pub fn check(
    surface: &mut RawSurface,
    repair: bool,
    repairs: &mut Vec<Repair>,
) -> Result<(), ImportError> {
    let count = surface.positions.len();
    for (index, face) in surface.faces.iter().enumerate() {
        if let Some(&node) = face.iter().find(|&&node| node as usize >= count) {
            return Err(ImportError::NodeOutOfRange {
                element: "face",
                index,
                node,
                count,
            });
        }
    }
    let finite = |p: &[f64; 3]| p.iter().all(|x| x.is_finite());
    if let Some(node) = surface.positions.iter().position(|p| !finite(p)) {
        return Err(ImportError::NonFinite { node });
    }
    surface_repair::weld(surface, repairs);
    degenerate(surface, repair, repairs)?;
    if repair {
        surface_repair::drop_repeated(surface, repairs);
    }
    closed(surface)?;
    if repair {
        surface_repair::turn(surface, repairs);
    }
    oriented(surface)?;
    bodies::orient(surface, repair, repairs)
}

/// Enclosed volume, mm³; negative when the faces look inward.
pub fn volume(surface: &RawSurface) -> f64 {
    let at = |node: u32| surface.positions[node as usize];
    surface
        .faces
        .iter()
        .map(|&[a, b, c]| crate::stuffing::volume6([0.0; 3], at(a), at(b), at(c)) / 6.0)
        .sum()
}

fn degenerate(
    surface: &mut RawSurface,
    repair: bool,
    repairs: &mut Vec<Repair>,
) -> Result<(), ImportError> {
    let collapsed = |[a, b, c]: [u32; 3]| a == b || b == c || c == a;
    let bad: Vec<usize> = (0..surface.faces.len())
        .filter(|&face| collapsed(surface.faces[face]))
        .collect();
    let Some(&face) = bad.first() else {
        return Ok(());
    };
    if !repair || bad.len() == surface.faces.len() {
        return Err(ImportError::DegenerateFace {
            face,
            count: bad.len(),
        });
    }
    surface.faces.retain(|&face| !collapsed(face));
    repairs.push(Repair {
        what: "degenerate faces dropped",
        count: bad.len(),
        first: face,
    });
    Ok(())
}

/// Faces at each edge, with whether they run from the lower to the higher node.
fn faces_of_edges(surface: &RawSurface) -> BTreeMap<[u32; 2], Vec<(usize, bool)>> {
    let mut edges: BTreeMap<[u32; 2], Vec<(usize, bool)>> = BTreeMap::new();
    for (index, face) in surface.faces.iter().enumerate() {
        for side in 0..3 {
            let (a, b) = (face[side], face[(side + 1) % 3]);
            edges
                .entry([a.min(b), a.max(b)])
                .or_default()
                .push((index, a < b));
        }
    }
    edges
}

/// Whether each edge has two faces.
fn closed(surface: &RawSurface) -> Result<(), ImportError> {
    let all = faces_of_edges(surface);
    let open = all.values().filter(|faces| faces.len() == 1).count();
    let odd = all.into_iter().find(|(_, faces)| faces.len() != 2);
    let Some((edge, faces)) = odd else {
        return Ok(());
    };
    let (face, at) = (faces[0].0, surface.positions[edge[0] as usize]);
    Err(match faces.len() {
        1 => ImportError::Open {
            edge,
            face,
            at,
            count: open,
        },
        faces => ImportError::SurfaceEdge {
            edge,
            face,
            at,
            faces,
        },
    })
}

/// Whether neighbours are turned alike.
fn oriented(surface: &RawSurface) -> Result<(), ImportError> {
    for (edge, faces) in faces_of_edges(surface) {
        if let [one, other] = faces[..]
            && one.1 == other.1
        {
            return Err(ImportError::Orientation {
                first: one.0,
                second: other.0,
                edge,
            });
        }
    }
    Ok(())
}
