//! A solver takes loads: checked, and put where the inner steps find them.

use super::body_load::{BodyLoad, Corner, Face, Loads};
use super::fields::Node;
use super::options::check_positive;
use super::support::{Support, SupportMotion};
use super::{Solver, SolverError};
use crate::mesh::tet_volume;
use std::collections::BTreeMap;
use topology::Push;
use topology::rest::FACES;

impl Solver {
    /// Sets the loads that the next frame ends with; it takes the body there from the present ones, and they stay.
    ///
    /// # Errors
    /// [`SolverError::Load`], with which nothing has changed.
    pub fn set_loads(&mut self, loads: &Loads) -> Result<(), SolverError> {
        if self.load.is_none() && *loads == Loads::default() {
            return Ok(());
        }
        self.check_loads(loads)?;
        let slots = self.partition.node_of_slot.len();
        (self.load.get_or_insert_with(|| BodyLoad::with_slots(slots))).set[1] = loads.clone();
        self.place_loads()
    }

    /// The loads go on with a body that has been cut.
    pub(super) fn follow_loads(&mut self) -> Result<(), SolverError> {
        let Some(load) = self.load.take() else {
            return Ok(());
        };
        let ([start, end], [pushed, push]) = (load.set, load.pushed);
        let slots = self.partition.node_of_slot.len();
        let mut next = BodyLoad::with_slots(slots);
        next.set[1] = start;
        next.pushed[1] = pushed;
        self.load = Some(next);
        self.place_loads()?;
        if let Some(load) = &mut self.load {
            load.arrive();
            load.set[1] = end;
            load.pushed[1] = push;
        }
        self.place_loads()
    }

    /// A blade does this to the tissue at the end of the next frame, too.
    pub(super) fn push(&mut self, pushes: &[Push]) -> Result<(), SolverError> {
        if pushes.is_empty() {
            return Ok(());
        }
        let slots = self.partition.node_of_slot.len();
        let load = self.load.get_or_insert_with(|| BodyLoad::with_slots(slots));
        load.pushed[1].extend_from_slice(pushes);
        self.place_loads()
    }

    /// Puts the loads at the end of the frame where the inner steps find them; those at its start are there.
    pub(super) fn place_loads(&mut self) -> Result<(), SolverError> {
        let mass = self.mass_of_nodes();
        let Some(load) = &mut self.load else {
            return Ok(());
        };
        let loads = &load.set[1];
        let dead = &mut load.dead[1];
        dead.fill(Node::default());
        let mut add = |node: usize, force: [f64; 3]| {
            // Nothing is left around a node without a slot.
            if let Some(own) = dead.get_mut(self.partition.slot_of_node[node] as usize) {
                (own.0.iter_mut().zip(force)).for_each(|(sum, f)| *sum += f as f32);
            }
        };
        for (node, mass) in mass.iter().enumerate() {
            add(node, loads.gravity.map(|g| mass * g));
        }
        let mut parts = Vec::new();
        for (node, force) in loads.forces.iter().enumerate() {
            if *force == [0.0; 3] {
                continue;
            }
            match &self.topology.body {
                Some(body) => body.carriers(node as u32, &mut parts)?,
                None => parts = vec![(node as u32, 1.0)],
            }
            for (node, part) in &parts {
                add(*node as usize, force.map(|f| 1e3 * part * f64::from(f)));
            }
        }
        for push in load.pushed[1].iter().chain(&loads.points) {
            for (node, weight) in push.nodes.into_iter().zip(push.weights) {
                add(node as usize, push.force.map(|f| 1e3 * weight * f));
            }
        }
        let [before, now] = [0, 1].map(|end: usize| {
            let mut pascal = vec![0.0; self.surface.len() + 1];
            for pressure in &load.set[end].pressures {
                for face in &pressure.faces {
                    pascal[*face as usize] += pressure.pascal;
                }
                let walls = if pressure.walls { pressure.pascal } else { 0.0 };
                pascal[self.surface.len()] += walls;
            }
            pascal
        });
        let skin = pressed_faces(&self.surface, self.topology.body.as_ref())?;
        load.faces.clear();
        for (row, corners) in skin {
            let pascal = [before[row], now[row]];
            if pascal == [0.0; 2] {
                continue;
            }
            load.faces.push(Face {
                pascal,
                corners: corners.map(|(nodes, weights)| {
                    let mut corner = Corner {
                        rest: [0.0; 3],
                        parts: [(0, 0.0); 4],
                    };
                    for (k, weight) in weights.into_iter().enumerate() {
                        if weight > 0.0 {
                            let node = nodes[k] as usize;
                            let own = self.positions[node].map(f64::from);
                            (corner.rest.iter_mut().zip(own)).for_each(|(at, x)| *at += weight * x);
                            corner.parts[k] = (self.partition.slot_of_node[node], weight);
                        }
                    }
                    corner
                }),
            });
        }
        Ok(())
    }

    /// Sets where the support ends the next frame, which takes `duration_s`; the held nodes go there from where it is now, and stay after that.
    ///
    /// # Errors
    /// [`SolverError::Load`] for numbers that are not finite and a body that has been cut; nothing has changed.
    pub fn set_support(
        &mut self,
        motion: SupportMotion,
        duration_s: f64,
    ) -> Result<(), SolverError> {
        let fail = |field: &str, reason: &str| {
            Err(SolverError::Load {
                field: field.into(),
                reason: reason.into(),
            })
        };
        let SupportMotion {
            position,
            velocity,
            turn,
            turning,
        } = motion;
        let numbers = [position, velocity, turn, turning];
        if !numbers.as_flattened().iter().all(|v| v.is_finite()) {
            return fail("support", "is not finite");
        }
        check_positive("duration_s", duration_s)?;
        if self.topology.body.is_some() {
            return fail(
                "support",
                "moves the body as it was meshed; this one has been cut",
            );
        }
        let slots = self.partition.node_of_slot.len();
        let mass = self.mass_of_nodes();
        let load = self.load.get_or_insert_with(|| BodyLoad::with_slots(slots));
        let support = load.support.get_or_insert_with(|| {
            let nodes = self
                .partition
                .slot_of_node
                .iter()
                .zip(&self.positions)
                .zip(mass);
            let nodes = nodes.map(|((slot, rest), mass)| {
                let is_held = self.held[*slot as usize];
                (*slot, rest.map(f64::from), mass, is_held)
            });
            Support::new(self.options.material.damping_per_s, nodes)
        });
        support.lead(motion, duration_s);
        Ok(())
    }

    /// Of the body itself by node, g.
    pub(super) fn mass_of_nodes(&self) -> Vec<f64> {
        let mut mass = vec![0.0; self.positions.len()];
        let own = self.options.material.density_kg_m3;
        let laws = self.topology.laws();
        let cells = self.topology.body.as_ref().map(|body| {
            let elements = body.elements();
            elements
                .map(|element| (element.share, element.parent as usize))
                .collect::<Vec<_>>()
        });
        for (at, tet) in self.tets.iter().enumerate() {
            let (share, parent) = cells.as_ref().map_or((1.0, at), |cells| cells[at]);
            let density = 1e-6 * laws.density_of(parent, own);
            let quarter = 0.25 * density * share * tet_volume(&self.positions, *tet);
            tet.iter().for_each(|node| mass[*node as usize] += quarter);
        }
        mass
    }

    fn check_loads(&self, loads: &Loads) -> Result<(), SolverError> {
        let fail = |field: String, reason: &str| {
            Err(SolverError::Load {
                field,
                reason: reason.into(),
            })
        };
        if !loads.gravity.iter().all(|v| v.is_finite()) {
            return fail("gravity".into(), "is not finite");
        }
        let count = match &self.topology.body {
            Some(body) => body.mesh().node_count(),
            None => self.positions.len(),
        };
        if !loads.forces.is_empty() && loads.forces.len() != count {
            return fail(
                "forces".into(),
                "must have a row a node of the mesh, or none",
            );
        }
        if let Some(node) = (loads.forces.iter()).position(|f| !f.iter().all(|v| v.is_finite())) {
            return fail(format!("forces[{node}]"), "is not finite");
        }
        for (index, pressure) in loads.pressures.iter().enumerate() {
            let field = format!("pressures[{index}]");
            if !pressure.pascal.is_finite() {
                return fail(field, "is not finite");
            }
            if pressure.faces.is_empty() && !pressure.walls {
                return fail(field, "has no faces to press on");
            }
            let known = |face: &u32| (*face as usize) < self.surface.len();
            if !pressure.faces.iter().all(known) {
                return fail(field, "names a face that the surface does not have");
            }
        }
        Ok(())
    }
}

/// Three corners, each as nodes and weights.
type Triangle = [([u32; 4], [f64; 4]); 3];

/// What pressure acts on: triangles by row of the mesh's surface, and those of walls as the row after the last.
fn pressed_faces(
    surface: &[[u32; 3]],
    body: Option<&topology::Body>,
) -> Result<Vec<(usize, Triangle)>, SolverError> {
    let whole = |face: [u32; 3]| face.map(|node| ([node; 4], [1.0, 0.0, 0.0, 0.0]));
    let Some(body) = body else {
        let rows = surface.iter().enumerate();
        return Ok(rows.map(|(row, face)| (row, whole(*face))).collect());
    };
    let sorted = |mut face: [u32; 3]| {
        face.sort_unstable();
        face
    };
    let rows = surface.iter().enumerate();
    let rows: BTreeMap<_, _> = rows.map(|(row, face)| (sorted(*face), row)).collect();
    let row_of = |(element, face): (u32, u8)| {
        let tet = body.mesh().tet(element);
        rows.get(&sorted(FACES[usize::from(face)].map(|corner| tet[corner])))
    };
    let mut found = Vec::new();
    for own in body.mesh().border(|_| true)? {
        if let Some(row) = row_of(own).filter(|_| !body.is_touched(own.0)) {
            found.push((*row, whole(surface[*row])));
        }
    }
    let skin = body.skin()?;
    for triangle in &skin.triangles {
        let row = match triangle.border {
            Some(own) => row_of(own).copied(),
            None => Some(surface.len()),
        };
        let corners = triangle.corners.map(|corner| {
            let vertex = skin.vertices[corner as usize];
            (vertex.nodes, vertex.weights)
        });
        found.extend(row.map(|row| (row, corners)));
    }
    Ok(found)
}
