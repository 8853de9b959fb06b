//! Physical groups of a Gmsh file: the sections `$PhysicalNames` and `$Entities` (4.1), and which elements are in which group.

use super::{Cursor, Fault, Parts, fault};
use crate::mesh_import::labels::Labels;
use std::collections::HashMap;

/// Triangles and tetrahedra with the groups that they are in.
#[derive(Default)]
pub(super) struct Groups {
    /// Names by dimension and number.
    names: HashMap<(i64, i64), String>,
    /// Physical groups of an entity, by dimension and tag (4.1).
    entities: HashMap<(i64, i64), Vec<i64>>,
    /// Node tags of each triangle and tetrahedron, its dimension and the numbers of its groups.
    pub elements: Vec<(Vec<u64>, i64, Vec<i64>)>,
}

impl Groups {
    /// Adds an element; `list` holds its nodes, as many as its kind has.
    pub fn add(&mut self, kind: i64, list: &[u64], groups: &[i64]) {
        let dimension = match kind {
            2 => 2,
            4 => 3,
            _ => return,
        };
        let groups = groups.iter().copied().filter(|&group| group > 0);
        self.elements
            .push((list.to_vec(), dimension, groups.collect()));
    }

    /// The groups of an entity of version 4.1.
    pub fn of_entity(&self, dimension: i64, tag: i64) -> Vec<i64> {
        let found = self.entities.get(&(dimension, tag));
        found.cloned().unwrap_or_default()
    }

    /// What a group is called: its number, and its name where it has one.
    pub fn words(&self, dimension: i64, group: i64) -> Vec<String> {
        let name = self.names.get(&(dimension, group)).cloned();
        std::iter::once(group.to_string()).chain(name).collect()
    }

    /// `$PhysicalNames`: text in binary files too.
    pub fn read_names(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        let count: usize = cursor.parsed()?;
        for _ in 0..count {
            let key = (cursor.parsed()?, cursor.parsed()?);
            let mut name = cursor.word()?.to_owned();
            while name.len() < 2 || !name.ends_with('"') {
                if !name.starts_with('"') {
                    return fault(format!("physical name {name} has no quotes"));
                }
                name = format!("{name} {}", cursor.word()?);
            }
            self.names.insert(key, name.trim_matches('"').to_owned());
        }
        Ok(())
    }

    /// `$Entities` of version 4.1.
    pub fn read_entities(&mut self, cursor: &mut Cursor<'_>) -> Result<(), Fault> {
        cursor.begin_block();
        let counts = [
            cursor.size()?,
            cursor.size()?,
            cursor.size()?,
            cursor.size()?,
        ];
        for (dimension, count) in counts.into_iter().enumerate() {
            for _ in 0..count {
                let tag = cursor.int()?;
                for _ in 0..if dimension == 0 { 3 } else { 6 } {
                    cursor.real()?;
                }
                let mut groups = Vec::new();
                for _ in 0..cursor.size()? {
                    groups.push(cursor.int()?.abs());
                }
                if dimension > 0 {
                    for _ in 0..cursor.size()? {
                        cursor.int()?;
                    }
                }
                self.entities.insert((dimension as i64, tag), groups);
            }
        }
        Ok(())
    }
}

/// Names of the triangles and tetrahedra that are in groups.
pub(super) fn labels(parts: Parts) -> Labels {
    let mut labels = Labels {
        positions: parts.positions,
        ..Labels::default()
    };
    for (tags, dimension, groups) in &parts.groups.elements {
        let names = groups
            .iter()
            .flat_map(|&group| parts.groups.words(*dimension, group))
            .collect();
        let nodes: Option<Vec<u32>> = tags
            .iter()
            .map(|tag| parts.node_of_tag.get(tag).copied())
            .collect();
        match nodes.as_deref() {
            Some(&[a, b, c]) => {
                labels.faces.push([a, b, c]);
                labels.of_face.push(names);
            }
            Some(&[a, b, c, d]) => {
                labels.tets.push([a, b, c, d]);
                labels.of_tet.push(names);
            }
            _ => {}
        }
    }
    labels
}
