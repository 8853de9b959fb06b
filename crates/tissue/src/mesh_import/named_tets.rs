//! Tetrahedra whose file names sets of nodes and elements: Abaqus, CalculiX (`abaqus`) and FEBio (`febio`).

mod abaqus;
mod febio;

use super::labels::Labels;
use super::{ImportError, RawTets};
use std::collections::HashMap;
use std::path::Path;

/// What is wrong with the text of a file.
enum Wrong {
    Text(String),
    Kind { element: usize, kind: String },
}

fn wrong<T>(reason: impl Into<String>) -> Result<T, Wrong> {
    Err(Wrong::Text(reason.into()))
}

/// Nodes, tetrahedra and sets, by the numbers that the file gives them.
#[derive(Default)]
struct NamedTets {
    positions: Vec<[f64; 3]>,
    place_of_node: HashMap<u64, u32>,
    tets: Vec<[u64; 4]>,
    place_of_tet: HashMap<u64, usize>,
    nodes_of_set: Vec<(String, Vec<u64>)>,
    tets_of_set: Vec<(String, Vec<u64>)>,
}

impl NamedTets {
    pub fn node(&mut self, number: u64, point: [f64; 3]) -> Result<(), Wrong> {
        let place = self.positions.len() as u32;
        if self.place_of_node.insert(number, place).is_some() {
            return wrong(format!(
                "node {number} appears twice; a file may hold only one part, so export each part by itself"
            ));
        }
        self.positions.push(point);
        Ok(())
    }

    pub fn tet(&mut self, number: u64, nodes: [u64; 4]) -> Result<(), Wrong> {
        if (self.place_of_tet.insert(number, self.tets.len())).is_some() {
            return wrong(format!(
                "element {number} appears twice; a file may hold only one part, so export each part by itself"
            ));
        }
        self.tets.push(nodes);
        Ok(())
    }

    /// Adds to a set; numbers of elements that are no tetrahedra may be among them.
    pub fn nodes(&mut self, name: &str, numbers: Vec<u64>) {
        self.nodes_of_set.push((name.to_owned(), numbers));
    }

    pub fn elements(&mut self, name: &str, numbers: Vec<u64>) {
        self.tets_of_set.push((name.to_owned(), numbers));
    }

    /// Numbers of a set of elements that was read before.
    pub fn elements_of(&self, name: &str) -> Option<Vec<u64>> {
        numbers_of(&self.tets_of_set, name)
    }

    /// Numbers of a set of nodes that was read before.
    pub fn nodes_of(&self, name: &str) -> Option<Vec<u64>> {
        numbers_of(&self.nodes_of_set, name)
    }

    fn tets(&self) -> Result<Vec<[u32; 4]>, Wrong> {
        let row = |(element, nodes): (&u64, &[u64; 4])| {
            let mut tet = [0; 4];
            for (place, node) in tet.iter_mut().zip(nodes) {
                *place = match self.place_of_node.get(node) {
                    Some(&place) => place,
                    None => {
                        return wrong(format!(
                            "element {element} names node {node}, which does not exist"
                        ));
                    }
                };
            }
            Ok(tet)
        };
        let mut numbers: Vec<(&u64, &usize)> = self.place_of_tet.iter().collect();
        numbers.sort_unstable_by_key(|(_, place)| **place);
        numbers
            .into_iter()
            .map(|(number, &place)| row((number, &self.tets[place])))
            .collect()
    }

    fn raw(self) -> Result<RawTets, Wrong> {
        if self.tets.is_empty() {
            return wrong("the file holds no linear tetrahedra (C3D4, tet4)");
        }
        let tets = self.tets()?;
        Ok(RawTets {
            positions: self.positions,
            tets,
        })
    }

    fn labels(self) -> Result<Labels, Wrong> {
        let tets = self.tets()?;
        // Points are looked up on the body's own boundary.
        let faces = match crate::mesh::boundary_faces(&tets) {
            Ok(faces) => faces,
            Err(error) => return wrong(error.to_string()),
        };
        let mut labels = Labels {
            of_point: vec![Vec::new(); self.positions.len()],
            of_tet: vec![Vec::new(); tets.len()],
            positions: self.positions,
            faces,
            tets,
            ..Labels::default()
        };
        for (name, numbers) in &self.nodes_of_set {
            for place in numbers.iter().filter_map(|n| self.place_of_node.get(n)) {
                labels.of_point[*place as usize].push(name.clone());
            }
        }
        for (name, numbers) in &self.tets_of_set {
            for place in numbers.iter().filter_map(|n| self.place_of_tet.get(n)) {
                labels.of_tet[*place].push(name.clone());
            }
        }
        Ok(labels)
    }
}

fn numbers_of(sets: &[(String, Vec<u64>)], name: &str) -> Option<Vec<u64>> {
    let mut same = sets.iter().filter(|(n, _)| n.eq_ignore_ascii_case(name));
    let first = same.next()?;
    let all = std::iter::once(first).chain(same);
    Some(all.flat_map(|(_, numbers)| numbers.clone()).collect())
}

fn parsed(path: &Path) -> Result<NamedTets, ImportError> {
    let bytes = std::fs::read(path).map_err(|source| ImportError::Io {
        path: path.into(),
        source,
    })?;
    // Comments may be in any encoding.
    let text = String::from_utf8_lossy(&bytes);
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    let read = match extension.eq_ignore_ascii_case("feb") {
        true => febio::parse(&text),
        false => abaqus::parse(&text),
    };
    read.map_err(|error| named(path, error))
}

fn named(path: &Path, error: Wrong) -> ImportError {
    match error {
        Wrong::Text(reason) => ImportError::Format {
            path: path.into(),
            reason,
        },
        Wrong::Kind { element, kind } => ImportError::ElementKind {
            path: path.into(),
            element,
            kind,
        },
    }
}

/// Reads the linear tetrahedra of an `.inp` or `.feb` file.
pub(super) fn read(path: &Path) -> Result<RawTets, ImportError> {
    parsed(path)?.raw().map_err(|error| named(path, error))
}

/// Reads its sets.
pub(super) fn read_labels(path: &Path) -> Result<Labels, ImportError> {
    parsed(path)?.labels().map_err(|error| named(path, error))
}
