//! Makes the boundary of stuffed tetrahedra a closed manifold.
//!
//! Where two parts of the surface come closer than the lattice can tell, they may touch in an edge
//! or in a node only. There the smaller of the touching fans of tetrahedra is dropped, until every
//! boundary edge has two faces and the tetrahedra around every node hang together by faces.
//! Of several face-connected bodies the largest (most tetrahedra) is kept.

use super::Stuffed;
use std::collections::{BTreeMap, BTreeSet};

const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// Drops tetrahedra until the boundary is manifold and the body is one; then drops unused nodes.
pub fn repair(mesh: &mut Stuffed) {
    let before = mesh.tets.len();
    loop {
        keep_largest(&mut mesh.tets);
        let drop = touching(&mesh.tets);
        if drop.is_empty() {
            break;
        }
        let mut index = 0;
        mesh.tets.retain(|_| {
            index += 1;
            !drop.contains(&(index - 1))
        });
    }
    mesh.dropped = before - mesh.tets.len();
    compact(mesh);
}

fn sorted<const N: usize>(mut nodes: [u32; N]) -> [u32; N] {
    nodes.sort_unstable();
    nodes
}

/// The two tetrahedra of every face, `u32::MAX` where there is none, by the face's sorted nodes.
fn faces(tets: &[[u32; 4]]) -> Vec<([u32; 3], u32, u32)> {
    let mut all: Vec<([u32; 3], u32)> = tets
        .iter()
        .enumerate()
        .flat_map(|(index, tet)| {
            FACES.map(|face| (sorted(face.map(|local| tet[local])), index as u32))
        })
        .collect();
    all.sort_unstable();
    let mut pairs = Vec::with_capacity(all.len() / 2);
    let mut at = 0;
    while at < all.len() {
        let (face, one) = all[at];
        match all.get(at + 1) {
            Some(&(same, other)) if same == face => {
                pairs.push((face, one, other));
                at += 2;
            }
            _ => {
                pairs.push((face, one, u32::MAX));
                at += 1;
            }
        }
    }
    pairs
}

/// Root of `item` in a forest of parents, with path halving.
fn root(parents: &mut [u32], mut item: u32) -> u32 {
    while parents[item as usize] != item {
        let above = parents[item as usize];
        parents[item as usize] = parents[above as usize];
        item = parents[item as usize];
    }
    item
}

fn keep_largest(tets: &mut Vec<[u32; 4]>) {
    let mut parents: Vec<u32> = (0..tets.len() as u32).collect();
    for (_, one, other) in faces(tets) {
        if other != u32::MAX {
            let (a, b) = (root(&mut parents, one), root(&mut parents, other));
            parents[a.max(b) as usize] = a.min(b);
        }
    }
    let roots: Vec<u32> = (0..tets.len() as u32)
        .map(|tet| root(&mut parents, tet))
        .collect();
    let mut sizes = vec![0usize; tets.len()];
    for &body in &roots {
        sizes[body as usize] += 1;
    }
    let largest = (0..sizes.len()).rev().max_by_key(|&body| sizes[body]);
    let mut index = 0;
    tets.retain(|_| {
        index += 1;
        Some(roots[index - 1] as usize) == largest
    });
}

/// Tetrahedra to drop: of each edge or node whose tetrahedra fall apart, all but the largest group.
fn touching(tets: &[[u32; 4]]) -> BTreeSet<usize> {
    let pairs = faces(tets);
    let mut of_edge: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    let mut rim = BTreeSet::new();
    for &(face, _, other) in &pairs {
        if other == u32::MAX {
            rim.extend(face);
            for (a, b) in [(0, 1), (0, 2), (1, 2)] {
                *of_edge.entry([face[a], face[b]]).or_default() += 1;
            }
        }
    }
    let edges: BTreeSet<[u32; 2]> = of_edge
        .into_iter()
        .filter_map(|(edge, count)| (count > 2).then_some(edge))
        .collect();

    let mut stars: BTreeMap<u32, Vec<u32>> = rim.into_iter().map(|node| (node, vec![])).collect();
    let mut around: BTreeMap<[u32; 2], Vec<u32>> =
        edges.iter().map(|&edge| (edge, vec![])).collect();
    for (index, tet) in tets.iter().enumerate() {
        for node in tet {
            if let Some(star) = stars.get_mut(node) {
                star.push(index as u32);
            }
        }
        if !edges.is_empty() {
            for (a, b) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
                if let Some(ring) = around.get_mut(&sorted([tet[a], tet[b]])) {
                    ring.push(index as u32);
                }
            }
        }
    }
    let mut drop = BTreeSet::new();
    for (edge, ring) in &around {
        drop.extend(smaller_groups(tets, ring, edge));
    }
    if drop.is_empty() {
        for (node, star) in &stars {
            drop.extend(smaller_groups(tets, star, &[*node]));
        }
    }
    drop
}

/// Groups `members` by shared faces that hold all `through` nodes; all tetrahedra but those of the
/// largest group (the first of equals).
fn smaller_groups(tets: &[[u32; 4]], members: &[u32], through: &[u32]) -> Vec<usize> {
    let mut parents: Vec<u32> = (0..members.len() as u32).collect();
    let mut seen: BTreeMap<[u32; 3], u32> = BTreeMap::new();
    for (local, &tet) in members.iter().enumerate() {
        for face in FACES {
            let face = sorted(face.map(|corner| tets[tet as usize][corner]));
            if through.iter().any(|node| !face.contains(node)) {
                continue;
            }
            if let Some(&other) = seen.get(&face) {
                let (a, b) = (root(&mut parents, other), root(&mut parents, local as u32));
                parents[a.max(b) as usize] = a.min(b);
            } else {
                seen.insert(face, local as u32);
            }
        }
    }
    let groups: Vec<u32> = (0..members.len() as u32)
        .map(|local| root(&mut parents, local))
        .collect();
    let size = |group: u32| groups.iter().filter(|&&other| other == group).count();
    let Some(&largest) = groups.iter().rev().max_by_key(|&&group| size(group)) else {
        return Vec::new();
    };
    members
        .iter()
        .zip(&groups)
        .filter(|&(_, &group)| group != largest)
        .map(|(&tet, _)| tet as usize)
        .collect()
}

/// Drops nodes that no tetrahedron uses, keeping the order of the rest.
fn compact(mesh: &mut Stuffed) {
    let mut used = vec![false; mesh.positions.len()];
    for &node in mesh.tets.iter().flatten() {
        used[node as usize] = true;
    }
    let mut renumbered = vec![0; used.len()];
    let mut count = 0;
    for (node, &keep) in used.iter().enumerate() {
        renumbered[node] = count;
        count += u32::from(keep);
    }
    let mut node = 0;
    mesh.positions.retain(|_| {
        node += 1;
        used[node - 1]
    });
    for corner in mesh.tets.iter_mut().flatten() {
        *corner = renumbered[*corner as usize];
    }
}
