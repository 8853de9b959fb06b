//! Repairs of a surface's faces: corners that differ in the last digits welded, repeated faces dropped, faces turned that are
//! turned against their neighbours.

use super::labels::sorted;
use super::{RawSurface, Repair};
use std::collections::{HashMap, HashSet};

/// Corners of open edges are welded within these parts of the box's diagonal, the first that closes the surface.
const WELDS: [f64; 5] = [1e-8, 1e-7, 1e-6, 1e-5, 1e-4];

/// Welds corners of open edges where that closes the surface, and otherwise leaves it as it is.
pub fn weld(surface: &mut RawSurface, repairs: &mut Vec<Repair>) {
    let open = open_nodes(surface);
    if open.is_empty() {
        return;
    }
    let diagonal = diagonal(surface);
    for part in WELDS {
        let place = clusters(surface, &open, part * diagonal);
        let weld = |face: &[u32; 3]| face.map(|node| place[node as usize]);
        let welded = RawSurface {
            positions: surface.positions.clone(),
            faces: surface.faces.iter().map(weld).collect(),
        };
        let collapsed = |[a, b, c]: [u32; 3]| a == b || b == c || c == a;
        let mut both = surface.faces.iter().zip(&welded.faces);
        if both.any(|(&old, &new)| collapsed(new) && !collapsed(old)) {
            return;
        }
        if open_nodes(&welded).is_empty() {
            let moved: Vec<usize> = (0..place.len())
                .filter(|&node| place[node] != node as u32)
                .collect();
            repairs.push(Repair {
                what: "corners welded that differ in their last digits",
                count: moved.len(),
                first: moved.first().copied().unwrap_or(0),
            });
            *surface = welded;
            return;
        }
    }
}

/// Nodes of edges with one face, ascending.
fn open_nodes(surface: &RawSurface) -> Vec<u32> {
    let mut count: HashMap<[u32; 2], u32> = HashMap::new();
    for [a, b] in surface.faces.iter().flat_map(edges) {
        *count.entry([a.min(b), a.max(b)]).or_default() += 1;
    }
    let open = count.into_iter().filter(|(_, faces)| *faces == 1);
    let mut nodes: Vec<u32> = open.flat_map(|(edge, _)| edge).collect();
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}

fn edges(&[a, b, c]: &[u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

fn diagonal(surface: &RawSurface) -> f64 {
    let span = |k: usize| {
        let values = surface.positions.iter().map(|p| p[k]);
        let low = values.clone().fold(f64::INFINITY, f64::min);
        values.fold(f64::NEG_INFINITY, f64::max) - low
    };
    (span(0).powi(2) + span(1).powi(2) + span(2).powi(2)).sqrt()
}

/// For each node the one that it is welded to: the first of `open` within `distance`.
fn clusters(surface: &RawSurface, open: &[u32], distance: f64) -> Vec<u32> {
    let mut place: Vec<u32> = (0..surface.positions.len() as u32).collect();
    let cell = |p: [f64; 3]| p.map(|x| (x / distance).floor() as i64);
    // First nodes of clusters lie farther apart than `distance`, so that a cell holds few.
    let mut firsts: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    for &node in open {
        let point = surface.positions[node as usize];
        let home = cell(point);
        let near = |first: &&u32| {
            let other = surface.positions[**first as usize];
            let squared: f64 = (0..3).map(|k| (point[k] - other[k]).powi(2)).sum();
            squared <= distance * distance
        };
        let around = (0..27i64).map(|at| {
            let by = [at % 3 - 1, at / 3 % 3 - 1, at / 9 - 1];
            [0, 1, 2].map(|k| home[k].saturating_add(by[k]))
        });
        let found = around
            .filter_map(|cell| firsts.get(&cell))
            .flatten()
            .find(near);
        match found {
            Some(&first) => place[node as usize] = first,
            None => firsts.entry(home).or_default().push(node),
        }
    }
    place
}

/// Drops faces that have the corners of an earlier one, whichever way they are turned.
pub fn drop_repeated(surface: &mut RawSurface, repairs: &mut Vec<Repair>) {
    let mut seen = HashSet::new();
    let mut bad = Vec::new();
    let mut index = 0;
    surface.faces.retain(|&face| {
        let is_new = seen.insert(sorted(face));
        if !is_new {
            bad.push(index);
        }
        index += 1;
        is_new
    });
    note(repairs, "repeated faces dropped", &bad);
}

/// Turns faces so that neighbours agree: in each part the fewer. A surface with one side alone (Moebius) stays as it is.
///
/// Each edge must have two faces.
pub fn turn(surface: &mut RawSurface, repairs: &mut Vec<Repair>) {
    let mut faces_of: HashMap<[u32; 2], Vec<(usize, bool)>> = HashMap::new();
    for (index, face) in surface.faces.iter().enumerate() {
        for [a, b] in edges(face) {
            let faces = faces_of.entry([a.min(b), a.max(b)]).or_default();
            faces.push((index, a < b));
        }
    }
    let mut side: Vec<Option<bool>> = vec![None; surface.faces.len()];
    let mut bad = Vec::new();
    for start in 0..side.len() {
        if side[start].is_some() {
            continue;
        }
        side[start] = Some(false);
        let (mut part, mut at) = (vec![start], 0);
        while at < part.len() {
            let index = part[at];
            at += 1;
            for [a, b] in edges(&surface.faces[index]) {
                for &(other, way) in &faces_of[&[a.min(b), a.max(b)]] {
                    if other == index {
                        continue;
                    }
                    let is_against = way == (a < b);
                    let wanted = side[index].map(|side| side != is_against);
                    match side[other] {
                        None => {
                            side[other] = wanted;
                            part.push(other);
                        }
                        found if found != wanted => return,
                        _ => {}
                    }
                }
            }
        }
        let turned = |&&face: &&usize| side[face] == Some(true);
        let count = part.iter().filter(turned).count();
        let fewer = 2 * count <= part.len();
        bad.extend(part.into_iter().filter(|&face| side[face] == Some(fewer)));
    }
    bad.sort_unstable();
    for &face in &bad {
        surface.faces[face].swap(1, 2);
    }
    note(
        repairs,
        "faces turned that were turned against their neighbours",
        &bad,
    );
}

fn note(repairs: &mut Vec<Repair>, what: &'static str, bad: &[usize]) {
    if let Some(&first) = bad.first() {
        repairs.push(Repair {
            what,
            count: bad.len(),
            first,
        });
    }
}
