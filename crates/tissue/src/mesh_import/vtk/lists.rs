//! Lists of cells.

use super::super::error::{Fault, fault};

/// What a list of cells holds; in a grid each cell has its own kind.
#[derive(Clone, Copy, PartialEq)]
pub enum Role {
    Vertices,
    Lines,
    Polygons,
    Strips,
    Grid,
}

/// Lists of nodes behind each other.
#[derive(Default)]
pub struct Lists {
    pub nodes: Vec<i64>,
    /// Where each list ends.
    pub ends: Vec<i64>,
}

impl Lists {
    /// From lengths in front of the nodes, as files up to version 4.2 have them.
    pub fn from_lengths(words: &[i64], count: usize) -> Result<Self, Fault> {
        let mut out = Self::default();
        let mut rest = words;
        for cell in 0..count {
            let split = rest.split_first();
            let lists = split
                .and_then(|(&length, more)| more.split_at_checked(usize::try_from(length).ok()?));
            let Some((nodes, more)) = lists else {
                return fault(format!("cell {cell} reaches beyond the list of nodes"));
            };
            out.nodes.extend_from_slice(nodes);
            out.ends.push(out.nodes.len() as i64);
            rest = more;
        }
        Ok(out)
    }
}
