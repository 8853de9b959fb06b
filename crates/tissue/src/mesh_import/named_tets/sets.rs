//! Sets of nodes, elements and faces as names of parts of the body.
//!
//! Sets may name others, also such that come later. One that names what is not there, or itself, or others at many levels, is left
//! out. What they hold in all is bounded by [`super::announced`], [`Labels::add`] and the work of gathering it.

use super::super::error::{Fault, fault};
use super::super::labels::{Labels, Part, boundary, sorted};
use super::model::{Entry, Face, Model, Scope, Set, Shape};
use std::collections::HashMap;

/// Sets within sets, at most.
pub(super) const MOST_LEVELS: usize = 40;

/// Names of a file of this many bytes.
pub fn labels(model: &Model, bytes: usize) -> Result<Labels, Fault> {
    let mut labels = Labels::of_file(bytes);
    labels.positions = model.positions();
    // The number of each tetrahedron in the whole body, by instance and element.
    let mut tet_of = HashMap::new();
    for (at, instance) in model.instances.iter().enumerate() {
        for (place, element) in model.scopes[instance.scope].elements.iter().enumerate() {
            if element.shape == Shape::Tetrahedron {
                let nodes = model.nodes(instance, element)?;
                let Some(&corners) = nodes.first_chunk::<4>() else {
                    continue;
                };
                tet_of.insert((at, place), labels.tets.len());
                labels.tets.push(corners);
            }
        }
    }
    // Points and faces are looked up on the body's own boundary.
    labels.faces = boundary(&labels.tets);
    let mut gatherer = Gatherer {
        face_of: (labels.faces.iter().enumerate())
            .map(|(index, &face)| (sorted(face), index))
            .collect(),
        model,
        tet_of,
        numbers: model.scopes.iter().map(Numbers::of).collect(),
        instance_of: (model.instances.iter().enumerate())
            .map(|(at, instance)| (instance.name.to_uppercase(), at))
            .collect(),
        known: HashMap::new(),
        work: bytes.saturating_mul(16).saturating_add(1 << 20),
    };
    for at in 0..model.scopes.len() {
        for whose in gatherer.instances_of(at) {
            gatherer.scope(at, whose, &mut labels)?;
        }
    }
    Ok(labels)
}

/// Numbers of a scope, ascending.
struct Numbers {
    nodes: Vec<u64>,
    elements: Vec<u64>,
}

impl Numbers {
    fn of(scope: &Scope) -> Self {
        let mut out = Self {
            nodes: scope.place_of_node.keys().copied().collect(),
            elements: scope.place_of_element.keys().copied().collect(),
        };
        out.nodes.sort_unstable();
        out.elements.sort_unstable();
        out
    }
}

#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Kind {
    Nodes,
    Elements,
}

/// A node or an element: its instance, and its place in the instance's scope.
type Member = (usize, u32);

/// The scope of a set, its kind and number, and the instance that numbers without one belong to.
type Key = (usize, Kind, usize, Option<usize>);

struct Gatherer<'a> {
    model: &'a Model,
    face_of: HashMap<[u32; 3], usize>,
    tet_of: HashMap<(usize, usize), usize>,
    numbers: Vec<Numbers>,
    /// By its name in capitals.
    instance_of: HashMap<String, usize>,
    /// What each set holds; none while it is being gathered, and where it cannot be.
    known: HashMap<Key, Option<Vec<Member>>>,
    /// Members that may still be gathered.
    work: usize,
}

impl Gatherer<'_> {
    /// The instances of a scope; for the file itself also that of none of its nodes.
    fn instances_of(&self, scope: usize) -> Vec<Option<usize>> {
        let all = self.model.instances.iter().enumerate();
        let own = all.filter(|(_, instance)| instance.scope == scope);
        let mut found: Vec<Option<usize>> = own.map(|(at, _)| Some(at)).collect();
        if scope == 0 && found.is_empty() {
            found.push(None);
        }
        found
    }

    /// Adds all names of a scope for one of its instances.
    fn scope(&mut self, at: usize, whose: Option<usize>, labels: &mut Labels) -> Result<(), Fault> {
        let scope = &self.model.scopes[at];
        for (set, Set { name, .. }) in scope.node_sets.list.iter().enumerate() {
            let members = self.set((at, Kind::Nodes, set, whose), 0)?;
            let id = labels.name(name);
            for (instance, place) in members.unwrap_or_default() {
                let first = self.model.instances[instance].first_node;
                labels.add(id, Part::Point((first + place) as usize))?;
            }
        }
        for (set, Set { name, .. }) in scope.element_sets.list.iter().enumerate() {
            let members = self.set((at, Kind::Elements, set, whose), 0)?;
            let id = labels.name(name);
            for (instance, place) in members.unwrap_or_default() {
                let part = match self.tet_of.get(&(instance, place as usize)) {
                    Some(&tet) => Some(Part::Tet(tet)),
                    None => self.face((instance, place)).map(Part::Face),
                };
                if let Some(part) = part {
                    labels.add(id, part)?;
                }
            }
        }
        for Set { name, entries, .. } in &scope.surfaces.list {
            let Some(faces) = self.surface(at, entries, whose, 0)? else {
                continue;
            };
            let id = labels.name(name);
            for face in faces {
                if let Some(&face) = self.face_of.get(&sorted(face)) {
                    labels.add(id, Part::Face(face))?;
                }
            }
        }
        Ok(())
    }

    /// The boundary's face that a triangle lies on.
    fn face(&self, (instance, place): Member) -> Option<usize> {
        let instance = &self.model.instances[instance];
        let element = &self.model.scopes[instance.scope].elements[place as usize];
        let nodes = self.model.nodes(instance, element).ok()?;
        let corners = nodes.first_chunk::<3>()?;
        self.face_of.get(&sorted(*corners)).copied()
    }

    fn spend(&mut self, work: usize) -> Result<(), Fault> {
        match self.work.checked_sub(work) {
            Some(left) => {
                self.work = left;
                Ok(())
            }
            None => fault(
                "its sets hold far more members than a file of this size needs; leave out those that are not needed",
            ),
        }
    }

    /// What a set holds, ascending; none if it cannot be known.
    fn set(&mut self, key: Key, level: usize) -> Result<Option<Vec<Member>>, Fault> {
        if let Some(known) = self.known.get(&key) {
            let known = known.clone();
            self.spend(known.as_ref().map_or(1, Vec::len))?;
            return Ok(known);
        }
        let (scope, kind, set, whose) = key;
        let scope_of = &self.model.scopes[scope];
        let entries = match kind {
            Kind::Nodes => &scope_of.node_sets.list[set].entries,
            Kind::Elements => &scope_of.element_sets.list[set].entries,
        };
        self.known.insert(key, None);
        let mut out = Vec::new();
        for entry in entries {
            match self.entry(scope, kind, entry, whose, level)? {
                Some(members) => out.extend(members),
                None => return Ok(None),
            }
        }
        out.sort_unstable();
        out.dedup();
        self.spend(out.len())?;
        self.known.insert(key, Some(out.clone()));
        Ok(Some(out))
    }

    fn entry(
        &mut self,
        scope: usize,
        kind: Kind,
        entry: &Entry,
        whose: Option<usize>,
        level: usize,
    ) -> Result<Option<Vec<Member>>, Fault> {
        if level > MOST_LEVELS {
            return Ok(None);
        }
        self.spend(1)?;
        let sets = &self.model.scopes[scope];
        Ok(match entry {
            Entry::Number(number) => Some(self.number(kind, *number, whose).into_iter().collect()),
            Entry::Range(first, last, step) => {
                let Some(instance) = whose else {
                    return Ok(Some(Vec::new()));
                };
                let numbers = &self.numbers[self.model.instances[instance].scope];
                let numbers = match kind {
                    Kind::Nodes => &numbers.nodes,
                    Kind::Elements => &numbers.elements,
                };
                let from = numbers.partition_point(|number| number < first);
                let to = numbers.partition_point(|number| number <= last);
                let inside = numbers.get(from..to).unwrap_or_default().to_vec();
                self.spend(inside.len())?;
                let on_step = |number: &u64| (number - first).is_multiple_of((*step).max(1));
                let members = inside.into_iter().filter(on_step);
                let member = |number| self.number(kind, number, whose);
                Some(members.filter_map(member).collect())
            }
            Entry::Set(name) => {
                let found = match kind {
                    Kind::Nodes => sets.node_sets.find(name),
                    Kind::Elements => sets.element_sets.find(name),
                };
                match found {
                    Some(set) => self.set((scope, kind, set, whose), level + 1)?,
                    None => None,
                }
            }
            Entry::NodesOfElements(name) => {
                let Some(set) = sets.element_sets.find(name) else {
                    return Ok(None);
                };
                let elements = self.set((scope, Kind::Elements, set, whose), level + 1)?;
                elements.map(|elements| {
                    let of = |(instance, place): Member| {
                        let scope = &self.model.scopes[self.model.instances[instance].scope];
                        let nodes = scope.elements[place as usize].nodes.iter();
                        let places = nodes.filter_map(|node| scope.place_of_node.get(node));
                        places.map(move |&place| (instance, place))
                    };
                    elements.into_iter().flat_map(of).collect()
                })
            }
            Entry::NodesOfSurface(name) => {
                let Some(surface) = sets.surfaces.find(name) else {
                    return Ok(None);
                };
                let faces = &sets.surfaces.list[surface].entries;
                let faces = self.surface(scope, faces, whose, level + 1)?;
                let all = &self.model.instances;
                let member = |node: u32| {
                    let after = all.partition_point(|i| i.first_node <= node);
                    let instance = after.checked_sub(1)?;
                    Some((instance, node - all[instance].first_node))
                };
                faces.map(|faces| faces.into_iter().flatten().filter_map(member).collect())
            }
            Entry::Of(name, entry) => {
                let Some(&instance) = self.instance_of.get(&name.to_uppercase()) else {
                    // The name of a set may have a dot; an instance without tetrahedra has no members.
                    return match &**entry {
                        Entry::Set(inner) => {
                            let whole = Entry::Set(format!("{name}.{inner}"));
                            let found = self.entry(scope, kind, &whole, whose, level + 1)?;
                            Ok(Some(found.unwrap_or_default()))
                        }
                        _ => Ok(Some(Vec::new())),
                    };
                };
                // Numbers and sets of the instance's part; sets of the assembly go by the same name.
                let part = self.model.instances[instance].scope;
                let found = self.entry(part, kind, entry, Some(instance), level + 1)?;
                match found {
                    None if part != scope => {
                        self.entry(scope, kind, entry, Some(instance), level + 1)?
                    }
                    found => found,
                }
            }
        })
    }

    fn number(&self, kind: Kind, number: u64, whose: Option<usize>) -> Option<Member> {
        let instance = whose?;
        let scope = &self.model.scopes[self.model.instances[instance].scope];
        let place = match kind {
            Kind::Nodes => scope.place_of_node.get(&number).copied(),
            Kind::Elements => scope.place_of_element.get(&number).map(|&at| at as u32),
        };
        place.map(|place| (instance, place))
    }

    /// Triangles of a surface, by nodes of the whole file.
    fn surface(
        &mut self,
        scope: usize,
        faces: &[Face],
        whose: Option<usize>,
        level: usize,
    ) -> Result<Option<Vec<[u32; 3]>>, Fault> {
        let mut out = Vec::new();
        for face in faces {
            match face {
                Face::Nodes(nodes) => {
                    self.spend(1)?;
                    let place = |&node: &u64| {
                        let (instance, place) = self.number(Kind::Nodes, node, whose)?;
                        Some(self.model.instances[instance].first_node + place)
                    };
                    let nodes: Option<Vec<u32>> = nodes.iter().map(place).collect();
                    out.extend(nodes.as_deref().and_then(|n| n.first_chunk::<3>()));
                }
                Face::Side(entry, side) => {
                    let elements = self.entry(scope, Kind::Elements, entry, whose, level + 1)?;
                    let Some(elements) = elements else {
                        return Ok(None);
                    };
                    self.spend(elements.len())?;
                    for (instance, place) in elements {
                        let instance = &self.model.instances[instance];
                        let element = &self.model.scopes[instance.scope].elements[place as usize];
                        let nodes = self.model.nodes(instance, element)?;
                        out.extend(sides(element.shape, &nodes, *side));
                    }
                }
            }
        }
        Ok(Some(out))
    }
}

/// Faces of an element in Abaqus's order of sides, all of them without a side.
fn sides(shape: Shape, nodes: &[u32], side: Option<usize>) -> Vec<[u32; 3]> {
    let all = match (shape, nodes) {
        (Shape::Tetrahedron, &[a, b, c, d, ..]) => {
            vec![[a, b, c], [a, d, b], [b, d, c], [c, d, a]]
        }
        // Either side of a shell is the same face.
        (Shape::Triangle, &[a, b, c, ..]) => return vec![[a, b, c]],
        _ => Vec::new(),
    };
    match side {
        Some(side) => all.into_iter().skip(side.wrapping_sub(1)).take(1).collect(),
        None => all,
    }
}
