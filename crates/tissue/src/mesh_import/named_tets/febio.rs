//! Tetrahedra of a FEBio model (`.feb`, XML, versions 1.2 to 4), with its parts, sets and surfaces.
//!
//! Below `<Mesh>` (`<Geometry>` up to version 2.5): `<Nodes>` with `<node id="1">x,y,z</node>`; `<Elements type="tet4" name="...">`
//! with `<elem id="1">a,b,c,d</elem>`, in version 1.2 `<tet4 id="1" mat="1">a,b,c,d</tet4>`; `<NodeSet>` and `<ElementSet>` with
//! numbers, ranges (`1:9:2`), other sets (`@surface:bed`, `<NodeSet node_set="low"/>`) or entries with an `id`; `<Surface>` with
//! `<tri3>`. Other solids are an error; shells of four corners, springs and beams are skipped.

use super::super::error::{Fault, fault};
use super::super::words::{real, short, whole};
use super::model::{Entry, Face, Model, Scope, Shape};
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

/// What a type of element is: its shape and number of nodes, or none for what has neither volume nor three corners.
fn kind_of(name: &str) -> Option<Option<(Shape, usize)>> {
    Some(match name.to_lowercase().as_str() {
        "tet4" => Some((Shape::Tetrahedron, 4)),
        "tet5" => Some((Shape::Tetrahedron, 5)),
        "tet10" => Some((Shape::Tetrahedron, 10)),
        "tet15" => Some((Shape::Tetrahedron, 15)),
        "tet20" => Some((Shape::Tetrahedron, 20)),
        "tri3" => Some((Shape::Triangle, 3)),
        "tri6" => Some((Shape::Triangle, 6)),
        "tri7" => Some((Shape::Triangle, 7)),
        "quad4" | "quad8" | "quad9" | "line2" | "line3" | "truss2" | "spring" | "beam2"
        | "beam3" => None,
        _ => return None,
    })
}

/// What numbers belong to.
enum Place {
    Nodes(Option<String>),
    /// Elements of a kind; without one each entry says its own (version 1.2).
    Elements {
        kind: Option<Option<(Shape, usize)>>,
        name: String,
    },
    NodeSet(String),
    ElementSet(String),
    Surface(String),
}

struct Parser {
    scope: Scope,
    place: Option<Place>,
    /// Tags that are open inside the place.
    inner: Vec<String>,
    /// Number, material and text of the open entry.
    number: Option<String>,
    material: Option<String>,
    words: String,
    parts: usize,
    is_inside: bool,
}

/// Reads the file.
pub(super) fn parse(text: &str) -> Result<Model, Fault> {
    let mut reader = Reader::from_str(text);
    let mut parser = Parser {
        scope: Scope::default(),
        place: None,
        inner: Vec::new(),
        number: None,
        material: None,
        words: String::new(),
        parts: 0,
        is_inside: false,
    };
    let mut lines = Lines {
        text,
        at: 0,
        line: 1,
    };
    let mut open: Vec<String> = Vec::new();
    let mut seen = false;
    loop {
        let event = reader.read_event();
        let at = lines.of(reader.buffer_position() as usize);
        match event {
            Err(error) => return fault(format!("line {at}: {error}: is the file cut off?")),
            Ok(Event::Eof) => break,
            Ok(Event::Start(tag)) => {
                let name = String::from_utf8_lossy(tag.name().as_ref()).into_owned();
                if is_mesh(&name) {
                    seen = true;
                    parser.is_inside = true;
                    elsewhere(&tag, at)?;
                }
                parser.start(&name, &tag, at)?;
                open.push(name);
            }
            Ok(Event::Empty(tag)) => {
                let name = String::from_utf8_lossy(tag.name().as_ref()).into_owned();
                if is_mesh(&name) {
                    seen = true;
                    elsewhere(&tag, at)?;
                }
                parser.empty(&name, &tag, at)?;
            }
            Ok(Event::Text(more)) => match more.unescape() {
                Ok(more) => parser.words += &more,
                Err(error) => return fault(format!("line {at}: {error}")),
            },
            Ok(Event::End(_)) => {
                let name = open.pop().unwrap_or_default();
                parser.end(&name, at)?;
                if is_mesh(&name) {
                    parser.is_inside = false;
                }
            }
            Ok(_) => {}
        }
    }
    if let Some(tag) = open.last() {
        return fault(format!(
            "the file ends inside <{}>; is it cut off?",
            short(tag)
        ));
    }
    if !seen {
        return fault("the file has neither <Mesh> nor <Geometry>");
    }
    Ok(Model {
        scopes: vec![parser.scope],
        instances: Vec::new(),
    })
}

fn is_mesh(name: &str) -> bool {
    name == "Mesh" || name == "Geometry"
}

/// Refuses a mesh that lies in another file.
fn elsewhere(tag: &BytesStart<'_>, at: usize) -> Result<(), Fault> {
    match attribute(tag, "from", at)? {
        Some(file) => fault(format!(
            "line {at}: the mesh is in {}; import that file",
            short(&file)
        )),
        None => Ok(()),
    }
}

/// Numbers of lines by positions that only grow.
struct Lines<'a> {
    text: &'a str,
    at: usize,
    line: usize,
}

impl Lines<'_> {
    fn of(&mut self, position: usize) -> usize {
        let end = position.clamp(self.at, self.text.len().max(self.at));
        let passed = self.text.as_bytes().get(self.at..end).unwrap_or_default();
        self.line += passed.iter().filter(|byte| **byte == b'\n').count();
        self.at = end;
        self.line
    }
}

fn attribute(tag: &BytesStart<'_>, wanted: &str, at: usize) -> Result<Option<String>, Fault> {
    // Looking for attributes that come twice would take the square of their number.
    for attribute in tag.attributes().with_checks(false) {
        match attribute {
            Ok(found) if found.key.as_ref() == wanted.as_bytes() => {
                let value = String::from_utf8_lossy(&found.value).into_owned();
                return Ok(Some(value));
            }
            Ok(_) => {}
            Err(error) => return fault(format!("line {at}: {error}")),
        }
    }
    Ok(None)
}

impl Parser {
    fn start(&mut self, name: &str, tag: &BytesStart<'_>, at: usize) -> Result<(), Fault> {
        self.words.clear();
        if self.place.is_some() {
            self.number = attribute(tag, "id", at)?;
            self.material = attribute(tag, "mat", at)?;
            self.inner.push(name.to_owned());
        } else if self.is_inside {
            self.place = self.section(name, tag, at)?;
        }
        Ok(())
    }

    /// What a tag below the mesh opens.
    fn section(
        &mut self,
        name: &str,
        tag: &BytesStart<'_>,
        at: usize,
    ) -> Result<Option<Place>, Fault> {
        let called = attribute(tag, "name", at)?;
        Ok(match name {
            "Nodes" => Some(Place::Nodes(called)),
            "Elements" => {
                self.parts += 1;
                let kind = match attribute(tag, "type", at)? {
                    None => None,
                    Some(kind) => match kind_of(&kind) {
                        Some(kind) => Some(kind),
                        None => {
                            return Err(Fault::Kind {
                                element: self.parts,
                                kind: format!(
                                    "`{}` (part {}, line {at})",
                                    short(&kind),
                                    called.unwrap_or_default()
                                ),
                            });
                        }
                    },
                };
                let called = called.or(attribute(tag, "mat", at)?);
                Some(Place::Elements {
                    kind,
                    name: called.unwrap_or_else(|| self.parts.to_string()),
                })
            }
            "NodeSet" => called.map(Place::NodeSet),
            "ElementSet" => called.map(Place::ElementSet),
            "Surface" => called.map(Place::Surface),
            _ => None,
        })
    }

    /// `<n id="1"/>`, or a set inside a set.
    fn empty(&mut self, name: &str, tag: &BytesStart<'_>, at: usize) -> Result<(), Fault> {
        let id = attribute(tag, "id", at)?;
        match (&self.place, name) {
            (Some(Place::NodeSet(set)), "NodeSet" | "node_set") => {
                let (set, inner) = (set.clone(), attribute(tag, "node_set", at)?);
                if let Some(inner) = inner {
                    self.scope.node_sets.named(&set, at).push(Entry::Set(inner));
                }
                Ok(())
            }
            (Some(Place::ElementSet(set)), "ElementSet" | "elem_set") => {
                let (set, inner) = (set.clone(), attribute(tag, "elem_set", at)?);
                if let Some(inner) = inner {
                    self.scope
                        .element_sets
                        .named(&set, at)
                        .push(Entry::Set(inner));
                }
                Ok(())
            }
            (Some(_), _) => match id {
                Some(id) => self.members(&id, at),
                None => Ok(()),
            },
            (None, _) => Ok(()),
        }
    }

    fn end(&mut self, name: &str, at: usize) -> Result<(), Fault> {
        let words = std::mem::take(&mut self.words);
        if self.place.is_none() {
            return Ok(());
        }
        if self.inner.pop().is_none() {
            // The section itself.
            self.members(&words, at)?;
            self.place = None;
            return Ok(());
        }
        let number = self.number.take();
        match self.place {
            Some(Place::Nodes(_) | Place::Elements { .. } | Place::Surface(_)) => {
                self.entry(name, number, &words, at)
            }
            _ => self.members(&number.unwrap_or_default(), at),
        }
    }

    /// A node, an element or a face.
    fn entry(
        &mut self,
        tag: &str,
        number: Option<String>,
        words: &str,
        at: usize,
    ) -> Result<(), Fault> {
        let list: Vec<&str> = words.split(',').map(str::trim).collect();
        let number = || match &number {
            Some(number) => whole(number, at),
            None => fault(format!("line {at}: an entry has no id")),
        };
        match &self.place {
            Some(Place::Nodes(set)) => {
                let number = number()?;
                let &[x, y, z] = list.as_slice() else {
                    return fault(format!(
                        "line {at}: node {number} has {} coordinates, must have three",
                        list.len()
                    ));
                };
                self.scope
                    .node(number, [real(x, at)?, real(y, at)?, real(z, at)?])?;
                if let Some(set) = set {
                    self.scope
                        .node_sets
                        .named(set, at)
                        .push(Entry::Number(number));
                }
            }
            Some(Place::Elements { kind, name }) => {
                let Some(kind) = kind.or_else(|| kind_of(tag)) else {
                    return Err(Fault::Kind {
                        element: self.scope.elements.len(),
                        kind: format!("`{}` (line {at})", short(tag)),
                    });
                };
                let Some((shape, count)) = kind else {
                    return Ok(());
                };
                let number = number()?;
                let nodes = list.iter().map(|word| whole(word, at));
                let nodes: Vec<u64> = nodes.collect::<Result<_, _>>()?;
                if nodes.len() != count {
                    return fault(format!(
                        "line {at}: element {number} has {} nodes, must have {count}",
                        nodes.len()
                    ));
                }
                self.scope.element(number, shape, nodes)?;
                // Only version 1.2 has a material for each element.
                let name = self.material.as_ref().unwrap_or(name);
                self.scope
                    .element_sets
                    .named(name, at)
                    .push(Entry::Number(number));
            }
            Some(Place::Surface(name)) => {
                if let Some(Some((Shape::Triangle, count))) = kind_of(tag) {
                    let nodes = list.iter().map(|word| whole(word, at));
                    let nodes: Vec<u64> = nodes.collect::<Result<_, _>>()?;
                    if nodes.len() != count {
                        return fault(format!(
                            "line {at}: a face of surface {} has {} nodes, must have {count}",
                            short(name),
                            nodes.len()
                        ));
                    }
                    self.scope.surfaces.named(name, at).push(Face::Nodes(nodes));
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Members of a set, with commas or blanks between them.
    fn members(&mut self, words: &str, at: usize) -> Result<(), Fault> {
        let (sets, name) = match &self.place {
            Some(Place::NodeSet(name)) => (&mut self.scope.node_sets, name),
            Some(Place::ElementSet(name)) => (&mut self.scope.element_sets, name),
            _ => return Ok(()),
        };
        let set = sets.named(name, at);
        for word in words.split([',', ' ', '\n', '\t', '\r']) {
            if !word.is_empty() {
                set.push(member(word, at)?);
            }
        }
        Ok(())
    }
}

/// A number, a range or another set.
fn member(word: &str, at: usize) -> Result<Entry, Fault> {
    if let Some(other) = word.strip_prefix('@') {
        let (kind, name) = other.split_once(':').unwrap_or(("", other));
        return Ok(match kind {
            "surface" => Entry::NodesOfSurface(name.to_owned()),
            "elem_set" | "part" => Entry::NodesOfElements(name.to_owned()),
            _ => Entry::Set(name.to_owned()),
        });
    }
    if !word.contains(':') {
        return Ok(Entry::Number(whole(word, at)?));
    }
    let numbers = word.split(':').map(|part| whole(part, at));
    let numbers: Vec<u64> = numbers.collect::<Result<_, _>>()?;
    match *numbers.as_slice() {
        [first, last] => Ok(Entry::Range(first, last, 1)),
        [first, last, step] => Ok(Entry::Range(first, last, step)),
        _ => fault(format!(
            "line {at}: `{}` is no range of first, last and step",
            short(word)
        )),
    }
}
