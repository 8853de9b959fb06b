//! Tetrahedra of a Gmsh mesh, MSH 2 (2.0 to 2.2) and 4.1, text and binary (either byte order); version 1 is in `version_1`.
//!
//! A strict reader of the sections that matter, `$Nodes` and `$Elements`, written from the format's
//! description in the Gmsh manual; node tags may be sparse. Points, lines and faces are skipped, tetrahedra of higher order read by
//! their corners.

mod cursor;
mod groups;
mod parts;
mod version_1;

use super::ImportError;
use super::body::{Read, TetList};
use super::error::{Fault, fault};
use super::labels::Labels;
use super::words::{bytes_of, short};
use cursor::Cursor;
use parts::{Parts, shape};
use std::path::Path;

/// Reads the tetrahedra of a file.
pub fn read(path: &Path) -> Result<Read, ImportError> {
    named(path, |bytes| parse(bytes).and_then(finish))
}

/// Reads the triangles and tetrahedra with their physical groups; coordinates as the file has them.
pub(super) fn read_labels(path: &Path) -> Result<Labels, ImportError> {
    named(path, |bytes| {
        parse(bytes).and_then(|parts| parts::labels(parts, bytes.len()))
    })
}

fn named<T>(path: &Path, read: impl FnOnce(&[u8]) -> Result<T, Fault>) -> Result<T, ImportError> {
    let bytes = bytes_of(path)?;
    read(&bytes).map_err(|fault| fault.of(path))
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
        "2" | "2.0" | "2.1" | "2.2" => false,
        "4.1" => true,
        other => {
            return fault(format!(
                "MSH version {}; only 1, 2.0 to 2.2 and 4.1 are read; convert it with `gmsh IN.msh -save -format msh41 -o OUT.msh`",
                short(other)
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
            return fault(format!("`{}` where a $Section is due", short(word)));
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

fn finish(parts: Parts) -> Result<Read, Fault> {
    let mut tets = TetList::default();
    for (index, tet) in parts.tets.iter().enumerate() {
        let mut nodes = Vec::with_capacity(tet.len());
        for tag in tet {
            match parts.node_of_tag.get(tag) {
                Some(&node) => nodes.push(node),
                None => {
                    return fault(format!(
                        "tet {index} names node tag {tag}, which does not exist"
                    ));
                }
            }
        }
        tets.add(&nodes);
    }
    let none = "the file holds no tetrahedra; mesh the volume (gmsh -3)";
    tets.finish(parts.positions, none)
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
        let (shape, nodes) = shape(kind, element)?;
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
            let list = (0..nodes).map(|_| Ok(cursor.int()? as u64));
            let list = list.collect::<Result<_, Fault>>()?;
            let physical = parts.groups.list_of(physical);
            parts.element(shape, list, physical);
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
        let (shape, nodes) = shape(kind, element)?;
        let physical = parts.groups.of_entity(dimension, entity);
        for _ in 0..cursor.size()? {
            let _tag = cursor.size()?;
            let list = (0..nodes).map(|_| cursor.size());
            let list = list.collect::<Result<_, Fault>>()?;
            parts.element(shape, list, physical);
            element += 1;
        }
    }
    Ok(())
}
