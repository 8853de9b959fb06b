//! Tetrahedra of TetGen: `NAME.node` (number, x, y, z, attributes, a marker) and `NAME.ele` (number, nodes, attributes) beside it.
//! Either file may be named. Nodes count from the first one's number, 0 or 1. Attributes of regions are names, `region=2`, and
//! markers of nodes `marker=1`.

use super::ImportError;
use super::body::{Read, TetList};
use super::error::{Fault, fault};
use super::labels::{Labels, Part, boundary};
use super::words::{Words, bytes_of, text};
use std::path::Path;

struct Nodes {
    first: u64,
    positions: Vec<[f64; 3]>,
    markers: Vec<i64>,
}

struct Elements {
    nodes: Vec<Vec<u32>>,
    regions: Vec<i64>,
}

fn open(path: &Path) -> Result<(Nodes, Elements, usize), ImportError> {
    let (node_file, ele_file) = (path.with_extension("node"), path.with_extension("ele"));
    let bytes = bytes_of(&node_file)?;
    let nodes = nodes(&text(&bytes)).map_err(|fault| fault.of(&node_file))?;
    let size = bytes.len();
    let bytes = bytes_of(&ele_file)?;
    let elements = elements(&text(&bytes), nodes.first).map_err(|fault| fault.of(&ele_file))?;
    Ok((nodes, elements, size + bytes.len()))
}

/// Reads the tetrahedra.
pub fn read(path: &Path) -> Result<Read, ImportError> {
    let (nodes, elements, _) = open(path)?;
    let mut tets = TetList::default();
    elements.nodes.iter().for_each(|nodes| tets.add(nodes));
    let none = "the file holds no tetrahedra";
    tets.finish(nodes.positions, none)
        .map_err(|fault| fault.of(path))
}

/// Reads attributes and markers.
pub fn read_labels(path: &Path) -> Result<Labels, ImportError> {
    let (nodes, elements, bytes) = open(path)?;
    labels(nodes, elements, bytes).map_err(|reason| Fault::Text(reason).of(path))
}

fn labels(nodes: Nodes, elements: Elements, bytes: usize) -> Result<Labels, String> {
    let mut out = Labels::of_file(bytes);
    for (point, marker) in nodes.markers.into_iter().enumerate() {
        let name = out.name(&format!("marker={marker}"));
        out.add(name, Part::Point(point))?;
    }
    for (tet, region) in elements.regions.into_iter().enumerate() {
        let name = out.name(&format!("region={region}"));
        out.add(name, Part::Tet(tet))?;
    }
    let corners = |nodes: &Vec<u32>| nodes.first_chunk::<4>().copied();
    out.tets = elements.nodes.iter().filter_map(corners).collect();
    out.faces = boundary(&out.tets);
    out.positions = nodes.positions;
    Ok(out)
}

fn nodes(text: &str) -> Result<Nodes, Fault> {
    let mut words = Words::new(text);
    let count = words.count("nodes", 4)?;
    let [dimension, attributes, markers] = [words.whole()?, words.whole()?, words.whole()?];
    if dimension != 3 || markers > 1 {
        return fault(format!(
            "line {}: the head of a .node file is its count, 3, the number of attributes, and 0 or 1 markers",
            words.line()
        ));
    }
    let mut out = Nodes {
        first: 0,
        positions: Vec::new(),
        markers: Vec::new(),
    };
    for index in 0..count as u64 {
        let number = words.whole()?;
        if index == 0 {
            out.first = number;
        }
        numbered("node", number, out.first, index, words.line())?;
        out.positions.push(words.point()?);
        for _ in 0..attributes {
            words.real()?;
        }
        if markers == 1 {
            out.markers.push(words.real()? as i64);
        }
    }
    Ok(out)
}

fn elements(text: &str, first: u64) -> Result<Elements, Fault> {
    let mut words = Words::new(text);
    let count = words.count("tetrahedra", 5)?;
    let [nodes, attributes] = [words.whole()?, words.whole()?];
    if nodes != 4 && nodes != 10 {
        return fault(format!(
            "line {}: elements of {nodes} nodes, must have 4 or 10",
            words.line()
        ));
    }
    let mut out = Elements {
        nodes: Vec::new(),
        regions: Vec::new(),
    };
    for index in 0..count as u64 {
        let number = words.whole()?;
        numbered("tetrahedron", number, first, index, words.line())?;
        let mut row = Vec::with_capacity(nodes as usize);
        for _ in 0..nodes {
            let node = words.whole()?.checked_sub(first);
            row.push(node.and_then(|n| u32::try_from(n).ok()).unwrap_or(u32::MAX));
        }
        out.nodes.push(row);
        for attribute in 0..attributes {
            let value = words.real()?;
            if attribute == 0 {
                out.regions.push(value as i64);
            }
        }
    }
    Ok(out)
}

fn numbered(what: &str, number: u64, first: u64, index: u64, line: usize) -> Result<(), Fault> {
    if first.checked_add(index) == Some(number) {
        return Ok(());
    }
    fault(format!(
        "line {line}: {what} {number} where {} is due: is a count wrong, or the file cut off?",
        first.saturating_add(index)
    ))
}
