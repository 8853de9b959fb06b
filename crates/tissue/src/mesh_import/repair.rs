//! The checks of imported tetrahedra, in the order in which their repairs make sense.

use super::bodies;
use super::choice::Names;
use super::{ImportError, ImportOptions, RawSurface, RawTets, Repair};
use std::collections::{HashMap, HashSet};

/// A tetrahedron is degenerate below this part of the cube of its longest edge (as in
/// `Mesh::validate`, with a margin for the rounding of positions to f32).
const DEGENERATE: f64 = 2e-6;

/// Checks `raw`; with `repair`, removes what is wrong and lists it. Of several bodies the chosen one is kept.
pub fn tets(
    raw: &mut RawTets,
    options: &ImportOptions,
    names: impl FnOnce() -> Names,
    repairs: &mut Vec<Repair>,
    notes: &mut Vec<String>,
) -> Result<(), ImportError> {
    let repair = options.repair;
    // The mesh stores f32; what is degenerate there must be found here.
    for x in raw.positions.iter_mut().flatten() {
        *x = f64::from(*x as f32);
    }
    node_range(raw)?;
    weld(raw, repairs);
    non_finite(raw, repair, repairs)?;
    duplicates(raw, repair, repairs)?;
    degenerate(raw, repair, repairs)?;
    inverted(raw, repair, repairs)?;
    let chosen = repairs.len();
    bodies::keep_one_of_tets(raw, options, names, repairs, notes)?;
    // The nodes of a body that was not chosen are no fault.
    unreferenced(raw, repair || repairs.len() > chosen, repairs)
}

/// The boundary of tetrahedra however bad they are: faces that belong to one of them alone. Nodes at one place are one, and a
/// tetrahedron that is there twice counts once.
pub fn boundary(mut raw: RawTets, repairs: &mut Vec<Repair>) -> Result<RawSurface, ImportError> {
    node_range(&raw)?;
    weld(&mut raw, repairs);
    let mut seen = HashSet::with_capacity(raw.tets.len());
    raw.tets.retain(|tet| {
        let mut key = *tet;
        key.sort_unstable();
        key.windows(2).all(|pair| pair[0] != pair[1]) && seen.insert(key)
    });
    // Faces outward, as far as a tetrahedron without volume has an outside.
    let turned: Vec<usize> = (0..raw.tets.len())
        .filter(|&tet| measure(&raw, raw.tets[tet]).0 < 0.0)
        .collect();
    turned.iter().for_each(|&tet| raw.tets[tet].swap(2, 3));
    Ok(RawSurface {
        faces: crate::mesh::boundary_faces(&raw.tets)?,
        positions: raw.positions,
    })
}

/// Makes nodes at exactly the same place one: exporters of several parts write the nodes between them once for each.
fn weld(raw: &mut RawTets, repairs: &mut Vec<Repair>) {
    let mut first_at: HashMap<[u64; 3], u32> = HashMap::with_capacity(raw.positions.len());
    let place: Vec<u32> = (raw.positions.iter().zip(0..))
        // Adding zero makes -0 and 0 the same key.
        .map(|(point, node)| {
            *first_at
                .entry(point.map(|x| (x + 0.0).to_bits()))
                .or_insert(node)
        })
        .collect();
    let mut used = vec![false; place.len()];
    raw.tets
        .iter()
        .flatten()
        .for_each(|&node| used[node as usize] = true);
    let bad: Vec<usize> = (0..place.len())
        .filter(|&node| used[node] && used[place[node] as usize] && place[node] as usize != node)
        .collect();
    if bad.is_empty() {
        return;
    }
    let moved: HashSet<usize> = bad.iter().copied().collect();
    for node in raw.tets.iter_mut().flatten() {
        if moved.contains(&(*node as usize)) {
            *node = place[*node as usize];
        }
    }
    // They go now, so that they are not called nodes without a tetrahedron.
    drop_nodes(raw, |node| !moved.contains(&node));
    note(
        repairs,
        "nodes at the place of another made one with it",
        &bad,
    );
}

/// Drops nodes and numbers the others anew.
fn drop_nodes(raw: &mut RawTets, keep: impl Fn(usize) -> bool) {
    let mut renumbered = vec![0u32; raw.positions.len()];
    let mut next = 0;
    for (node, number) in renumbered.iter_mut().enumerate() {
        *number = next;
        next += u32::from(keep(node));
    }
    let mut node = 0;
    raw.positions.retain(|_| {
        node += 1;
        keep(node - 1)
    });
    for corner in raw.tets.iter_mut().flatten() {
        *corner = renumbered[*corner as usize];
    }
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
    if !repair || bad.len() == raw.tets.len() {
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
    drop_nodes(raw, |node| used[node]);
    note(repairs, "nodes of no tet dropped", &bad);
    Ok(())
}
