//! Tetrahedra, or a surface, of a Medit file (`.mesh`, text): what TetGen, MMG, Gmsh, CGAL and FreeFem write.
//!
//! A keyword, a count, then rows: `Vertices` (x, y, z and a reference), `Triangles`, `Quadrilaterals` and `Tetrahedra` (nodes from 1
//! and a reference). References are names, `ref=7`. Higher orders (`TetrahedraP2`) give their corners.

use super::body::{Read, TetList};
use super::error::{Fault, fault};
use super::labels::{Labels, Part, boundary};
use super::words::{Words, bytes_of, real, short, text};
use super::{ImportError, RawSurface, polygons, surface_files};
use std::path::Path;

/// Rows of nodes and a reference.
type Rows = Vec<(Vec<u32>, i64)>;

#[derive(Default)]
struct File {
    positions: Vec<[f64; 3]>,
    references: Vec<i64>,
    faces: Rows,
    tets: Rows,
}

/// Reads the tetrahedra, or the faces of a file without any.
pub fn read(path: &Path) -> Result<Read, ImportError> {
    let bytes = bytes_of(path)?;
    let read = parse(&bytes).and_then(|file| {
        if file.tets.is_empty() {
            let faces = file.faces.iter();
            let faces = faces.flat_map(|(nodes, _)| polygons::triangles(nodes, &file.positions));
            let faces: Vec<[u32; 3]> = faces.collect();
            if faces.is_empty() {
                return fault("the file holds neither tetrahedra nor faces");
            }
            let positions = file.positions;
            return surface_files::whole(RawSurface { positions, faces }).map(Read::from);
        }
        let mut tets = TetList::default();
        file.tets.iter().for_each(|(nodes, _)| tets.add(nodes));
        tets.finish(file.positions, "")
    });
    read.map_err(|fault| fault.of(path))
}

/// Reads the references.
pub fn read_labels(path: &Path) -> Result<Labels, ImportError> {
    let bytes = bytes_of(path)?;
    let read = parse(&bytes).and_then(|file| labels(file, bytes.len()));
    read.map_err(|fault| fault.of(path))
}

fn labels(file: File, bytes: usize) -> Result<Labels, Fault> {
    let mut out = Labels::of_file(bytes);
    let name = |out: &mut Labels, reference: i64, part: Part| {
        let name = out.name(&format!("ref={reference}"));
        out.add(name, part)
    };
    for (point, reference) in file.references.into_iter().enumerate() {
        name(&mut out, reference, Part::Point(point))?;
    }
    for (nodes, reference) in file.faces {
        for face in polygons::triangles(&nodes, &file.positions) {
            let part = Part::Face(out.faces.len());
            out.faces.push(face);
            name(&mut out, reference, part)?;
        }
    }
    for (nodes, reference) in file.tets {
        if let Some(&corners) = nodes.first_chunk::<4>() {
            let part = Part::Tet(out.tets.len());
            out.tets.push(corners);
            name(&mut out, reference, part)?;
        }
    }
    out.positions = file.positions;
    if out.faces.is_empty() {
        out.faces = boundary(&out.tets);
    }
    Ok(out)
}

/// Words of a row below a keyword that is skipped, without a number where a count does not follow.
fn skipped(keyword: &str) -> Option<usize> {
    Some(match keyword {
        "corners" | "ridges" | "requiredvertices" | "requirededges" | "requiredtriangles" => 1,
        "requiredquadrilaterals" | "requiredtetrahedra" => 1,
        "tangentatvertices" | "normalatvertices" => 2,
        "edges" | "normals" | "tangents" => 3,
        "edgesp2" => 4,
        "normalattrianglevertices" | "normalatquadrilateralvertices" => 3,
        _ => return None,
    })
}

fn parse(bytes: &[u8]) -> Result<File, Fault> {
    let text = text(bytes);
    let mut words = Words::new(&text);
    let mut out = File::default();
    match words.next() {
        Some(word) if word.eq_ignore_ascii_case("MeshVersionFormatted") => {}
        _ => {
            return fault(
                "the file does not begin with `MeshVersionFormatted`, as a Medit mesh in text does",
            );
        }
    }
    words.next();
    while let Some(word) = words.next() {
        let keyword = word.to_ascii_lowercase();
        match keyword.as_str() {
            "end" => break,
            "dimension" => {
                if words.whole()? != 3 {
                    return fault(format!(
                        "line {}: the mesh has not three dimensions",
                        words.line()
                    ));
                }
            }
            "vertices" => {
                for _ in 0..words.count("vertices", 4)? {
                    out.positions.push(words.point()?);
                    out.references.push(words.real()? as i64);
                }
            }
            "triangles" => rows(&mut words, 3, 3, &mut out.faces)?,
            "trianglesp2" => rows(&mut words, 6, 3, &mut out.faces)?,
            "quadrilaterals" => rows(&mut words, 4, 4, &mut out.faces)?,
            "tetrahedra" => rows(&mut words, 4, 4, &mut out.tets)?,
            "tetrahedrap2" => rows(&mut words, 10, 10, &mut out.tets)?,
            "hexahedra" | "hexaedra" | "prisms" | "pyramids" => {
                if words.count("elements", 1)? > 0 {
                    return Err(Fault::Kind {
                        element: 0,
                        kind: format!("of the list `{}` (line {})", short(word), words.line()),
                    });
                }
            }
            _ => skip(&mut words, word, skipped(&keyword))?,
        }
    }
    Ok(out)
}

/// Rows of so many nodes and a reference, of which the first `kept` nodes stay.
fn rows(words: &mut Words<'_>, nodes: usize, kept: usize, out: &mut Rows) -> Result<(), Fault> {
    for _ in 0..words.count("elements", nodes + 1)? {
        let mut row = Vec::with_capacity(nodes);
        for _ in 0..nodes {
            let node = words.whole()?;
            if node == 0 {
                return fault(format!("line {}: nodes count from 1", words.line()));
            }
            row.push(u32::try_from(node - 1).unwrap_or(u32::MAX));
        }
        row.truncate(kept);
        out.push((row, words.real()? as i64));
    }
    Ok(())
}

fn skip(words: &mut Words<'_>, keyword: &str, row: Option<usize>) -> Result<(), Fault> {
    let Some(row) = row else {
        if real(keyword, 0).is_ok() {
            return fault(format!(
                "line {}: a number where a keyword is due: is a count wrong?",
                words.line()
            ));
        }
        // A list of an unknown kind: its numbers are skipped.
        while words.peek().is_some_and(|word| real(word, 0).is_ok()) {
            words.next();
        }
        return Ok(());
    };
    for _ in 0..words.count("rows", row)? {
        for _ in 0..row {
            words.real()?;
        }
    }
    Ok(())
}
