//! The states of a body on the way of its supports, loads and obstacle, by Newton's method.

use super::body::Body;
use super::obstacle::Obstacle;
use super::section::Section;
use crate::band::Band;
use crate::material::Material;
use crate::newton::{self, Balance};

/// What remains of the forces, relative to those of supports, loads and obstacle.
const BALANCE: f64 = 1e-8;
/// The least part of what is asked for that is tried.
const LEAST_PART: f64 = 1e-3;

/// No state was found further on.
#[derive(Debug, thiserror::Error)]
#[error("no equilibrium beyond {reached:.4} of the way")]
pub struct NoEquilibrium {
    pub reached: f64,
}

/// Across or along the axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    Across,
    Along,
}

/// A body of revolution whose supports, loads and obstacle go a way from 0, where it is at rest, to 1.
pub struct Equilibrium {
    section: Section,
    body: Body,
    /// How far an unknown moves in the whole way, mm; none where it is free.
    held: Vec<Option<f64>>,
    /// At the end of the way, µN.
    load: Vec<f64>,
    contact: Option<(Obstacle, Vec<usize>)>,
    way: f64,
    u: Vec<f64>,
    /// Of elements and obstacle less the loads, µN.
    force: Vec<f64>,
    push: f64,
    band: Band,
}

fn unknown(node: usize, axis: Axis) -> usize {
    2 * node + usize::from(axis == Axis::Along)
}

impl Equilibrium {
    /// At rest; only what lies on the axis is held, across it.
    pub fn new(section: Section, material: &Material) -> Self {
        let count = 2 * section.places.len();
        let mut held = vec![None; count];
        for (node, place) in section.places.iter().enumerate() {
            if place[0] == 0.0 {
                held[unknown(node, Axis::Across)] = Some(0.0);
            }
        }
        Self {
            body: Body::new(&section, material.moduli()),
            held,
            load: vec![0.0; count],
            contact: None,
            way: 0.0,
            u: vec![0.0; count],
            force: vec![0.0; count],
            push: 0.0,
            band: Band::new(count, section.width()),
            section,
        }
    }

    pub fn section(&self) -> &Section {
        &self.section
    }

    /// Nodes that move so far along an axis in the whole way, mm.
    pub fn hold(&mut self, nodes: &[usize], axis: Axis, motion: f64) {
        for node in nodes {
            self.held[unknown(*node, axis)] = Some(motion);
        }
    }

    /// A pressure on the top, from the axis to a radius (mm) among the lines of the section, at the end of the way; Pa.
    pub fn press(&mut self, top: &[usize], radius: f64, pressure: f64) {
        for edge in top.windows(2) {
            let [near, far] = [edge[0], edge[1]].map(|node| self.section.place(node)[0]);
            if far > radius * (1.0 + 1e-9) {
                break;
            }
            // `2 pi r` times a shape function, over the edge.
            let ring = std::f64::consts::PI * (far - near) / 3.0 * pressure;
            self.load[unknown(edge[0], Axis::Along)] -= ring * (2.0 * near + far);
            self.load[unknown(edge[1], Axis::Along)] -= ring * (near + 2.0 * far);
        }
    }

    /// An obstacle that a chain of nodes may meet.
    pub fn meet(&mut self, obstacle: Obstacle, chain: Vec<usize>) {
        self.contact = Some((obstacle, chain));
    }

    /// Displacement of a node, mm.
    pub fn displacement(&self, node: usize, axis: Axis) -> f64 {
        self.u[unknown(node, axis)]
    }

    /// What holds the nodes along an axis, mN.
    pub fn reaction(&self, nodes: &[usize], axis: Axis) -> f64 {
        let forces = nodes.iter().map(|node| self.force[unknown(*node, axis)]);
        1e-3 * forces.sum::<f64>()
    }

    /// What pushes the obstacle up, mN.
    pub fn push(&self) -> f64 {
        1e-3 * self.push
    }

    /// On to a part of the way.
    ///
    /// # Errors
    /// [`NoEquilibrium`]; the state is then the last one that was found.
    pub fn advance(&mut self, to: f64) -> Result<(), NoEquilibrium> {
        let whole = to - self.way;
        let mut part = whole;
        while (to - self.way).abs() > 1e-12 {
            let next = match part.abs() < (to - self.way).abs() {
                true => self.way + part,
                false => to,
            };
            let (from, u) = (self.way, self.u.clone());
            if let Some(u) = newton::settle(self, u, from, next) {
                (self.u, part) = (u, 2.0 * (next - self.way));
                self.way = next;
                continue;
            }
            part = 0.5 * (next - self.way);
            if part.abs() < LEAST_PART * whole.abs() {
                let u = std::mem::take(&mut self.u);
                self.evaluate(self.way, &u, false);
                self.u = u;
                return Err(NoEquilibrium { reached: self.way });
            }
        }
        Ok(())
    }
}

impl Balance for Equilibrium {
    const MOST_STEPS: usize = 60;

    /// Forces, and if that is asked for the tangent, of a state at a part of the way; false where it is none.
    fn evaluate(&mut self, way: f64, u: &[f64], with_tangent: bool) -> bool {
        for (force, load) in self.force.iter_mut().zip(&self.load) {
            *force = -way * load;
        }
        self.band.clear();
        let mut band = with_tangent.then_some(&mut self.band);
        if !self.body.add(u, &mut self.force, band.as_deref_mut()) {
            return false;
        }
        self.push = 0.0;
        if let Some((obstacle, chain)) = &self.contact {
            for edge in chain.windows(2) {
                let nodes = [edge[0], edge[1]];
                let rest = nodes.map(|node| self.section.place(node));
                let band = band.as_deref_mut();
                self.push += obstacle.meet(way, nodes, rest, u, &mut self.force, band);
            }
        }
        true
    }

    /// What is left of the forces at free unknowns is small beside those that act.
    fn is_balanced(&self, way: f64) -> bool {
        let (mut left, mut acting) = (0.0, self.push * self.push);
        for ((force, held), load) in self.force.iter().zip(&self.held).zip(&self.load) {
            match held {
                None => left += force * force,
                Some(_) => acting += force * force,
            }
            acting += way * way * load * load;
        }
        left <= BALANCE * BALANCE * acting
    }

    fn forces(&self) -> &[f64] {
        &self.force
    }

    fn held(&self) -> &[Option<f64>] {
        &self.held
    }

    fn band(&mut self) -> &mut Band {
        &mut self.band
    }
}
