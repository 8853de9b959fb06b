//! Tetrahedra of a Gmsh mesh, MSH 2.2 and 4.1, text and binary (either byte order); version 1 is in `version_1`.
//!
//! A strict reader of the sections that matter, `$Nodes` and `$Elements`, written from the format's
//! description in the Gmsh manual; node tags may be sparse. Points, lines and faces are skipped.

mod groups;
mod version_1;

use super::labels::Labels;
use super::{ImportError, RawTets};
use groups::Groups;
use std::collections::HashMap;
use std::path::Path;

/// Reads the linear tetrahedra of a file.
pub fn read(path: &Path) -> Result<RawTets, ImportError> {
    named(path, |bytes| parse(bytes).and_then(finish))
}

/// Reads the triangles and tetrahedra with their physical groups; coordinates as the file has them.
pub(super) fn read_labels(path: &Path) -> Result<Labels, ImportError> {
    named(path, parse).map(groups::labels)
}

fn named<T>(path: &Path, read: impl FnOnce(&[u8]) -> Result<T, Fault>) -> Result<T, ImportError> {
    let bytes = std::fs::read(path).map_err(|source| ImportError::Io {
        path: path.into(),
        source,
    })?;
    read(&bytes).map_err(|fault| match fault {
        Fault::Text(reason) => ImportError::Format {
            path: path.into(),
            reason,
        },
        Fault::Kind { element, kind } => ImportError::ElementKind {
            path: path.into(),
            element,
            kind: format!("Gmsh element type {kind}"),
        },
    })
}

enum Fault {
    Text(String),
    Kind { element: usize, kind: i64 },
}

fn fault<T>(reason: impl Into<String>) -> Result<T, Fault> {
    Err(Fault::Text(reason.into()))
}

/// Gmsh element types that are skipped (points, lines, faces of any order), by number of nodes;
/// and the linear tetrahedron.
const TETRAHEDRON: i64 = 4;
fn node_count(kind: i64, element: usize) -> Result<usize, Fault> {
    match kind {
        15 => Ok(1),
        1 => Ok(2),
        2 | 8 => Ok(3),
        3 | 4 => Ok(4),
        _ => Err(Fault::Kind { element, kind }),
    }
}

/// Walks the bytes of a file, text or binary.
struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    binary: bool,
    swapped: bool,
}

impl<'a> Cursor<'a> {
    fn skip_space(&mut self) {
        while self.bytes.get(self.at).is_some_and(u8::is_ascii_whitespace) {
            self.at += 1;
        }
    }

    /// The next word of text.
    fn word(&mut self) -> Result<&'a str, Fault> {
        self.skip_space();
        let start = self.at;
        while self
            .bytes
            .get(self.at)
            .is_some_and(|b| !b.is_ascii_whitespace())
        {
            self.at += 1;
        }
        if start == self.at {
            return fault("the file ends too early");
        }
        std::str::from_utf8(&self.bytes[start..self.at])
            .or_else(|_| fault(format!("byte {start}: not text where text is due")))
    }

    /// To the first byte of a binary block.
    fn begin_block(&mut self) {
        if self.binary {
            self.end_line();
        }
    }

    /// Past the end of the line, which opens a binary block.
    fn end_line(&mut self) {
        while self.at < self.bytes.len() && self.bytes[self.at] != b'\n' {
            self.at += 1;
        }
        self.at = (self.at + 1).min(self.bytes.len());
    }

    fn raw<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        let Some(chunk) = self.bytes.get(self.at..self.at + N) else {
            return fault("the file ends inside a binary block");
        };
        self.at += N;
        let mut out = [0; N];
        out.copy_from_slice(chunk);
        if self.swapped {
            out.reverse();
        }
        Ok(out)
    }

    fn parsed<T: std::str::FromStr>(&mut self) -> Result<T, Fault> {
        let word = self.word()?;
        word.parse().or_else(|_| {
            fault(format!(
                "`{word}` (before byte {}) is not a number",
                self.at
            ))
        })
    }

    /// A 4-byte integer where binary.
    fn int(&mut self) -> Result<i64, Fault> {
        if self.binary {
            Ok(i64::from(i32::from_le_bytes(self.raw()?)))
        } else {
            self.parsed()
        }
    }

    /// An 8-byte size where binary.
    fn size(&mut self) -> Result<u64, Fault> {
        if self.binary {
            Ok(u64::from_le_bytes(self.raw()?))
        } else {
            self.parsed()
        }
    }

    fn real(&mut self) -> Result<f64, Fault> {
        if self.binary {
            Ok(f64::from_le_bytes(self.raw()?))
        } else {
            self.parsed()
        }
    }

    fn expect(&mut self, wanted: &str) -> Result<(), Fault> {
        match self.word()? {
            word if word == wanted => Ok(()),
            word => fault(format!("`{word}` where `{wanted}` is due")),
        }
    }

    /// Past the line `$End<section>`.
    fn skip_section(&mut self, section: &str) -> Result<(), Fault> {
        let end = format!("$End{section}");
        match self.bytes[self.at..]
            .windows(end.len())
            .position(|window| window == end.as_bytes())
        {
            Some(offset) => {
                self.at += offset + end.len();
                Ok(())
            }
            None => fault(format!("section ${section} has no {end}")),
        }
    }
}

/// What the sections give: coordinates by order of appearance, and their tags.
#[derive(Default)]
struct Parts {
    positions: Vec<[f64; 3]>,
    node_of_tag: HashMap<u64, u32>,
    tets: Vec<[u64; 4]>,
    groups: Groups,
}

impl Parts {
    fn node(&mut self, tag: u64, point: [f64; 3]) -> Result<(), Fault> {
        let node = self.positions.len() as u32;
        if self.node_of_tag.insert(tag, node).is_some() {
            return fault(format!("node tag {tag} appears twice"));
        }
        self.positions.push(point);
        Ok(())
    }
}

fn parse(bytes: &[u8]) -> Result<Parts, Fault> {
    let mut cursor = Cursor {
        bytes,
        at: 0,
        binary: false,
        swapped: false,
    };
    if version_1::is_version_1(bytes) {
        return version_1::parse(&mut cursor);
    }
    cursor.expect("$MeshFormat")?;
    let version = cursor.word()?;
    let four = match version {
        "2.2" => false,
        "4.1" => true,
        other => {
            return fault(format!(
                "MSH version {other}; save as 4.1 or 2.2 (gmsh -format msh41)"
            ));
        }
    };
    let binary = cursor.parsed::<u8>()? == 1;
    if cursor.parsed::<u8>()? != 8 {
        return fault("the data size is not 8 bytes");
    }
    if binary {
        cursor.end_line();
        match cursor.raw::<4>()? {
            [1, 0, 0, 0] => {}
            [0, 0, 0, 1] => cursor.swapped = true,
            _ => return fault("the byte-order mark of the header is damaged"),
        }
    }
    cursor.expect("$EndMeshFormat")?;
    let mut parts = Parts::default();
    loop {
        cursor.skip_space();
        if cursor.at == bytes.len() {
            break;
        }
        let word = cursor.word()?;
        let Some(section) = word.strip_prefix('$') else {
            return fault(format!("`{word}` where a $Section is due"));
        };
        if !matches!(section, "Nodes" | "Elements" | "PhysicalNames" | "Entities") {
            cursor.skip_section(section)?;
            continue;
        }
        cursor.binary = binary && section != "PhysicalNames";
        match (section, four) {
            ("PhysicalNames", _) => parts.groups.read_names(&mut cursor)?,
            ("Entities", _) => parts.groups.read_entities(&mut cursor)?,
            ("Nodes", true) => nodes_4(&mut cursor, &mut parts)?,
            ("Nodes", false) => nodes_2(&mut cursor, &mut parts)?,
            (_, true) => elements_4(&mut cursor, &mut parts)?,
            (_, false) => elements_2(&mut cursor, &mut parts)?,
        }
        cursor.binary = false;
        cursor.expect(&format!("$End{section}"))?;
    }
    Ok(parts)
}

fn finish(parts: Parts) -> Result<RawTets, Fault> {
    if parts.tets.is_empty() {
        return fault("the file holds no tetrahedra; mesh the volume (gmsh -3)");
    }
    let mut tets = Vec::with_capacity(parts.tets.len());
    for (index, tet) in parts.tets.iter().enumerate() {
        let mut nodes = [0; 4];
        for (node, tag) in nodes.iter_mut().zip(tet) {
            match parts.node_of_tag.get(tag) {
                Some(&found) => *node = found,
                None => {
                    return fault(format!(
                        "tet {index} names node tag {tag}, which does not exist"
                    ));
                }
            }
        }
        tets.push(nodes);
    }
    Ok(RawTets {
        positions: parts.positions,
        tets,
    })
}

fn nodes_2(cursor: &mut Cursor, parts: &mut Parts) -> Result<(), Fault> {
    let count: u64 = cursor.parsed()?;
    cursor.end_line();
    for _ in 0..count {
        let tag = cursor.int()? as u64;
        let point = [cursor.real()?, cursor.real()?, cursor.real()?];
        parts.node(tag, point)?;
    }
    Ok(())
}

fn elements_2(cursor: &mut Cursor, parts: &mut Parts) -> Result<(), Fault> {
    let count: usize = cursor.parsed()?;
    cursor.end_line();
    let mut element = 0;
    while element < count {
        // Text has one header an element, binary one a block: type, elements, tags.
        let (kind, block, tags) = if cursor.binary {
            (cursor.int()?, cursor.int()?, cursor.int()?)
        } else {
            let _tag = cursor.int()?;
            (cursor.int()?, 1, cursor.int()?)
        };
        let nodes = node_count(kind, element)?;
        if block < 1 {
            return fault("an element block holds no element");
        }
        for _ in 0..block {
            if cursor.binary {
                cursor.int()?;
            }
            // The first tag is the physical group.
            let mut physical = 0;
            for at in 0..tags {
                let tag = cursor.int()?;
                if at == 0 {
                    physical = tag;
                }
            }
            let mut list = [0u64; 4];
            for node in list.iter_mut().take(nodes) {
                *node = cursor.int()? as u64;
            }
            parts.groups.add(kind, &list[..nodes], &[physical]);
            if kind == TETRAHEDRON {
                parts.tets.push(list);
            }
            element += 1;
        }
    }
    Ok(())
}

fn nodes_4(cursor: &mut Cursor, parts: &mut Parts) -> Result<(), Fault> {
    cursor.begin_block();
    let blocks = cursor.size()?;
    let [_count, _lowest, _highest] = [cursor.size()?, cursor.size()?, cursor.size()?];
    for _ in 0..blocks {
        let dimension = cursor.int()?;
        let _entity = cursor.int()?;
        let parametric = cursor.int()? != 0;
        let count = cursor.size()?;
        let mut tags = Vec::new();
        for _ in 0..count {
            tags.push(cursor.size()?);
        }
        for tag in tags {
            let point = [cursor.real()?, cursor.real()?, cursor.real()?];
            if parametric {
                for _ in 0..dimension {
                    cursor.real()?;
                }
            }
            parts.node(tag, point)?;
        }
    }
    Ok(())
}

fn elements_4(cursor: &mut Cursor, parts: &mut Parts) -> Result<(), Fault> {
    cursor.begin_block();
    let blocks = cursor.size()?;
    let [_count, _lowest, _highest] = [cursor.size()?, cursor.size()?, cursor.size()?];
    let mut element = 0;
    for _ in 0..blocks {
        let [dimension, entity, kind] = [cursor.int()?, cursor.int()?, cursor.int()?];
        let nodes = node_count(kind, element)?;
        let physical = parts.groups.of_entity(dimension, entity);
        for _ in 0..cursor.size()? {
            let _tag = cursor.size()?;
            let mut list = [0u64; 4];
            for node in list.iter_mut().take(nodes) {
                *node = cursor.size()?;
            }
            parts.groups.add(kind, &list[..nodes], &physical);
            if kind == TETRAHEDRON {
                parts.tets.push(list);
            }
            element += 1;
        }
    }
    Ok(())
}
