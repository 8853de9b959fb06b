//! Tetrahedra of an Abaqus or CalculiX input file (`.inp`), with its sets.
//!
//! Keywords begin with `*`, comments with `**`; a keyword line that ends with a comma goes on in the next, and so does an element's.
//! Read are `*NODE` (number, x, y, z; a normal may follow), `*ELEMENT` of tetrahedra (C3D4, C3D10) and of triangles, `*NSET`, `*ELSET`
//! and `*SURFACE` of all kinds, parts and instances with their places. Other volumes are an error; everything else is skipped.

use super::super::error::{Fault, fault};
use super::super::words::{real, short, whole};
use super::keywords::{name_of, parameter, shape_of};
use super::model::{Entry, Face, Instance, Model, Placement, Scope, Shape};
use std::collections::HashMap;

/// What the data lines below a keyword are.
enum Block {
    Nodes {
        set: Option<String>,
    },
    Elements {
        shape: Shape,
        count: usize,
        set: Option<String>,
    },
    NodeSet {
        name: String,
        options: SetOptions,
    },
    ElementSet {
        name: String,
        options: SetOptions,
    },
    /// Elements and their sides, or nodes.
    Surface {
        name: String,
        is_of_nodes: bool,
    },
    /// The lines of an instance that have been read.
    Instance(usize),
    Skipped,
}

#[derive(Clone)]
struct SetOptions {
    ranges: bool,
    instance: Option<String>,
}

struct Parser {
    model: Model,
    /// The scope that is open.
    scope: usize,
    scope_of_part: HashMap<String, usize>,
    block: Block,
    /// Words of an element that goes on in the next line.
    pending: Vec<String>,
}

/// Reads the file.
pub(super) fn parse(text: &str) -> Result<Model, Fault> {
    let mut parser = Parser {
        model: Model::default(),
        scope: 0,
        scope_of_part: HashMap::new(),
        block: Block::Skipped,
        pending: Vec::new(),
    };
    let mut lines = text.lines().zip(1..).map(|(line, at)| (at, line.trim()));
    while let Some((at, line)) = lines.next() {
        if line.is_empty() || line.starts_with("**") {
            continue;
        }
        if !line.starts_with('*') {
            parser.data(at, line)?;
            continue;
        }
        parser.end_block(at)?;
        let mut keyword = line.to_owned();
        while keyword.ends_with(',') {
            match lines.next() {
                Some((_, more)) => keyword += more,
                None => return fault(format!("line {at}: the file ends inside a keyword")),
            }
        }
        parser.begin(&keyword, at)?;
    }
    parser.end_block(text.lines().count())?;
    Ok(parser.model)
}

impl Parser {
    fn open(&mut self) -> &mut Scope {
        &mut self.model.scopes[self.scope]
    }

    fn begin(&mut self, keyword: &str, at: usize) -> Result<(), Fault> {
        let named = |wanted: &str, name: &str| match parameter(keyword, wanted) {
            Some(found) => Ok(found),
            None => fault(format!("line {at}: {name} has no name")),
        };
        let options = SetOptions {
            ranges: parameter(keyword, "GENERATE").is_some(),
            instance: parameter(keyword, "INSTANCE"),
        };
        let keyword_name = name_of(keyword);
        if ["NODE", "ELEMENT", "NSET", "ELSET"].contains(&keyword_name.as_str())
            && parameter(keyword, "INPUT").is_some()
        {
            return fault(format!(
                "line {at}: INPUT= is not followed; put nodes and elements into one file"
            ));
        }
        self.block = match keyword_name.as_str() {
            "PART" => {
                let name = parameter(keyword, "NAME").unwrap_or_default();
                self.model.scopes.push(Scope {
                    name: name.clone(),
                    ..Scope::default()
                });
                self.scope = self.model.scopes.len() - 1;
                if self
                    .scope_of_part
                    .insert(name.to_uppercase(), self.scope)
                    .is_some()
                {
                    return fault(format!("line {at}: a second *PART is called `{name}`"));
                }
                Block::Skipped
            }
            "END PART" | "END INSTANCE" | "ASSEMBLY" | "END ASSEMBLY" => {
                self.scope = 0;
                Block::Skipped
            }
            "INSTANCE" => {
                let part = parameter(keyword, "PART").unwrap_or_default();
                let scope = match self.scope_of_part.get(&part.to_uppercase()) {
                    Some(&scope) => scope,
                    None => {
                        // It may hold its own mesh.
                        self.model.scopes.push(Scope::default());
                        self.model.scopes.len() - 1
                    }
                };
                self.model.instances.push(Instance {
                    name: named("NAME", "*INSTANCE")?,
                    scope,
                    placement: Placement::IDENTITY,
                    first_node: 0,
                });
                if part.is_empty() {
                    self.scope = scope;
                }
                Block::Instance(0)
            }
            "NODE" => {
                let system = parameter(keyword, "SYSTEM").unwrap_or_default();
                if !(system.is_empty() || system.eq_ignore_ascii_case("R")) {
                    return fault(format!(
                        "line {at}: coordinates in SYSTEM={} are not read; give x, y and z",
                        short(&system)
                    ));
                }
                Block::Nodes {
                    set: parameter(keyword, "NSET"),
                }
            }
            "SYSTEM" => {
                return fault(format!(
                    "line {at}: *SYSTEM is not followed; give nodes in the global system"
                ));
            }
            "ELEMENT" => {
                let Some(kind) = parameter(keyword, "TYPE") else {
                    return fault(format!("line {at}: *ELEMENT has no TYPE"));
                };
                let upper = kind.to_uppercase();
                let is_volume = ["C3D", "CC3D", "DC3D", "AC3D", "CSS", "SC"]
                    .iter()
                    .any(|volume| upper.starts_with(volume));
                match shape_of(&kind) {
                    Some((shape, count)) => Block::Elements {
                        shape,
                        count,
                        set: parameter(keyword, "ELSET"),
                    },
                    None if is_volume => {
                        return Err(Fault::Kind {
                            element: at,
                            kind: format!("{} (line {at})", short(&kind)),
                        });
                    }
                    None => Block::Skipped,
                }
            }
            "NSET" => {
                let name = named("NSET", "*NSET")?;
                if let Some(elements) = parameter(keyword, "ELSET") {
                    let entry = within(Entry::NodesOfElements(elements), &options.instance);
                    self.open().node_sets.named(&name, at).push(entry);
                }
                Block::NodeSet { name, options }
            }
            "ELSET" => Block::ElementSet {
                name: named("ELSET", "*ELSET")?,
                options,
            },
            "SURFACE" => {
                let kind = parameter(keyword, "TYPE").unwrap_or_default();
                let kind = kind.to_uppercase();
                match kind.as_str() {
                    "" | "ELEMENT" | "NODE" => Block::Surface {
                        name: named("NAME", "*SURFACE")?,
                        is_of_nodes: kind == "NODE",
                    },
                    _ => Block::Skipped,
                }
            }
            "INCLUDE" => {
                return fault(format!(
                    "line {at}: *INCLUDE is not followed; put nodes and elements into one file"
                ));
            }
            _ => Block::Skipped,
        };
        Ok(())
    }

    fn end_block(&mut self, at: usize) -> Result<(), Fault> {
        if self.pending.is_empty() {
            return Ok(());
        }
        fault(format!(
            "line {at}: element {} has {} nodes, too few: is the file cut off?",
            short(&self.pending[0]),
            self.pending.len() - 1
        ))
    }

    fn data(&mut self, at: usize, line: &str) -> Result<(), Fault> {
        let words = || line.split(',').map(str::trim);
        let filled = || words().filter(|word| !word.is_empty());
        match &mut self.block {
            Block::Nodes { set } => {
                // A coordinate that is left out is 0.
                let words: Vec<&str> = words().take(8).collect();
                let [number, x, y, z, ..] = words[..] else {
                    return fault(format!(
                        "line {at}: a node is a number and three coordinates, not `{}`: is the file cut off?",
                        short(line)
                    ));
                };
                let number = whole(number, at)?;
                let coordinate = |word: &str| match word {
                    "" => Ok(0.0),
                    word => real(word, at),
                };
                let point = [coordinate(x)?, coordinate(y)?, coordinate(z)?];
                let scope = &mut self.model.scopes[self.scope];
                scope.node(number, point)?;
                if let Some(set) = set {
                    scope.node_sets.named(set, at).push(Entry::Number(number));
                }
            }
            Block::Elements { shape, count, set } => {
                self.pending.extend(filled().map(str::to_owned));
                if self.pending.len() <= *count {
                    // Only a comma at its end says that a line goes on.
                    return match line.ends_with(',') {
                        true => Ok(()),
                        false => fault(format!(
                            "line {at}: an element of this type is a number and {count} nodes, not `{}`: is the file cut off?",
                            short(line)
                        )),
                    };
                }
                if self.pending.len() > *count + 1 {
                    return fault(format!(
                        "line {at}: an element of this type has {count} nodes, not {}",
                        self.pending.len() - 1
                    ));
                }
                let numbers = self.pending.drain(..).map(|word| whole(&word, at));
                let numbers: Vec<u64> = numbers.collect::<Result<_, _>>()?;
                let [number, nodes @ ..] = numbers.as_slice() else {
                    return Ok(());
                };
                let scope = &mut self.model.scopes[self.scope];
                scope.element(*number, *shape, nodes[..*count].to_vec())?;
                if let Some(set) = set {
                    scope
                        .element_sets
                        .named(set, at)
                        .push(Entry::Number(*number));
                }
            }
            Block::NodeSet { name, options } => {
                let found = members(filled(), options, at)?;
                let scope = &mut self.model.scopes[self.scope];
                scope.node_sets.named(name, at).extend(found);
            }
            Block::ElementSet { name, options } => {
                let found = members(filled(), options, at)?;
                let scope = &mut self.model.scopes[self.scope];
                scope.element_sets.named(name, at).extend(found);
            }
            Block::Surface { name, is_of_nodes } => {
                let scope = &mut self.model.scopes[self.scope];
                let mut words = filled();
                let Some(first) = words.next() else {
                    return Ok(());
                };
                let entry = member(first, &None);
                if *is_of_nodes {
                    scope.node_sets.named(name, at).push(entry);
                } else {
                    // S1 to S4 are sides; SPOS and SNEG are those of a shell.
                    let side = words.next().unwrap_or_default();
                    let side = side.trim_start_matches(['s', 'S']).parse().ok();
                    scope.surfaces.named(name, at).push(Face::Side(entry, side));
                }
            }
            Block::Instance(lines) => {
                let numbers = filled().map(|word| real(word, at));
                let numbers: Vec<f64> = numbers.collect::<Result<_, _>>()?;
                *lines += 1;
                let (lines, instance) = (*lines, self.model.instances.last_mut());
                if let Some(instance) = instance {
                    match (lines, numbers.as_slice()) {
                        (1, &[x, y, z]) => instance.placement.shift = [x, y, z],
                        (2, &[a, b, c, d, e, f, degrees]) => {
                            instance.placement.turn([a, b, c], [d, e, f], degrees);
                        }
                        _ => {
                            return fault(format!(
                                "line {at}: an instance has a shift of three numbers, then a rotation of seven"
                            ));
                        }
                    }
                }
            }
            Block::Skipped => {}
        }
        Ok(())
    }
}

/// An entry of the instance that a set names.
fn within(entry: Entry, instance: &Option<String>) -> Entry {
    match instance {
        Some(instance) => Entry::Of(instance.clone(), Box::new(entry)),
        None => entry,
    }
}

/// A number, a set, or either of an instance: `Liver-1.12`.
fn member(word: &str, instance: &Option<String>) -> Entry {
    let word = word.trim_matches('"');
    if let Ok(number) = word.parse() {
        return within(Entry::Number(number), instance);
    }
    match word.rsplit_once('.') {
        Some((of, inner)) if !of.is_empty() => within(member(inner, &None), &Some(of.to_owned())),
        _ => within(Entry::Set(word.to_owned()), instance),
    }
}

/// Members of a data line of a set.
fn members<'a>(
    words: impl Iterator<Item = &'a str>,
    options: &SetOptions,
    at: usize,
) -> Result<Vec<Entry>, Fault> {
    if !options.ranges {
        return Ok(words.map(|word| member(word, &options.instance)).collect());
    }
    let numbers = words.map(|word| whole(word, at));
    let numbers: Vec<u64> = numbers.collect::<Result<_, _>>()?;
    let entry = match *numbers.as_slice() {
        [first, last] => Entry::Range(first, last, 1),
        [first, last, step] => Entry::Range(first, last, step),
        _ => {
            return fault(format!("line {at}: a range is first, last and step"));
        }
    };
    Ok(vec![within(entry, &options.instance)])
}
