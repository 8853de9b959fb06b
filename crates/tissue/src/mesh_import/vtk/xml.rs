//! VTK XML files (`.vtu`, `.vtp`): arrays as text, in base64 or behind the XML, packed or not ([`super::packed`]).

use super::super::error::{Fault, fault};
use super::super::words::{real, short, without_mark};
use super::cells::{Lists, Role};
use super::kinds::Kind;
use super::packed::{Budget, Packing};
use super::{Array, DataSet, Piece};
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use std::collections::HashMap;

/// Reads the file.
pub fn parse(bytes: &[u8], with_arrays: bool) -> Result<DataSet, Fault> {
    let bytes = without_mark(bytes);
    let (head, appended) = split(bytes);
    let text = String::from_utf8_lossy(head);
    let mut reader = Reader::from_str(&text);
    let mut file = File {
        packing: None,
        appended,
        budget: Budget::of_file(bytes.len()),
        with_arrays,
        data: DataSet {
            is_grid: false,
            pieces: Vec::new(),
        },
        section: Section::None,
        lists: HashMap::new(),
    };
    // The open array with its text, and how many tags are open inside it.
    let mut array: Option<(Tag, String)> = None;
    let mut inner = 0;
    let mut depth = 0usize;
    loop {
        let event = reader.read_event();
        let line = |reader: &Reader<&[u8]>| {
            let end = (reader.buffer_position() as usize).min(text.len());
            1 + text.as_bytes()[..end]
                .iter()
                .filter(|b| **b == b'\n')
                .count()
        };
        let placed = |fault: Fault, reader: &Reader<&[u8]>| match fault {
            Fault::Text(reason) => Fault::Text(format!("line {}: {reason}", line(reader))),
            kind => kind,
        };
        match event {
            Err(error) => {
                return fault(format!(
                    "line {}: {error}: is the file cut off?",
                    line(&reader)
                ));
            }
            Ok(Event::Eof) => break,
            Ok(Event::Start(tag)) => {
                depth += 1;
                if array.is_some() {
                    inner += 1;
                } else if tag.name().as_ref() == b"DataArray" {
                    array = Some((Tag::new(&tag)?, String::new()));
                } else {
                    file.open(&tag).map_err(|fault| placed(fault, &reader))?;
                }
            }
            Ok(Event::Empty(tag)) => {
                if array.is_none() && tag.name().as_ref() == b"DataArray" {
                    file.array(&Tag::new(&tag)?, "")
                        .map_err(|fault| placed(fault, &reader))?;
                }
            }
            Ok(Event::Text(more)) => {
                if let (Some((_, words)), 0) = (&mut array, inner) {
                    *words += &String::from_utf8_lossy(&more);
                }
            }
            Ok(Event::End(tag)) => {
                depth = depth.saturating_sub(1);
                if inner > 0 {
                    inner -= 1;
                } else if let Some((tag, words)) = array.take() {
                    file.array(&tag, &words)
                        .map_err(|fault| placed(fault, &reader))?;
                } else {
                    file.close(tag.name().as_ref())
                        .map_err(|fault| placed(fault, &reader))?;
                }
            }
            Ok(_) => {}
        }
    }
    if depth > 0 && appended.is_none() {
        return fault("the file ends inside a tag: is it cut off?");
    }
    if file.packing.is_none() {
        return fault("the file has no <VTKFile>");
    }
    Ok(file.data)
}

/// The XML, and what follows the underscore of `<AppendedData>` with whether it is base64.
fn split(bytes: &[u8]) -> (&[u8], Option<(&[u8], bool)>) {
    let find = |from: usize, wanted: &[u8]| {
        let found = (bytes[from..].windows(wanted.len())).position(|window| window == wanted);
        found.map(|at| from + at)
    };
    let Some(opening) = find(0, b"<AppendedData") else {
        return (bytes, None);
    };
    let tag_end = find(opening, b">").unwrap_or(bytes.len());
    let tag = &bytes[opening..tag_end];
    let is_base64 = !tag.windows(5).any(|window| window == b"\"raw\"");
    let data = find(tag_end, b"_").map_or(&[][..], |at| &bytes[at + 1..]);
    (&bytes[..opening], Some((data, is_base64)))
}

/// Attributes of a tag that are of use here.
#[derive(Default)]
struct Tag(HashMap<&'static str, String>);

const ATTRIBUTES: [&str; 11] = [
    "type",
    "Name",
    "NumberOfComponents",
    "NumberOfPoints",
    "NumberOfCells",
    "format",
    "offset",
    "byte_order",
    "header_type",
    "compressor",
    "encoding",
];

impl Tag {
    fn new(tag: &BytesStart<'_>) -> Result<Self, Fault> {
        let mut out = Self::default();
        // Looking for attributes that come twice would take the square of their number.
        for attribute in tag.attributes().with_checks(false) {
            let attribute = attribute.map_err(|error| error.to_string())?;
            let known = ATTRIBUTES
                .iter()
                .find(|name| name.as_bytes() == attribute.key.as_ref());
            if let Some(known) = known {
                let value = attribute
                    .unescape_value()
                    .map_err(|error| error.to_string())?;
                out.0.insert(known, value.into_owned());
            }
        }
        Ok(out)
    }

    fn get(&self, name: &str) -> &str {
        self.0.get(name).map_or("", String::as_str)
    }

    fn number(&self, name: &str) -> Result<Option<usize>, Fault> {
        match self.get(name) {
            "" => Ok(None),
            text => match text.trim().parse() {
                Ok(number) => Ok(Some(number)),
                Err(_) => fault(format!(
                    "{name} is `{}`, must be a whole number",
                    short(text)
                )),
            },
        }
    }
}

/// What the arrays of a tag belong to.
#[derive(Clone, Copy, PartialEq)]
enum Section {
    None,
    Points,
    Cells(Role),
    OfPoints,
    OfCells,
}

struct File<'a> {
    /// Known once `<VTKFile>` is read.
    packing: Option<Packing>,
    appended: Option<(&'a [u8], bool)>,
    budget: Budget,
    with_arrays: bool,
    data: DataSet,
    section: Section,
    /// Arrays of the open list of cells, by name.
    lists: HashMap<String, Vec<i64>>,
}

impl File<'_> {
    fn open(&mut self, tag: &BytesStart<'_>) -> Result<(), Fault> {
        let name = tag.name();
        self.section = match name.as_ref() {
            b"VTKFile" => {
                let tag = Tag::new(tag)?;
                let [order, header] = ["byte_order", "header_type"].map(|name| tag.get(name));
                self.packing = Some(Packing::new(order, header, tag.get("compressor"))?);
                match tag.get("type") {
                    "UnstructuredGrid" => self.data.is_grid = true,
                    "PolyData" => {}
                    other => {
                        return fault(format!(
                            "the data set is `{}`, neither UnstructuredGrid nor PolyData; convert it to tetrahedra or a closed surface",
                            short(other)
                        ));
                    }
                }
                Section::None
            }
            b"Piece" => {
                self.data.pieces.push(Piece::default());
                Section::None
            }
            b"Points" => Section::Points,
            b"Cells" => Section::Cells(Role::Grid),
            b"Verts" => Section::Cells(Role::Vertices),
            b"Lines" => Section::Cells(Role::Lines),
            b"Polys" => Section::Cells(Role::Polygons),
            b"Strips" => Section::Cells(Role::Strips),
            b"PointData" => Section::OfPoints,
            b"CellData" => Section::OfCells,
            _ => Section::None,
        };
        Ok(())
    }

    fn close(&mut self, name: &[u8]) -> Result<(), Fault> {
        let section = std::mem::replace(&mut self.section, Section::None);
        let Some(piece) = self.data.pieces.last_mut() else {
            return Ok(());
        };
        if name == b"Piece" {
            // Arrays over cells count points, lines, polygons and strips, whatever the order of their lists.
            piece.cells.sort_by_key(|(role, _)| *role as u8);
        }
        let Section::Cells(role) = section else {
            return Ok(());
        };
        let mut take = |name: &str| self.lists.remove(name).unwrap_or_default();
        let lists = Lists {
            nodes: take("connectivity"),
            ends: take("offsets"),
        };
        if role == Role::Grid {
            let number = |&kind: &i64| u8::try_from(kind).unwrap_or(u8::MAX);
            piece.kinds = take("types").iter().map(number).collect();
        }
        self.lists.clear();
        piece.cells.push((role, lists));
        Ok(())
    }

    fn array(&mut self, tag: &Tag, words: &str) -> Result<(), Fault> {
        let name = tag.get("Name");
        let width = tag.number("NumberOfComponents")?.unwrap_or(1);
        let section = self.section;
        let is_wanted = match section {
            Section::None => false,
            Section::Points => true,
            Section::Cells(_) => ["connectivity", "offsets", "types"].contains(&name),
            Section::OfPoints | Section::OfCells => self.with_arrays && width <= 1,
        };
        if !is_wanted || self.data.pieces.is_empty() {
            return Ok(());
        }
        let Some(kind) = Kind::of_xml(tag.get("type")) else {
            return match section {
                Section::OfPoints | Section::OfCells => Ok(()),
                _ => fault(format!(
                    "array `{}` is of type `{}`, which is no number",
                    short(name),
                    short(tag.get("type"))
                )),
            };
        };
        let named = |fault: Fault| match fault {
            Fault::Text(reason) => Fault::Text(format!("array `{}`: {reason}", short(name))),
            kind => kind,
        };
        match section {
            Section::Cells(_) => {
                let numbers = self.wholes(tag, words, kind).map_err(named)?;
                self.lists.insert(name.to_owned(), numbers);
            }
            _ => {
                let values = self.reals(tag, words, kind).map_err(named)?;
                let Some(piece) = self.data.pieces.last_mut() else {
                    return Ok(());
                };
                let name = name.to_owned();
                match section {
                    Section::OfPoints => piece.of_points.push(Array { name, values }),
                    Section::OfCells => piece.of_cells.push(Array { name, values }),
                    _ => {
                        let (points, rest) = values.as_chunks::<3>();
                        if !rest.is_empty() || width != 3 {
                            return fault("the points are not triples of coordinates");
                        }
                        piece.points.extend_from_slice(points);
                    }
                }
            }
        }
        Ok(())
    }

    fn reals(&mut self, tag: &Tag, words: &str, kind: Kind) -> Result<Vec<f64>, Fault> {
        if is_text(tag) {
            return numbers(words, |word| real(word, 1).ok());
        }
        let bytes = self.bytes(tag, words)?;
        self.budget.spend(bytes.len().saturating_mul(2))?;
        Ok(kind.reals(&bytes, self.is_big()))
    }

    fn wholes(&mut self, tag: &Tag, words: &str, kind: Kind) -> Result<Vec<i64>, Fault> {
        if is_text(tag) {
            return numbers(words, |word| word.parse().ok());
        }
        let bytes = self.bytes(tag, words)?;
        self.budget.spend(bytes.len().saturating_mul(2))?;
        Ok(kind.wholes(&bytes, self.is_big()))
    }

    fn is_big(&self) -> bool {
        self.packing.as_ref().is_some_and(|packing| packing.is_big)
    }

    /// The bytes of an array that is not text.
    fn bytes(&mut self, tag: &Tag, words: &str) -> Result<Vec<u8>, Fault> {
        let Some(packing) = &self.packing else {
            return fault("it comes before <VTKFile>");
        };
        if tag.get("format") != "appended" {
            let mut letters: Vec<u8> = words.bytes().collect();
            letters.retain(|letter| !letter.is_ascii_whitespace());
            if letters.is_empty() {
                return Ok(Vec::new());
            }
            return packing.unpack(&letters, true, &mut self.budget);
        }
        let (Some((data, is_base64)), Some(offset)) = (self.appended, tag.number("offset")?) else {
            return fault("it lies in <AppendedData>, which the file lacks, or has no offset");
        };
        match data.get(offset..) {
            Some(source) => packing.unpack(source, is_base64, &mut self.budget),
            None => fault(format!(
                "its offset {offset} lies behind the end: is the file cut off?"
            )),
        }
    }
}

fn is_text(tag: &Tag) -> bool {
    !matches!(tag.get("format"), "binary" | "appended")
}

fn numbers<T>(words: &str, number: impl Fn(&str) -> Option<T>) -> Result<Vec<T>, Fault> {
    let parsed = words
        .split_ascii_whitespace()
        .map(|word| match number(word) {
            Some(number) => Ok(number),
            None => fault(format!("`{}` is not a number", short(word))),
        });
    parsed.collect()
}
