//! Physical groups of a Gmsh file: the sections `$PhysicalNames` and `$Entities` (4.1), and which elements are in which group.

use super::{Cursor, Fault};
use std::collections::HashMap;

/// Triangles and tetrahedra with the groups that they are in.
#[derive(Default)]
pub(super) struct Groups {
    /// Names by dimension and number.
    names: HashMap<(i64, i64), String>,
    /// Lists of physical groups. Elements share them, since an entity may have many of both.
    pub(super) lists: Vec<Vec<i64>>,
    /// The list of an entity, by dimension and tag (4.1).
    entities: HashMap<(i64, i64), usize>,
    /// The list of one group alone.
    singles: HashMap<i64, usize>,
    /// Node tags of the corners of each triangle and tetrahedron, and its list.
    pub(super) elements: Vec<(Vec<u64>, usize)>,
}

impl Groups {
    /// Adds an element by its corners.
    pub fn add(&mut self, corners: &[u64], list: usize) {
        self.elements.push((corners.to_vec(), list));
    }

    fn new_list(&mut self, groups: Vec<i64>) -> usize {
        self.lists.push(groups);
        self.lists.len() - 1
    }

    /// The list of an entity of version 4.1.
    pub fn of_entity(&mut self, dimension: i64, tag: i64) -> usize {
        match self.entities.get(&(dimension, tag)) {
            Some(&list) => list,
            None => self.list_of(0),
        }
    }

    /// The list of one group; 0 is none.
    pub fn list_of(&mut self, group: i64) -> usize {
        if let Some(&list) = self.singles.get(&group) {
            return list;
        }
        let list = self.new_list(if group > 0 { vec![group] } else { Vec::new() });
        self.singles.insert(group, list);
        list
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
            let name = cursor.quoted()?;
            self.names.insert(key, name);
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
                groups.retain(|&group| group > 0);
                groups.sort_unstable();
                groups.dedup();
                let list = self.new_list(groups);
                self.entities.insert((dimension as i64, tag), list);
            }
        }
        Ok(())
    }
}
