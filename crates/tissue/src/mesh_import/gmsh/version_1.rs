//! Tetrahedra of a Gmsh file of version 1 (`$NOD`, `$ELM`; SOFA's own meshes): text only, a header-less format.
//!
//! `$NOD`: a count, then `tag x y z`. `$ELM`: a count, then `tag type physical elementary nodes node...`.

use super::{Cursor, Fault, Parts, fault, shape};

/// Whether the file begins as version 1 does.
pub fn is_version_1(bytes: &[u8]) -> bool {
    let start = bytes.iter().position(|b| !b.is_ascii_whitespace());
    start.is_some_and(|at| bytes[at..].starts_with(b"$NOD"))
}

/// Reads the linear tetrahedra.
pub fn parse(cursor: &mut Cursor<'_>) -> Result<Parts, Fault> {
    let mut parts = Parts::default();
    cursor.expect("$NOD")?;
    let count: u64 = cursor.parsed()?;
    for _ in 0..count {
        let tag = cursor.parsed()?;
        let point = [cursor.real()?, cursor.real()?, cursor.real()?];
        parts.node(tag, point)?;
    }
    cursor.expect("$ENDNOD")?;
    cursor.expect("$ELM")?;
    let count: usize = cursor.parsed()?;
    for element in 0..count {
        let _tag: u64 = cursor.parsed()?;
        let kind: i64 = cursor.parsed()?;
        let [physical, _elementary]: [i64; 2] = [cursor.parsed()?, cursor.parsed()?];
        let stated: usize = cursor.parsed()?;
        let (shape, nodes) = shape(kind, element)?;
        if stated != nodes {
            return fault(format!(
                "element {element} of type {kind} has {stated} nodes, must have {nodes}"
            ));
        }
        let list = (0..nodes).map(|_| cursor.parsed());
        let list = list.collect::<Result<_, Fault>>()?;
        let physical = parts.groups.list_of(physical);
        parts.element(shape, list, physical);
    }
    cursor.expect("$ENDELM")?;
    Ok(parts)
}
