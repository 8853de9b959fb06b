//! What an Abaqus or FEBio file says: scopes with nodes, elements and sets by their own numbers, and instances that place them.
//!
//! The first scope is the file itself (Abaqus: the assembly too); each part is one more. An instance is a scope with its place. A
//! scope with tetrahedra that no instance names stands for itself, unless others are instances.

use super::super::body::{Read, TetList};
use super::super::error::{Fault, fault};
use std::collections::HashMap;

/// Elements by what they become.
#[derive(Clone, Copy, PartialEq)]
pub enum Shape {
    Tetrahedron,
    Triangle,
}

pub struct Element {
    pub number: u64,
    pub shape: Shape,
    pub nodes: Vec<u64>,
}

/// A line of a set.
#[derive(Clone)]
pub enum Entry {
    Number(u64),
    /// First, last and step.
    Range(u64, u64, u64),
    /// Another set of the same kind.
    Set(String),
    /// A node set: the nodes of a set of elements, or of a surface.
    NodesOfElements(String),
    NodesOfSurface(String),
    /// What the entry means in an instance.
    Of(String, Box<Entry>),
}

/// A face of a surface: of elements on a side, or by its nodes.
pub enum Face {
    /// Elements, and the number of their side; without one all sides.
    Side(Entry, Option<usize>),
    Nodes(Vec<u64>),
}

/// A set, and the line of its first entry.
pub struct Set<T> {
    pub name: String,
    pub line: usize,
    pub entries: Vec<T>,
}

/// Sets of one kind by name, in the order of the file. Names compare without case.
pub struct Sets<T> {
    pub list: Vec<Set<T>>,
    place: HashMap<String, usize>,
}

impl<T> Default for Sets<T> {
    fn default() -> Self {
        Self {
            list: Vec::new(),
            place: HashMap::new(),
        }
    }
}

impl<T> Sets<T> {
    /// The entries of a set, to which `line` adds.
    pub fn named(&mut self, name: &str, line: usize) -> &mut Vec<T> {
        let key = name.to_uppercase();
        let place = *self.place.entry(key).or_insert_with(|| {
            self.list.push(Set {
                name: name.to_owned(),
                line,
                entries: Vec::new(),
            });
            self.list.len() - 1
        });
        &mut self.list[place].entries
    }

    /// The number of a set.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.place.get(&name.to_uppercase()).copied()
    }
}

/// Numbers that mean the same thing everywhere.
#[derive(Default)]
pub struct Scope {
    pub name: String,
    pub positions: Vec<[f64; 3]>,
    pub place_of_node: HashMap<u64, u32>,
    pub elements: Vec<Element>,
    pub place_of_element: HashMap<u64, usize>,
    pub node_sets: Sets<Entry>,
    pub element_sets: Sets<Entry>,
    pub surfaces: Sets<Face>,
}

impl Scope {
    pub fn node(&mut self, number: u64, point: [f64; 3]) -> Result<(), Fault> {
        let place = self.positions.len() as u32;
        if self.place_of_node.insert(number, place).is_some() {
            return fault(format!(
                "node {number} appears twice; export each part with numbers of its own, or by itself"
            ));
        }
        self.positions.push(point);
        Ok(())
    }

    pub fn element(&mut self, number: u64, shape: Shape, nodes: Vec<u64>) -> Result<(), Fault> {
        let place = self.elements.len();
        if self.place_of_element.insert(number, place).is_some() {
            return fault(format!(
                "element {number} appears twice; export each part with numbers of its own, or by itself"
            ));
        }
        self.elements.push(Element {
            number,
            shape,
            nodes,
        });
        Ok(())
    }

    pub fn has_tets(&self) -> bool {
        self.elements.iter().any(|e| e.shape == Shape::Tetrahedron)
    }
}

/// A rotation and a shift.
#[derive(Clone, Copy)]
pub struct Placement {
    pub rows: [[f64; 3]; 3],
    pub shift: [f64; 3],
}

impl Placement {
    pub const IDENTITY: Self = Self {
        rows: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        shift: [0.0; 3],
    };

    /// Turns what the shift has placed about the axis from `a` to `b` (Rodrigues' formula).
    pub fn turn(&mut self, a: [f64; 3], b: [f64; 3], degrees: f64) {
        let axis = [0, 1, 2].map(|k| b[k] - a[k]);
        let length = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
        if length == 0.0 {
            return;
        }
        let [x, y, z] = axis.map(|c| c / length);
        let (sin, cos) = degrees.to_radians().sin_cos();
        let across = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
        self.rows = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let same = if i == j { cos } else { 0.0 };
                same + sin * across[i][j] + (1.0 - cos) * [x, y, z][i] * [x, y, z][j]
            })
        });
        let from = [0, 1, 2].map(|k| self.shift[k] - a[k]);
        self.shift = a;
        self.shift = self.of(from);
    }

    fn of(&self, point: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|k| {
            let row = self.rows[k];
            row[0] * point[0] + row[1] * point[1] + row[2] * point[2] + self.shift[k]
        })
    }
}

pub struct Instance {
    pub name: String,
    pub scope: usize,
    pub placement: Placement,
    /// The first of its nodes in the whole file.
    pub first_node: u32,
}

pub struct Model {
    pub scopes: Vec<Scope>,
    pub instances: Vec<Instance>,
}

impl Default for Model {
    fn default() -> Self {
        Self {
            scopes: vec![Scope::default()],
            instances: Vec::new(),
        }
    }
}

impl Model {
    /// Leaves the instances that have tetrahedra, and adds those of scopes that stand for themselves.
    ///
    /// # Errors
    /// Instances by the thousand, each a copy of many elements.
    pub fn place_instances(&mut self) -> Result<(), Fault> {
        let has_tets: Vec<bool> = self.scopes.iter().map(Scope::has_tets).collect();
        self.instances.retain(|instance| has_tets[instance.scope]);
        let is_placed = !self.instances.is_empty();
        for scope in 0..self.scopes.len() {
            if has_tets[scope] && (scope == 0 || !is_placed) {
                self.instances.push(Instance {
                    name: self.scopes[scope].name.clone(),
                    scope,
                    placement: Placement::IDENTITY,
                    first_node: 0,
                });
            }
        }
        let size = |scope: &Scope| scope.positions.len() + scope.elements.len();
        let copies = self.instances.iter().map(|i| size(&self.scopes[i.scope]));
        let copies = copies.fold(0, usize::saturating_add);
        if copies > 1000 + 100 * self.scopes.iter().map(size).sum::<usize>() {
            return fault(format!(
                "its {} instances have {copies} nodes and elements in all, which is no one body",
                self.instances.len()
            ));
        }
        let mut first = 0u32;
        for instance in &mut self.instances {
            instance.first_node = first;
            let count = self.scopes[instance.scope].positions.len();
            first = first.saturating_add(count as u32);
        }
        Ok(())
    }

    /// All nodes of the instances.
    pub fn positions(&self) -> Vec<[f64; 3]> {
        let of = |instance: &Instance| {
            let placement = instance.placement;
            let points = self.scopes[instance.scope].positions.iter();
            points.map(move |&point| placement.of(point))
        };
        self.instances.iter().flat_map(of).collect()
    }

    /// The nodes of an element in the whole file.
    pub fn nodes(&self, instance: &Instance, element: &Element) -> Result<Vec<u32>, Fault> {
        let place = |node: &u64| match self.scopes[instance.scope].place_of_node.get(node) {
            Some(place) => Ok(instance.first_node + place),
            None => fault(format!(
                "element {} names node {node}, which does not exist",
                element.number
            )),
        };
        element.nodes.iter().map(place).collect()
    }

    /// The tetrahedra of all instances.
    pub fn tets(&self) -> Result<Read, Fault> {
        let mut tets = TetList::default();
        for instance in &self.instances {
            let elements = self.scopes[instance.scope].elements.iter();
            for element in elements.filter(|e| e.shape == Shape::Tetrahedron) {
                tets.add(&self.nodes(instance, element)?);
            }
        }
        let none = "the file holds no tetrahedra (C3D4, C3D10, tet4, tet10)";
        tets.finish(self.positions(), none)
    }
}
