//! Keyword lines of Abaqus: `*NAME, PARAMETER=VALUE, ...`, and the types of elements that they name.

use super::model::Shape;

/// The name of a keyword line, in capitals.
pub fn name_of(keyword: &str) -> String {
    let name = keyword.split(',').next().unwrap_or_default();
    let words: Vec<&str> = name
        .trim_start_matches('*')
        .split_ascii_whitespace()
        .collect();
    words.join(" ").to_uppercase()
}

/// The value of a parameter; empty for one without a value.
pub fn parameter(keyword: &str, wanted: &str) -> Option<String> {
    keyword.split(',').skip(1).find_map(|part| {
        let (name, value) = part.split_once('=').unwrap_or((part, ""));
        let value = value.trim().trim_matches('"');
        name.trim()
            .eq_ignore_ascii_case(wanted)
            .then(|| value.to_owned())
    })
}

/// Triangles and tetrahedra by Abaqus's names, with the number of their nodes.
pub fn shape_of(kind: &str) -> Option<(Shape, usize)> {
    let kind = kind.to_uppercase();
    // Letters behind the number are formulations: C3D10MH, S3RS.
    let is = |name: &str| {
        kind.strip_prefix(name)
            .is_some_and(|more| !more.starts_with(|c: char| c.is_ascii_digit()))
    };
    if is("C3D4") {
        Some((Shape::Tetrahedron, 4))
    } else if is("C3D10") {
        Some((Shape::Tetrahedron, 10))
    } else if [
        "S3", "STRI3", "CPS3", "CPE3", "CPEG3", "CAX3", "R3D3", "RAX3", "M3D3", "SFM3D3", "DS3",
        "DC2D3",
    ]
    .iter()
    .any(|name| is(name))
    {
        Some((Shape::Triangle, 3))
    } else if ["STRI65", "CPS6", "CPE6", "M3D6", "SFM3D6", "DS6", "S6"]
        .iter()
        .any(|name| is(name))
    {
        Some((Shape::Triangle, 6))
    } else {
        None
    }
}
