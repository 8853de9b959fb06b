//! The body is cut, resected, made stiffer or softer between two frames, by the crate [`topology`].
//!
//! Copies of nodes take position and velocity of the node that they come from, and the shares of an element's copies sum to 1: at a cut mass,
//! momentum and both energies stay as they are (the strain energy of average-pressure elements changes with their patches).

use super::fields::Node;
use super::parts::Parts;
use super::relaxing::Relaxing;
use super::{Solver, SolverError};
use contact::{Pieces, SPACING_MM, Samples};
use elements::{Laws, PADDING, Partition, Tetrahedra};
use std::sync::Arc;
use topology::{
    Blade, Body, Change, Element, Fragment, Point, RestMesh, Sweep, TopologyError, origin,
};

impl Solver {
    /// A blade's edge passes a sweep, in the tissue as it is now: see [`Body::cut`].
    ///
    /// # Errors
    /// As there; the body and its motion are then as before.
    pub fn cut(&mut self, sweep: &Sweep, stroke: u32) -> Result<Change, SolverError> {
        let places = self.places();
        self.change(|body| body.cut(sweep, stroke, &places))
    }

    /// The same by a blade that feels the tissue: see [`Body::cut_with`]. What it does to the tissue acts at the end of the next frame, on a line from
    /// the one before.
    ///
    /// # Errors
    /// As there; the body and its motion are then as before.
    pub fn cut_with(
        &mut self,
        blade: &Blade,
        sweep: &Sweep,
        stroke: u32,
    ) -> Result<Change, SolverError> {
        let places = self.places();
        let change = self.change(|body| body.cut_with(blade, sweep, stroke, &places))?;
        self.push(&change.pushes)?;
        Ok(change)
    }

    /// Removes what lies where `depth` is positive, up to a volume: see [`Body::remove`].
    ///
    /// # Errors
    /// As there; the body and its motion are then as before.
    pub fn remove(
        &mut self,
        depth: impl Fn(Point) -> f64,
        most_mm3: f64,
    ) -> Result<Change, SolverError> {
        let places = self.places();
        self.change(|body| body.remove(depth, most_mm3, &places))
    }

    /// Parts what is stretched too far: see [`Body::tear`].
    ///
    /// # Errors
    /// As there; the body and its motion are then as before.
    pub fn tear(&mut self, stretch: f64, most: usize, stroke: u32) -> Result<Change, SolverError> {
        let places = self.places();
        self.change(|body| body.tear(stretch, most, stroke, &places))
    }

    /// Multiplies the stiffness of mesh elements: see [`Body::scale_stiffness`].
    ///
    /// # Errors
    /// As there; the body and its motion are then as before.
    pub fn scale_stiffness(
        &mut self,
        elements: &[u32],
        factor: f32,
    ) -> Result<Change, SolverError> {
        self.change(|body| body.scale_stiffness(elements, factor))
    }

    /// Takes the pieces that nothing holds out of the body, and says what they were.
    ///
    /// # Errors
    /// No memory.
    pub fn drop_fragments(&mut self) -> Result<Vec<Fragment>, SolverError> {
        let Some(body) = &self.topology.body else {
            return Ok(Vec::new());
        };
        let held = &self.topology.held_nodes;
        let fragments = body.fragments(|node| held.binary_search(&node).is_ok())?;
        let cells: Vec<(u32, u32)> = (fragments
            .iter()
            .flat_map(|fragment| fragment.cells.iter().copied()))
        .collect();
        if !cells.is_empty() {
            self.change(|body| body.drop_cells(&cells))?;
        }
        Ok(fragments)
    }

    /// The body as cuts have made it; `None` while it is intact.
    pub fn body(&self) -> Option<&Body> {
        self.topology.body.as_ref()
    }

    /// Nodes, those that cuts added included.
    pub fn node_count(&self) -> usize {
        self.positions.len()
    }

    /// Mass of the body, g.
    pub fn mass(&self) -> f64 {
        self.mass.iter().map(|mass| f64::from(*mass)).sum()
    }

    /// Where each node is now.
    fn places(&self) -> Vec<Point> {
        let mut moved = vec![[0.0; 3]; self.positions.len()];
        self.displacement(&mut moved);
        let places = self.positions.iter().zip(&moved);
        let place = |(rest, u): (&[f32; 3], &[f32; 3])| -> Point {
            [0, 1, 2].map(|k| f64::from(rest[k]) + f64::from(u[k]))
        };
        places.map(place).collect()
    }

    /// Changes the body and follows it, or neither.
    fn change(
        &mut self,
        operation: impl FnOnce(&mut Body) -> Result<Change, TopologyError>,
    ) -> Result<Change, SolverError> {
        if self
            .load
            .as_ref()
            .is_some_and(|load| load.support.is_some())
        {
            return Err(SolverError::Load {
                field: "support".into(),
                reason: "moves the body as it was meshed; cut it without one".into(),
            });
        }
        let mut body = match &self.topology.body {
            Some(body) => body.clone(),
            None => Body::new(Arc::new(RestMesh::new(&self.positions, &self.tets)?)),
        };
        let change = operation(&mut body)?;
        let domain = &self.topology.domain;
        let touchable = body.touchable(|corners| domain.contains(&corners))?;
        let positions: Vec<[f32; 3]> = (0..body.node_count() as u32)
            .map(|node| self.positions[body.parent(node) as usize])
            .collect();
        let (mut tets, mut shares) = (Vec::new(), Vec::new());
        let (mut stiffness, mut region) = (Vec::new(), Vec::new());
        let mut fibre = Vec::new();
        for element in body.elements() {
            tets.push(element.nodes);
            shares.push(element.share as f32);
            let own = self.topology.stiffness.get(element.parent as usize);
            stiffness.push(own.copied().unwrap_or(1.0) * element.stiffness);
            region.extend(self.topology.region.get(element.parent as usize));
            fibre.extend(self.topology.fibre.get(element.parent as usize));
        }
        let tetrahedra = Tetrahedra {
            positions: &positions,
            tets: &tets,
            stiffness: &stiffness,
            laws: Laws {
                of_tet: &region,
                regions: &self.topology.regions,
                fibre: &fibre,
            },
        };
        let held = self.held_copies(&body);
        let parts = Parts::new(tetrahedra, &shares, &held, &self.options)?;
        let first = self.positions.len();
        let source = |node: usize| {
            let mut node = node;
            while node >= first {
                node = change.copied[node - first] as usize;
            }
            node
        };
        let mut fields = super::Fields::default();
        for field in [
            &mut fields.displacement,
            &mut fields.increment,
            &mut fields.force,
        ] {
            field.resize(parts.partition.node_of_slot.len(), Node::default());
        }
        for (node, &slot) in parts.partition.slot_of_node.iter().enumerate() {
            let from = self.partition.slot_of_node[source(node)] as usize;
            if slot != PADDING && from != PADDING as usize {
                fields.displacement[slot as usize] = self.fields.displacement[from];
                fields.increment[slot as usize] = self.fields.increment[from];
            }
        }
        let relaxing = self.follow_relaxing(&parts.partition, &body, source)?;
        self.partition = parts.partition;
        self.relaxing_backup.clone_from(&relaxing);
        self.relaxing = relaxing;
        self.mass = parts.mass;
        self.rest_volume = parts.rest_volume;
        self.speed_squared = parts.speed_squared;
        self.added_mass = parts.added_mass;
        self.held = parts.held;
        self.backup = fields.clone();
        self.fields = fields;
        self.paths.clear();
        // Their nodes may be others.
        self.ties = None;
        self.positions = positions;
        self.tets = tets;
        self.topology.held_nodes = held;
        self.topology.body = Some(body);
        self.follow_loads()?;
        if let Some(touch) = &mut self.touch {
            let held = &self.topology.held_nodes;
            let pieces = Pieces {
                corners: &touchable.corners,
                triangles: &touchable.pieces,
                first_wall: touchable.first_wall,
            };
            let (positions, faces) = (&self.positions, &touchable.faces);
            let samples = Samples::with_pieces(positions, faces, pieces, held, SPACING_MM);
            let samples = samples.unwrap_or_else(|error| panic!("the samples: {error}"));
            touch.follow(&self.positions, &self.partition.slot_of_node, samples);
        }
        self.critical_now =
            self.critical_at_rest * (self.bound_at_rest / self.diagnose().largest_bound).sqrt();
        Ok(change)
    }

    /// What relaxing elements of the new packing of `body` remember; `source` is the node here of each node there.
    fn follow_relaxing(
        &self,
        partition: &Partition,
        body: &Body,
        source: impl Fn(usize) -> usize,
    ) -> Result<Option<Relaxing>, SolverError> {
        let Some(before) = &self.relaxing else {
            return Ok(None);
        };
        let old: Vec<Element> = match &self.topology.body {
            Some(body) => body.elements().collect(),
            None => Vec::new(),
        };
        let sources: Vec<u32> = (body.elements())
            .map(|element| {
                let place = origin(&element, &old, |node| source(node as usize) as u32);
                place.map_or(element.parent, |place| place as u32)
            })
            .collect();
        let mut after = Relaxing::new(partition)?;
        if let Some(after) = &mut after {
            after.follow(partition, (&self.partition, before), &sources)?;
        }
        Ok(after)
    }

    /// Held nodes with their copies, ascending: a copy of a held node is held.
    fn held_copies(&self, body: &Body) -> Vec<u32> {
        let held = &self.topology.held_nodes;
        let nodes = 0..body.node_count() as u32;
        nodes
            .filter(|node| held.binary_search(&body.parent(*node)).is_ok())
            .collect()
    }
}
