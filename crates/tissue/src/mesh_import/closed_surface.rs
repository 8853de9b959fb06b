//! Whether triangles bound a body: closed, each edge with two faces, one direction, one part.

use super::{ImportError, RawSurface, Repair, surface_repair};
use std::collections::BTreeMap;

/// Checks a surface. Corners that differ in their last digits are welded where that closes it. With `repair`, drops degenerate and
/// repeated faces, turns faces that are turned against their neighbours, keeps the largest part and turns an inside-out surface.
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
    parts(surface, repair, repairs)?;
    let volume_mm3 = volume(surface);
    if volume_mm3 < 0.0 {
        if !repair {
            return Err(ImportError::InsideOut { volume_mm3 });
        }
        surface.faces.iter_mut().for_each(|face| face.swap(1, 2));
        repairs.push(Repair {
            what: "faces of an inside-out surface turned",
            count: surface.faces.len(),
            first: 0,
        });
    }
    Ok(())
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
    if !repair {
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

fn parts(
    surface: &mut RawSurface,
    repair: bool,
    repairs: &mut Vec<Repair>,
) -> Result<(), ImportError> {
    let mut neighbours = vec![Vec::new(); surface.faces.len()];
    for faces in faces_of_edges(surface).values() {
        for &(one, _) in faces {
            neighbours[one].extend(faces.iter().map(|&(other, _)| other));
        }
    }
    let mut part = vec![usize::MAX; surface.faces.len()];
    let mut count = 0;
    for start in 0..part.len() {
        if part[start] != usize::MAX {
            continue;
        }
        let mut stack = vec![start];
        while let Some(face) = stack.pop() {
            if part[face] == usize::MAX {
                part[face] = count;
                stack.extend(&neighbours[face]);
            }
        }
        count += 1;
    }
    if count < 2 {
        return Ok(());
    }
    let second = part.iter().position(|&p| p == 1).unwrap_or(0);
    if !repair {
        return Err(ImportError::SurfaceParts {
            count,
            face: second,
        });
    }
    let mut size = vec![0.0; count];
    for (&face, &part) in surface.faces.iter().zip(&part) {
        let [a, b, c] = face.map(|node| surface.positions[node as usize]);
        size[part] += crate::stuffing::volume6([0.0; 3], a, b, c);
    }
    let largest = (0..count)
        .max_by(|&a, &b| size[a].abs().total_cmp(&size[b].abs()).then(b.cmp(&a)))
        .unwrap_or(0);
    let before = surface.faces.len();
    let first = part.iter().position(|&p| p != largest).unwrap_or(0);
    let mut index = 0;
    surface.faces.retain(|_| {
        index += 1;
        part[index - 1] == largest
    });
    repairs.push(Repair {
        what: "faces of smaller parts dropped",
        count: before - surface.faces.len(),
        first,
    });
    Ok(())
}
