//! Tetrahedra of a FEBio model (`.feb`, XML, versions 2 to 4), with its parts and sets.
//!
//! Below `<Mesh>` (`<Geometry>` in version 2): `<Nodes>` with `<node id="1">x,y,z</node>`; `<Elements type="tet4" name="...">` with
//! `<elem id="1">a,b,c,d</elem>`; `<NodeSet name="...">` and `<ElementSet name="...">` with their numbers as text or as `<n id="1"/>`.
//! Solids of other types are an error; shells are skipped.

use super::{NamedTets, Wrong, wrong};
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

/// Element types without a volume.
const THIN: [&str; 11] = [
    "tri3", "tri6", "tri7", "quad4", "quad8", "quad9", "line2", "line3", "truss2", "spring",
    "beam3",
];

/// What numbers belong to.
enum Place {
    Nodes(Option<String>),
    Tets(String),
    Thin,
    NodeSet(String),
    ElementSet(String),
}

/// Reads the file.
pub(super) fn parse(text: &str) -> Result<NamedTets, Wrong> {
    let mut reader = Reader::from_str(text);
    let mut out = NamedTets::default();
    // Names of the open tags, the section that is open, and the number and text of the open entry.
    let mut open: Vec<String> = Vec::new();
    let mut place: Option<Place> = None;
    let (mut number, mut words) = (None, String::new());
    let mut parts = 0;
    let mut seen = false;
    loop {
        let line = |reader: &Reader<&[u8]>| {
            let at = (reader.buffer_position() as usize).min(text.len());
            1 + text.as_bytes()[..at]
                .iter()
                .filter(|b| **b == b'\n')
                .count()
        };
        let event = match reader.read_event() {
            Ok(event) => event,
            Err(error) => {
                return wrong(format!(
                    "line {}: {error}: is the file cut off?",
                    line(&reader)
                ));
            }
        };
        match event {
            Event::Eof => break,
            Event::Start(tag) => {
                let name = String::from_utf8_lossy(tag.name().as_ref()).into_owned();
                seen |= name == "Mesh" || name == "Geometry";
                let inside = open.iter().any(|tag| tag == "Mesh" || tag == "Geometry");
                if inside && place.is_none() {
                    place = section(&name, &tag, &mut parts)?;
                } else {
                    number = attribute(&tag, "id")?;
                }
                words.clear();
                open.push(name);
            }
            Event::Empty(tag) => {
                if let (Some(place), Some(id)) = (&place, attribute(&tag, "id")?) {
                    member(&mut out, place, &id, line(&reader))?;
                }
            }
            Event::Text(more) => match more.unescape() {
                Ok(more) => words += &more,
                Err(error) => return wrong(format!("line {}: {error}", line(&reader))),
            },
            Event::End(tag) => {
                let name = open.pop().unwrap_or_default();
                let at = line(&reader);
                match (&place, tag.name().as_ref()) {
                    (Some(place), b"node" | b"elem") => {
                        entry(&mut out, place, number.take(), &words, at)?;
                    }
                    (Some(_), b"Nodes" | b"Elements") => place = None,
                    (Some(set), b"NodeSet" | b"ElementSet") => {
                        member(&mut out, set, &words, at)?;
                        place = None;
                    }
                    (Some(place), _) => {
                        if let Some(id) = number.take() {
                            member(&mut out, place, &id, at)?;
                        }
                    }
                    _ => {}
                }
                words.clear();
                drop(name);
            }
            _ => {}
        }
    }
    if let Some(tag) = open.last() {
        return wrong(format!("the file ends inside <{tag}>; is it cut off?"));
    }
    if !seen {
        return wrong("the file has neither <Mesh> nor <Geometry>");
    }
    Ok(out)
}

fn attribute(tag: &BytesStart<'_>, wanted: &str) -> Result<Option<String>, Wrong> {
    match tag.try_get_attribute(wanted) {
        Ok(found) => Ok(found.map(|found| String::from_utf8_lossy(&found.value).into_owned())),
        Err(error) => wrong(error.to_string()),
    }
}

fn section(name: &str, tag: &BytesStart<'_>, parts: &mut usize) -> Result<Option<Place>, Wrong> {
    let called = attribute(tag, "name")?;
    Ok(match name {
        "Nodes" => Some(Place::Nodes(called)),
        "Elements" => {
            *parts += 1;
            let kind = attribute(tag, "type")?.unwrap_or_default().to_lowercase();
            match kind.as_str() {
                "tet4" => {
                    let called = called.or(attribute(tag, "mat")?);
                    Some(Place::Tets(called.unwrap_or_else(|| parts.to_string())))
                }
                thin if THIN.contains(&thin) => Some(Place::Thin),
                _ => {
                    return Err(Wrong::Kind {
                        element: *parts,
                        kind: format!("`{kind}` (part {})", called.unwrap_or_default()),
                    });
                }
            }
        }
        "NodeSet" => called.map(Place::NodeSet),
        "ElementSet" => called.map(Place::ElementSet),
        _ => None,
    })
}

/// A node or an element.
fn entry(
    out: &mut NamedTets,
    place: &Place,
    number: Option<String>,
    words: &str,
    at: usize,
) -> Result<(), Wrong> {
    if matches!(place, Place::Thin) {
        return Ok(());
    }
    let Some(number) = number else {
        return wrong(format!("line {at}: an entry has no id"));
    };
    let number = whole(&number, at)?;
    let list: Vec<&str> = words.split(',').map(str::trim).collect();
    match (place, list.as_slice()) {
        (Place::Nodes(set), &[x, y, z]) => {
            let real = |word: &str| match word.parse::<f64>() {
                Ok(value) => Ok(value),
                Err(_) => wrong(format!("line {at}: `{word}` is not a number")),
            };
            out.node(number, [real(x)?, real(y)?, real(z)?])?;
            if let Some(set) = set {
                out.nodes(set, vec![number]);
            }
            Ok(())
        }
        (Place::Tets(part), &[a, b, c, d]) => {
            let nodes = [whole(a, at)?, whole(b, at)?, whole(c, at)?, whole(d, at)?];
            out.tet(number, nodes)?;
            out.elements(part, vec![number]);
            Ok(())
        }
        (Place::Nodes(_), _) => wrong(format!(
            "line {at}: node {number} has {} coordinates, must have three",
            list.len()
        )),
        _ => wrong(format!(
            "line {at}: element {number} of a tet4 part has {} nodes, must have four",
            list.len()
        )),
    }
}

/// Numbers of a set, with commas or spaces between them.
fn member(out: &mut NamedTets, place: &Place, words: &str, at: usize) -> Result<(), Wrong> {
    let words = words.split([',', ' ', '\n', '\t', '\r']);
    let numbers: Vec<u64> = words
        .filter(|word| !word.is_empty())
        .map(|word| whole(word, at))
        .collect::<Result<_, _>>()?;
    match place {
        Place::NodeSet(name) => out.nodes(name, numbers),
        Place::ElementSet(name) => out.elements(name, numbers),
        _ => {}
    }
    Ok(())
}

fn whole(word: &str, at: usize) -> Result<u64, Wrong> {
    match word.trim().parse() {
        Ok(number) => Ok(number),
        Err(_) => wrong(format!("line {at}: `{word}` is not a whole number")),
    }
}
