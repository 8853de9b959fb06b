//! The checks of imported tetrahedra, in the order in which their repairs make sense.

use super::{ImportError, RawTets, Repair};
use std::collections::HashMap;

/// A tetrahedron is degenerate below this part of the cube of its longest edge (as in
/// `Mesh::validate`, with a margin for the rounding of positions to f32).
const DEGENERATE: f64 = 2e-6;

/// Checks `raw`; with `repair`, removes what is wrong and lists it.
pub fn tets(raw: &mut RawTets, repair: bool, repairs: &mut Vec<Repair>) -> Result<(), ImportError> {
    // The mesh stores f32; what is degenerate there must be found here.
    for x in raw.positions.iter_mut().flatten() {
        *x = f64::from(*x as f32);
    }
    node_range(raw)?;
    non_finite(raw, repair, repairs)?;
    duplicates(raw, repair, repairs)?;
    degenerate(raw, repair, repairs)?;
    inverted(raw, repair, repairs)?;
    components(raw, repair, repairs)?;
    unreferenced(raw, repair, repairs)
}

fn note(repairs: &mut Vec<Repair>, what: &'static str, bad: &[usize]) {
    repairs.push(Repair {
        what,
        count: bad.len(),
        first: bad[0],
    });
}

/// Drops the tetrahedra in `bad` (ascending).
fn drop_tets(raw: &mut RawTets, bad: &[usize]) {
    let mut index = 0;
    raw.tets.retain(|_| {
        index += 1;
        bad.binary_search(&(index - 1)).is_err()
    });
}

fn node_range(raw: &RawTets) -> Result<(), ImportError> {
    let count = raw.positions.len();
    for (index, tet) in raw.tets.iter().enumerate() {
        if let Some(&node) = tet.iter().find(|&&node| node as usize >= count) {
            return Err(ImportError::NodeOutOfRange {
                element: "tet",
                index,
                node,
                count,
            });
        }
    }
    Ok(())
}

fn non_finite(
    raw: &mut RawTets,
    repair: bool,
    repairs: &mut Vec<Repair>,
) -> Result<(), ImportError> {
    let broken = |node: usize| raw.positions[node].iter().any(|x| !x.is_finite());
    let Some(node) = (0..raw.positions.len()).find(|&node| broken(node)) else {
        return Ok(());
    };
    if !repair {
        return Err(ImportError::NonFinite { node });
    }
    let bad: Vec<usize> = (0..raw.tets.len())
        .filter(|&tet| raw.tets[tet].iter().any(|&node| broken(node as usize)))
        .collect();
    if !bad.is_empty() {
        drop_tets(raw, &bad);
        note(
            repairs,
            "tets dropped with a non-finite node (by file order)",
            &bad,
        );
    }
    Ok(())
}

fn duplicates(
    raw: &mut RawTets,
    repair: bool,
    repairs: &mut Vec<Repair>,
) -> Result<(), ImportError> {
    let mut seen: HashMap<[u32; 4], usize> = HashMap::with_capacity(raw.tets.len());
    let mut bad = Vec::new();
    for (index, tet) in raw.tets.iter().enumerate() {
        let mut key = *tet;
        key.sort_unstable();
        if let Some(&first) = seen.get(&key) {
            if !repair {
                return Err(ImportError::Duplicate {
                    first,
                    second: index,
                });
            }
            bad.push(index);
        } else {
            seen.insert(key, index);
        }
    }
    if !bad.is_empty() {
        drop_tets(raw, &bad);
        note(repairs, "repeated tets dropped (by file order)", &bad);
    }
    Ok(())
}

/// Signed volume and the cube of the longest edge.
fn measure(raw: &RawTets, tet: [u32; 4]) -> (f64, f64) {
    let corners = tet.map(|node| raw.positions[node as usize]);
    let mut longest = 0.0f64;
    for (i, p) in corners.iter().enumerate() {
        for q in &corners[i + 1..] {
            longest = longest.max((0..3).map(|k| (p[k] - q[k]).powi(2)).sum());
        }
    }
    let [a, b, c, d] = corners;
    let volume = crate::stuffing::volume6(a, b, c, d) / 6.0;
    (volume, longest.sqrt().powi(3))
}

fn degenerate(
    raw: &mut RawTets,
    repair: bool,
    repairs: &mut Vec<Repair>,
) -> Result<(), ImportError> {
    let bad: Vec<usize> = (0..raw.tets.len())
        .filter(|&tet| {
            let (volume, cube) = measure(raw, raw.tets[tet]);
            volume.abs() <= DEGENERATE * cube
        })
        .collect();
    let Some(&tet) = bad.first() else {
        return Ok(());
    };
    if !repair {
        return Err(ImportError::Degenerate {
            tet,
            volume_mm3: measure(raw, raw.tets[tet]).0,
            count: bad.len(),
        });
    }
    drop_tets(raw, &bad);
    note(repairs, "degenerate tets dropped", &bad);
    Ok(())
}

fn inverted(raw: &mut RawTets, repair: bool, repairs: &mut Vec<Repair>) -> Result<(), ImportError> {
    let bad: Vec<usize> = (0..raw.tets.len())
        .filter(|&tet| measure(raw, raw.tets[tet]).0 < 0.0)
        .collect();
    let Some(&tet) = bad.first() else {
        return Ok(());
    };
    if !repair {
        return Err(ImportError::Inverted {
            tet,
            volume_mm3: measure(raw, raw.tets[tet]).0,
            count: bad.len(),
        });
    }
    for &tet in &bad {
        raw.tets[tet].swap(2, 3);
    }
    note(repairs, "inverted tets turned", &bad);
    Ok(())
}

fn components(
    raw: &mut RawTets,
    repair: bool,
    repairs: &mut Vec<Repair>,
) -> Result<(), ImportError> {
    let (label, _) = crate::mesh::components(raw.positions.len(), &raw.tets);
    let mut volumes: HashMap<u32, f64> = HashMap::new();
    for tet in &raw.tets {
        *volumes.entry(label[tet[0] as usize]).or_default() += measure(raw, *tet).0;
    }
    if volumes.len() < 2 {
        return Ok(());
    }
    let part = |tet: [u32; 4]| label[tet[0] as usize];
    if !repair {
        let first = part(raw.tets[0]);
        let tet = raw
            .tets
            .iter()
            .position(|&tet| part(tet) != first)
            .unwrap_or(0);
        return Err(ImportError::Components {
            count: volumes.len(),
            tet,
            at: raw.positions[raw.tets[tet][0] as usize],
        });
    }
    let largest = volumes
        .iter()
        .max_by(|a, b| a.1.total_cmp(b.1).then(b.0.cmp(a.0)))
        .map(|(&label, _)| label);
    let bad: Vec<usize> = (0..raw.tets.len())
        .filter(|&tet| Some(part(raw.tets[tet])) != largest)
        .collect();
    drop_tets(raw, &bad);
    note(repairs, "tets of smaller parts dropped", &bad);
    Ok(())
}

fn unreferenced(
    raw: &mut RawTets,
    repair: bool,
    repairs: &mut Vec<Repair>,
) -> Result<(), ImportError> {
    let mut used = vec![false; raw.positions.len()];
    for &node in raw.tets.iter().flatten() {
        used[node as usize] = true;
    }
    let bad: Vec<usize> = (0..used.len()).filter(|&node| !used[node]).collect();
    let Some(&node) = bad.first() else {
        return Ok(());
    };
    if !repair {
        return Err(ImportError::Unreferenced {
            node,
            count: bad.len(),
        });
    }
    let mut renumbered = vec![0u32; used.len()];
    let mut next = 0;
    for (node, &keep) in used.iter().enumerate() {
        renumbered[node] = next;
        next += u32::from(keep);
    }
    let mut node = 0;
    raw.positions.retain(|_| {
        node += 1;
        used[node - 1]
    });
    for corner in raw.tets.iter_mut().flatten() {
        *corner = renumbered[*corner as usize];
    }
    note(repairs, "nodes of no tet dropped", &bad);
    Ok(())
}
