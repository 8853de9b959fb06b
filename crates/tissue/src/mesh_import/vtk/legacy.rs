//! Legacy VTK files (`.vtk`) up to version 5.1, text and binary: points, cells of grids and polydata, arrays over both. Field data
//! of the data set (times, names of segments), metadata and tables of colours are skipped.

use super::super::error::{Fault, fault};
use super::super::words::{short, without_mark};
use super::cells::{Lists, Role};
use super::cursor::Cursor;
use super::kinds::Kind;
use super::{Array, DataSet, Piece};

/// Reads the file.
pub fn parse(bytes: &[u8], with_arrays: bool) -> Result<DataSet, Fault> {
    let mut cursor = Cursor::new(without_mark(bytes));
    let read = file(&mut cursor, with_arrays);
    read.map_err(|fault| match fault {
        Fault::Text(reason) => Fault::Text(format!("{}: {reason}", cursor.place())),
        kind => kind,
    })
}

fn file(cursor: &mut Cursor<'_>, with_arrays: bool) -> Result<DataSet, Fault> {
    if !cursor.line().starts_with("# vtk DataFile") {
        return fault("the file does not begin with `# vtk DataFile`");
    }
    cursor.line(); // The title.
    let kind = cursor.word()?.to_ascii_uppercase();
    let is_binary = match kind.as_str() {
        "ASCII" => false,
        "BINARY" => true,
        _ => return fault(format!("`{}` where ASCII or BINARY is due", short(&kind))),
    };
    let mut data = DataSet {
        is_grid: false,
        pieces: vec![Piece::default()],
    };
    let piece = &mut data.pieces[0];
    // The rows of the arrays that follow, and whether they are cells; numbers a row of the last one.
    let mut rows = (0, false);
    let mut width = 1;
    while let Some(word) = cursor.keyword() {
        let word = word.to_ascii_uppercase();
        match word.as_str() {
            "DATASET" => match cursor.word()?.to_ascii_uppercase().as_str() {
                "UNSTRUCTURED_GRID" => data.is_grid = true,
                "POLYDATA" => {}
                other => {
                    return fault(format!(
                        "the data set is {}, neither UNSTRUCTURED_GRID nor POLYDATA; convert it to tetrahedra or a closed surface",
                        short(other)
                    ));
                }
            },
            "METADATA" => cursor.skip_metadata(width),
            "POINTS" => {
                let count = cursor.count()?;
                let kind = cursor.kind()?;
                cursor.is_binary = is_binary;
                width = 3;
                let numbers = cursor.reals(kind, times(count, 3)?)?;
                piece.points.extend_from_slice(numbers.as_chunks::<3>().0);
            }
            "CELLS" | "POLYGONS" | "LINES" | "VERTICES" | "TRIANGLE_STRIPS" => {
                let role = match word.as_str() {
                    "CELLS" => Role::Grid,
                    "POLYGONS" => Role::Polygons,
                    "LINES" => Role::Lines,
                    "VERTICES" => Role::Vertices,
                    _ => Role::Strips,
                };
                let lists = lists(cursor, is_binary)?;
                piece.cells.push((role, lists));
            }
            "CELL_TYPES" => {
                let count = cursor.count()?;
                cursor.line();
                cursor.is_binary = is_binary;
                let kinds = cursor.wholes(Kind::I32, count)?;
                let number = |kind: i64| u8::try_from(kind).unwrap_or(u8::MAX);
                piece.kinds = kinds.into_iter().map(number).collect();
            }
            "POINT_DATA" => rows = (cursor.count()?, false),
            "CELL_DATA" => rows = (cursor.count()?, true),
            _ => {
                let mut found = Vec::new();
                let (count, is_cells) = rows;
                width = array(cursor, &word, count, is_binary, &mut found)?;
                // Field data of the data set itself come before any arrays of points and cells.
                if with_arrays && count > 0 {
                    let arrays = match is_cells {
                        true => &mut piece.of_cells,
                        false => &mut piece.of_points,
                    };
                    arrays.extend(found.into_iter().filter(|a| a.values.len() == count));
                }
            }
        }
        cursor.is_binary = false;
    }
    // Arrays over cells count points, lines, polygons and strips, whatever the order of their lists.
    piece.cells.sort_by_key(|(role, _)| *role as u8);
    Ok(data)
}

fn times(count: usize, width: usize) -> Result<usize, Fault> {
    match count.checked_mul(width) {
        Some(product) => Ok(product),
        None => fault(format!(
            "{count} rows of {width} are more than a file can hold"
        )),
    }
}

/// Lists of nodes: with lengths before each (up to 4.2), or as offsets and connectivity (5.1).
fn lists(cursor: &mut Cursor<'_>, is_binary: bool) -> Result<Lists, Fault> {
    let (count, size) = (cursor.count()?, cursor.count()?);
    cursor.line();
    if !cursor.is_next(b"OFFSETS") {
        cursor.is_binary = is_binary;
        let words = cursor.wholes(Kind::I32, size)?;
        return Lists::from_lengths(&words, count);
    }
    let mut part = |name: &str, count: usize| {
        cursor.is_binary = false;
        let word = cursor.word()?;
        if !word.eq_ignore_ascii_case(name) {
            return fault(format!("`{}` where {name} is due", short(word)));
        }
        let kind = cursor.kind()?;
        cursor.is_binary = is_binary;
        cursor.wholes(kind, count)
    };
    let mut ends = part("OFFSETS", count)?;
    let nodes = part("CONNECTIVITY", size)?;
    if !ends.is_empty() {
        ends.remove(0);
    }
    Ok(Lists { nodes, ends })
}

/// An array, or several of a field; the numbers a row of the last one. Arrays of one number go into `found`.
fn array(
    cursor: &mut Cursor<'_>,
    word: &str,
    rows: usize,
    is_binary: bool,
    found: &mut Vec<Array>,
) -> Result<usize, Fault> {
    if word == "FIELD" {
        cursor.word()?;
        let arrays = cursor.count()?;
        let mut last = 1;
        for _ in 0..arrays {
            cursor.is_binary = false;
            let mut name = cursor.word()?;
            // An array may be followed by its metadata.
            while name == "METADATA" {
                cursor.skip_metadata(last);
                name = cursor.word()?;
            }
            if name == "NULL_ARRAY" {
                continue;
            }
            let name = decoded(name);
            let (width, rows) = (cursor.count()?, cursor.count()?);
            last = width;
            let kind = cursor.word()?.to_owned();
            cursor.line();
            let count = times(width, rows)?;
            if ["string", "utf8_string", "variant"].contains(&kind.as_str()) {
                cursor.is_binary = is_binary && kind != "variant";
                cursor.skip_texts(count)?;
                continue;
            }
            let Some(kind) = Kind::of_legacy(&kind) else {
                return fault(format!(
                    "array `{name}` is of an unknown type `{}`",
                    short(&kind)
                ));
            };
            cursor.is_binary = is_binary;
            let values = cursor.reals(kind, count)?;
            if width == 1 {
                found.push(Array { name, values });
            }
        }
        return Ok(last);
    }
    if word == "LOOKUP_TABLE" {
        cursor.word()?;
        let colours = cursor.count()?;
        cursor.line();
        cursor.is_binary = is_binary;
        let kind = if is_binary { Kind::U8 } else { Kind::F32 };
        cursor.reals(kind, times(colours, 4)?)?;
        return Ok(4);
    }
    let fixed = match word {
        "SCALARS" | "COLOR_SCALARS" | "TEXTURE_COORDINATES" => None,
        "VECTORS" | "NORMALS" => Some(3),
        "TENSORS" => Some(9),
        "TENSORS6" => Some(6),
        "GLOBAL_IDS" | "PEDIGREE_IDS" | "EDGE_FLAGS" => Some(1),
        _ => {
            return fault(format!(
                "`{}` where a section or an array is due",
                short(word)
            ));
        }
    };
    let line = cursor.line();
    let words: Vec<&str> = line.split_ascii_whitespace().collect();
    let number = |at: usize| words.get(at).and_then(|word| word.parse::<usize>().ok());
    let Some(name) = words.first() else {
        return fault(format!("{word} has no name"));
    };
    let kind = words.get(match word {
        "TEXTURE_COORDINATES" => 2,
        _ => 1,
    });
    if word == "PEDIGREE_IDS" && kind.is_some_and(|kind| kind.contains("string")) {
        cursor.is_binary = is_binary;
        cursor.skip_texts(rows)?;
        return Ok(1);
    }
    let (kind, width) = match (word, fixed) {
        // Bytes, or fractions of 1 where the file is text.
        ("COLOR_SCALARS", _) => (Some(Kind::U8), number(1).unwrap_or(1)),
        ("TEXTURE_COORDINATES", _) => (
            kind.and_then(|k| Kind::of_legacy(k)),
            number(1).unwrap_or(1),
        ),
        (_, Some(width)) => (kind.and_then(|k| Kind::of_legacy(k)), width),
        _ => (
            kind.and_then(|k| Kind::of_legacy(k)),
            number(2).unwrap_or(1),
        ),
    };
    let Some(kind) = kind else {
        return fault(format!("{word} {} is of an unknown type", short(name)));
    };
    if word == "SCALARS" && cursor.is_next(b"LOOKUP_TABLE") {
        cursor.line();
    }
    cursor.is_binary = is_binary;
    let values = cursor.reals(kind, times(rows, width)?)?;
    if width == 1 {
        found.push(Array {
            name: decoded(name),
            values,
        });
    }
    Ok(width)
}

/// VTK writes spaces and other signs in names as `%20`.
fn decoded(name: &str) -> String {
    let mut bytes = Vec::new();
    let mut rest = name.as_bytes();
    while let [first, more @ ..] = rest {
        let code = (*first == b'%')
            .then(|| more.get(..2).and_then(|two| std::str::from_utf8(two).ok()))
            .flatten()
            .and_then(|two| u8::from_str_radix(two, 16).ok());
        bytes.push(code.unwrap_or(*first));
        rest = if code.is_some() { &more[2..] } else { more };
    }
    String::from_utf8_lossy(&bytes).into_owned()
}
