//! Ties for a host: the point of the surface nearest to a place, and a bed, many ties over a region made at once.

use ::contact::{End, Spring, Tie, TiePoint, Vector, nearest};

use super::Scene;
use super::published::lock_read;
use crate::contact::{MAX_TIES, TieReading, vector};
use crate::error::{Error, Result};
use crate::memory;

const WHAT: &str = "the ties of a bed";

/// Where a bed is, and what holds there altogether.
#[derive(Debug, Clone, Copy)]
pub struct Bed<'a> {
    /// The nodes of the domain that it ties; empty: those within `radius_mm` of `centre` where they are now.
    pub nodes: &'a [u32],
    /// mm, in the mesh's frame.
    pub centre: [f32; 3],
    pub radius_mm: f32,
    /// Of all of its ties together: stiffness, damping and break force are shared among them by the area of surface around each node.
    pub spring: Spring,
    pub break_mn: f32,
    /// From each node to where it is tied, mm: by default where it is now.
    pub offset: [f32; 3],
}

impl Scene {
    /// The points of the domain, the surface that instruments may touch, nearest to places in the mesh's frame (mm), where the tissue is in the last state.
    ///
    /// # Errors
    /// [`Error::NonFinite`], [`Error::Argument`] for a bundle without a domain, [`Error::Unsupported`] for a cut body.
    pub fn tie_point(&self, place: [f32; 3]) -> Result<TiePoint> {
        let place = Vector::from(place);
        if !place.is_finite() {
            return Err(Error::NonFinite(format!("the place {place}")));
        }
        let shared = lock_read(&self.shared.published);
        if shared.body.cut.is_some() {
            return Err(super::body::refused("ties"));
        }
        let (rest, u) = (&self.mesh.positions, &shared.last.field);
        let position = |node| vector(rest, node) + vector(u, node);
        let faces = self.mesh.domain.faces.as_chunks::<3>().0.iter().copied();
        nearest(faces, position, place)
            .ok_or_else(|| Error::Argument("the bundle has no domain to tie".into()))
    }

    /// The ties of a bed, ascending by node, in the mesh's frame ([`End::Support`]): pass them in every step. It tears node by node.
    ///
    /// # Errors
    /// [`Error::Argument`] for a region without free nodes of the domain, or with more than [`MAX_TIES`]; [`Error::NonFinite`]; [`Error::OutOfMemory`];
    /// [`Error::Unsupported`] for a cut body.
    pub fn bed(&self, bed: &Bed<'_>) -> Result<Vec<Tie>> {
        let (centre, offset) = (Vector::from(bed.centre), Vector::from(bed.offset));
        if !(centre.is_finite() && offset.is_finite() && bed.radius_mm.is_finite()) {
            return Err(Error::NonFinite("bed: centre, radius or offset".into()));
        }
        let mesh = &self.mesh;
        let count = mesh.node_count();
        if let Some(node) = bed.nodes.iter().find(|node| **node as usize >= count) {
            return Err(Error::Argument(format!(
                "bed: node {node} is beyond the mesh's {count} nodes"
            )));
        }
        let shared = lock_read(&self.shared.published);
        if shared.body.cut.is_some() {
            return Err(super::body::refused("a bed"));
        }
        let (rest, u) = (&mesh.positions, &shared.last.field);
        let position = |node| vector(rest, node) + vector(u, node);
        let mut area: Vec<f32> = memory::zeros(count, WHAT)?;
        for face in mesh.domain.faces.as_chunks::<3>().0 {
            let [a, b, c] = face.map(|node| vector(rest, node));
            let third = (b - a).cross(c - a).length() / 6.0;
            face.iter().for_each(|node| area[*node as usize] += third);
        }
        for &node in &mesh.held_nodes {
            area[node as usize] = 0.0;
        }
        let mut is_in = memory::filled(count, false, WHAT)?;
        match bed.nodes.is_empty() {
            false => bed
                .nodes
                .iter()
                .for_each(|node| is_in[*node as usize] = true),
            true => {
                for (node, is_in) in is_in.iter_mut().enumerate() {
                    *is_in = position(node as u32).distance(centre) <= bed.radius_mm;
                }
            }
        }
        let tied =
            || (0..count as u32).filter(|node| is_in[*node as usize] && area[*node as usize] > 0.0);
        let (ties, whole) = tied().fold((0, 0.0), |(ties, sum), node| {
            (ties + 1, sum + area[node as usize])
        });
        if ties == 0 || ties > MAX_TIES {
            return Err(Error::Argument(format!(
                "bed: {ties} free nodes of the domain are in its region, must be 1 to {MAX_TIES}"
            )));
        }
        let tie = |node: u32| {
            let share = area[node as usize] / whole;
            Tie {
                point: TiePoint {
                    nodes: [node; 3],
                    weights: [1.0, 0.0, 0.0],
                },
                end: End::Support(position(node) + offset),
                spring: Spring {
                    stiffness: share * bed.spring.stiffness,
                    damping: share * bed.spring.damping,
                    ..bed.spring
                },
                break_mn: share * bed.break_mn,
            }
        };
        let made = memory::collected(ties, tied().map(tie), WHAT)?;
        match made
            .iter()
            .map(Tie::check)
            .find_map(std::result::Result::err)
        {
            Some(reason) => Err(Error::Argument(format!("bed: {reason}"))),
            None => Ok(made),
        }
    }

    /// What each tie of the last step does, in its order.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn tie_readings(&self) -> Result<Vec<TieReading>> {
        self.with_contact_report(|report| memory::copied(&report.ties, WHAT))
    }
}
