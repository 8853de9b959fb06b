//! PLY (Stanford), text and binary of either byte order: `x`, `y`, `z` and colours of `vertex`, the list of corners of `face`.
//! Other elements and properties are skipped.

use super::super::RawSurface;
use super::super::error::{Fault, fault};
use super::super::labels::{Labels, Part};
use super::super::polygons;
use super::super::words::{Words, short, text, without_mark};

/// The triangles of a file, and the colour of each vertex where it has one.
#[derive(Default)]
pub struct Ply {
    pub surface: RawSurface,
    colours: Vec<[u8; 3]>,
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Kind {
    fn of(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The number whose bytes, the lowest first, are at the beginning of `bytes`.
    fn number(self, bytes: [u8; 8]) -> f64 {
        let [a, b, c, d, ..] = bytes;
        match self {
            Self::I8 => f64::from(a as i8),
            Self::U8 => f64::from(a),
            Self::I16 => f64::from(i16::from_le_bytes([a, b])),
            Self::U16 => f64::from(u16::from_le_bytes([a, b])),
            Self::I32 => f64::from(i32::from_le_bytes([a, b, c, d])),
            Self::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
            Self::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
            Self::F64 => f64::from_le_bytes(bytes),
        }
    }
}

struct Property {
    name: String,
    kind: Kind,
    /// The kind of its length, where it is a list.
    list: Option<Kind>,
}

struct Element {
    name: String,
    count: u64,
    properties: Vec<Property>,
}

/// The rows behind the header.
enum Rows<'a> {
    Text(Words<'a>),
    Binary { rest: &'a [u8], is_big: bool },
}

impl Rows<'_> {
    fn number(&mut self, kind: Kind) -> Result<f64, Fault> {
        match self {
            Self::Text(words) => words.real(),
            Self::Binary { rest, is_big } => {
                let Some((taken, more)) = rest.split_at_checked(kind.size()) else {
                    return fault("the file ends inside its rows: is it cut off?");
                };
                *rest = more;
                let mut bytes = [0; 8];
                bytes[..taken.len()].copy_from_slice(taken);
                if *is_big {
                    bytes[..taken.len()].reverse();
                }
                Ok(kind.number(bytes))
            }
        }
    }
}

/// Reads the file.
pub fn parse(bytes: &[u8]) -> Result<Ply, Fault> {
    let bytes = without_mark(bytes);
    let (elements, format, length, lines) = header(bytes)?;
    let body = &bytes[length..];
    let shown;
    let mut rows = match format.as_str() {
        "ascii" => {
            shown = text(body);
            Rows::Text(Words::from_line(&shown, lines + 1))
        }
        "binary_little_endian" => Rows::Binary {
            rest: body,
            is_big: false,
        },
        "binary_big_endian" => Rows::Binary {
            rest: body,
            is_big: true,
        },
        other => return fault(format!("`{}` is no format of PLY", short(other))),
    };
    let mut out = Ply::default();
    let mut polygons = Vec::new();
    for element in elements {
        // Rows of nothing take no bytes, so that their count says nothing.
        if !element.properties.is_empty() {
            rows_of(&element, &mut rows, &mut out, &mut polygons)?;
        }
    }
    for polygon in polygons {
        let cut = polygons::triangles(&polygon, &out.surface.positions);
        out.surface.faces.extend(cut);
    }
    Ok(out)
}

/// Elements, the format, and how many bytes and lines the header has.
fn header(bytes: &[u8]) -> Result<(Vec<Element>, String, usize, usize), Fault> {
    let mut elements: Vec<Element> = Vec::new();
    let (mut format, mut length) = (String::new(), 0);
    for (at, line) in (1..).zip(bytes.split_inclusive(|&byte| byte == b'\n')) {
        length += line.len();
        let line = String::from_utf8_lossy(line);
        let words: Vec<&str> = line.split_ascii_whitespace().take(5).collect();
        if at == 1 && words != ["ply"] {
            return fault("the file does not begin with the line `ply`");
        }
        let unknown = |name: &str| format!("line {at}: `{}` is no type of PLY", short(name));
        let kind = |name: &str| Kind::of(name).ok_or_else(|| Fault::Text(unknown(name)));
        match *words.as_slice() {
            ["format", name, ..] => name.clone_into(&mut format),
            ["element", name, count, ..] => elements.push(Element {
                name: name.to_owned(),
                count: super::super::words::whole(count, at)?,
                properties: Vec::new(),
            }),
            ["property", "list", ..] | ["property", _, _, ..] => {
                let Some(element) = elements.last_mut() else {
                    return fault(format!("line {at}: a property without its element"));
                };
                element.properties.push(match *words.as_slice() {
                    [_, "list", length, item, name] => Property {
                        name: name.to_owned(),
                        kind: kind(item)?,
                        list: Some(kind(length)?),
                    },
                    [_, item, name, ..] if item != "list" => Property {
                        name: name.to_owned(),
                        kind: kind(item)?,
                        list: None,
                    },
                    _ => return fault(format!("line {at}: a list has two types and a name")),
                });
            }
            ["end_header", ..] => return Ok((elements, format, length, at)),
            [] | ["ply" | "comment" | "obj_info", ..] => {}
            [word, ..] => {
                return fault(format!(
                    "line {at}: `{}` is not known in the header",
                    short(word)
                ));
            }
        }
    }
    fault("the header has no end_header: is the file cut off?")
}

fn rows_of(
    element: &Element,
    rows: &mut Rows<'_>,
    out: &mut Ply,
    polygons: &mut Vec<Vec<u32>>,
) -> Result<(), Fault> {
    let place = |name: &str| element.properties.iter().position(|p| p.name == name);
    let is_vertex = element.name == "vertex";
    let wanted = [
        ["x", "y", "z"].map(place),
        ["red", "green", "blue"].map(place),
    ];
    if is_vertex && wanted[0].contains(&None) {
        return fault("element `vertex` lacks one of the properties x, y and z");
    }
    let corners = place("vertex_indices").or(place("vertex_index"));
    if element.name == "face" && corners.is_none() && element.count > 0 {
        return fault("element `face` has no list `vertex_indices`");
    }
    let mut values = vec![0.0; element.properties.len()];
    for index in 0..element.count {
        let mut polygon = Vec::new();
        for (at, property) in element.properties.iter().enumerate() {
            let Some(length) = property.list else {
                values[at] = rows.number(property.kind)?;
                continue;
            };
            let length = rows.number(length)?;
            if length < 0.0 || length.fract() != 0.0 {
                return fault(format!(
                    "{} {index}: a list has {length} entries",
                    element.name
                ));
            }
            for _ in 0..length as u64 {
                let entry = rows.number(property.kind)?;
                if Some(at) == corners {
                    let is_node = entry >= 0.0 && entry.fract() == 0.0;
                    polygon.push(if is_node { entry as u32 } else { u32::MAX });
                }
            }
        }
        if is_vertex {
            let [x, y, z] = wanted[0].map(|place| values[place.unwrap_or(0)]);
            out.surface.positions.push([x, y, z]);
            if let [Some(red), Some(green), Some(blue)] = wanted[1] {
                out.colours.push(
                    [red, green, blue].map(|at| match element.properties[at].kind {
                        Kind::F32 | Kind::F64 => (255.0 * values[at].clamp(0.0, 1.0)).round() as u8,
                        _ => values[at] as u8,
                    }),
                );
            }
        } else if element.name == "face" {
            if polygon.len() < 3 {
                return fault(format!(
                    "face {index} has {} corners, must have three or more",
                    polygon.len()
                ));
            }
            polygons.push(polygon);
        }
    }
    Ok(())
}

impl Ply {
    /// Each vertex has its colour as a name, `#rrggbb`.
    pub fn labels(self, bytes: usize) -> Result<Labels, Fault> {
        let mut labels = Labels::of_file(bytes);
        for (index, [r, g, b]) in self.colours.into_iter().enumerate() {
            let name = labels.name(&format!("#{r:02x}{g:02x}{b:02x}"));
            labels.add(name, Part::Point(index))?;
        }
        labels.positions = self.surface.positions;
        labels.faces = self.surface.faces;
        Ok(labels)
    }
}
