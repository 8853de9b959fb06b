//! Corrections of a body that has been cut: its own elements, masses and diagonal, and the intact body's modes.
//!
//! ```text
//! Phi_c = G Phi        Phi_c^T K_c Phi_c = Phi^T K Phi + sum over changed elements of Phi_e^T (dK_e) Phi_e
//! ```
//!
//! with the gather `G` of copies from their parents: a cut alone changes no product of the modes, since its shares sum to 1. The nodes of what has changed
//! are near in every step, so the exact factor of the tangent has the copies in its core.

use std::sync::{Arc, OnceLock};

use ::elements::{Material, Tetrahedron};
use topology::Body as CutBody;

use super::local::add_centres;
use super::time_step::{Diagonal, TimeStep};
use super::{Body, Corrections, FarField};
use crate::bundle::Mesh;
use crate::error::Result;
use crate::kernels::Isa;
use crate::memory;
use crate::prior::{Lost, PriorTable};

/// A factor of volume or stiffness that has changed by less has not.
const SAME: f64 = 1e-9;

impl Corrections {
    /// The tables of a mesh that `intact` was cut to, with the linear response of either.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn cut(
        &self,
        (intact, cut): (&Mesh, &Mesh),
        body: &CutBody,
        material: &Material,
        (before, prior): (&PriorTable, &PriorTable),
    ) -> Result<Corrections> {
        let mut lost = Vec::new();
        for element in body.changed_elements() {
            if let Some(own) = self.lost(intact, body, material, element) {
                memory::push(&mut lost, own, "what a cut body has lost")?;
            }
        }
        let space = (self.space).cut((before, prior), |node| body.parent(node), lost.iter())?;
        let diagonal = Diagonal::of(cut, material)?;
        let own = Body::new(cut, material, &diagonal, Isa::detect())?;
        let mut changed = Vec::new();
        for element in body.changed_elements() {
            for element in body.elements_of(element) {
                add_centres(&cut.positions, &element.nodes, &mut changed)?;
            }
        }
        changed.sort_unstable();
        let integrator = self.time_step.integrator;
        Ok(Corrections {
            far: FarField::new(&own, cut, material.moduli(), prior, &space)?,
            space,
            body: own,
            time_step: Arc::new(TimeStep::new(&diagonal, integrator)?),
            changed,
            gravity: OnceLock::new(),
        })
    }

    /// What a mesh element has lost; `None` where its cells are still the whole of it.
    fn lost(&self, mesh: &Mesh, body: &CutBody, material: &Material, element: u32) -> Option<Lost> {
        let cells = body.elements_of(element);
        let share: f64 = cells.iter().map(|cell| cell.share).sum();
        let stiff: f64 = cells
            .iter()
            .map(|cell| cell.share * f64::from(cell.stiffness))
            .sum();
        if (1.0 - share).abs() < SAME && (1.0 - stiff).abs() < SAME {
            return None;
        }
        let corners = body.mesh().tet(element);
        let rest = corners.map(|node| mesh.position(node).map(f64::from));
        let own = mesh.stiffness.get(element as usize).copied().unwrap_or(1.0);
        let whole = Tetrahedron::new(corners, rest, 1.0);
        let mut lost = Tetrahedron::new(corners, rest, f64::from(own));
        let moduli = material.moduli();
        lost.volume *= 1.0 - stiff;
        Some(Lost {
            corners,
            is_free: corners.map(|node| !self.body.held[node as usize]),
            stiffness: lost.steady_stiffness(&lost.deformation([[0.0; 3]; 4]), moduli),
            mass: 0.25 * whole.volume * (1.0 - share) * material.density_g_mm3(),
        })
    }
}
