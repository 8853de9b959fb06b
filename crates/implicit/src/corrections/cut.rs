//! Corrections of a body that has been cut: its own elements, masses and diagonal, and the intact body's modes.
//!
//! ```text
//! Phi_c = G Phi        Phi_c^T K_c Phi_c = Phi^T K Phi + sum over changed elements of Phi_e^T (dK_e) Phi_e
//! ```
//!
//! with the gather `G` of copies from their parents: a cut alone changes no product of the modes, since its shares sum to 1. The nodes of what has changed
//! are near in every step, so the exact factor of the tangent has the copies in its core.
//!
//! Every table is the intact body's with what the changed elements make of it, so that it follows from the body alone and not from the way to it.

use std::sync::{Arc, OnceLock};

use ::elements::{CutTetrahedra, Material, Tetrahedron};
use topology::{Body as CutBody, Changes};

use super::input::SolverContext;
use super::local::{LocalSolver, add_centres};
use super::solver::ImplicitSolver;
use super::time_step::{Diagonal, TimeStep, inverse};
use super::{Body, Corrections};
use crate::bundle::Mesh;
use crate::error::Result;
use crate::memory;
use crate::prior::{Lost, LostElements, PriorTable};

/// A factor of volume or stiffness that has changed by less has not: the shares of an element that
/// was parted and lost nothing sum to one but for rounding.
const SAME: f64 = 1e-9;
const WHAT: &str = "the corrections of a cut body";

impl Corrections {
    /// The tables of a mesh that `intact` was cut to, with the linear response of either.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn cut(
        &self,
        (intact, cut): (&Mesh, &Mesh),
        (body, changes): (&CutBody, &Changes),
        material: &Material,
        (before, prior): (&PriorTable, &PriorTable),
    ) -> Result<Corrections> {
        let lost = self.lost_elements((intact, body), material, before)?;
        let space = (self.space).cut((before, prior), |node| body.parent(node), &lost)?;
        let touched = touched(body, changes)?;
        let diagonal = self.cut_diagonal((intact, body, changes), material, &touched)?;
        let own = self.cut_body((intact, cut), changes, material, &diagonal)?;
        let mut changed = Vec::new();
        for element in &changes.new {
            add_centres(&cut.positions, &element.nodes, &mut changed)?;
        }
        changed.sort_unstable();
        let gone = changes.gone.iter();
        let gone = gone.map(|element| (*element, body.mesh().tet(*element)));
        let gone = memory::collected(changes.gone.len(), gone, WHAT)?;
        let new = (changes.new.iter()).map(|element| (element.parent, element.nodes));
        let new = memory::collected(changes.new.len(), new, WHAT)?;
        let far = self.far.cut((&own, cut), (&gone, &new), &lost)?;
        Ok(Corrections {
            far,
            space,
            body: own,
            time_step: Arc::new(self.time_step.cut(&diagonal, &touched)?),
            changed,
            groups: super::group::groups(cut)?,
            gravity: OnceLock::new(),
            diagonal: OnceLock::from(diagonal),
            whole: OnceLock::new(),
        })
    }

    /// What the elements of a mesh have lost to the cuts of a body, with the modes there.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub(super) fn lost_elements(
        &self,
        (mesh, body): (&Mesh, &CutBody),
        material: &Material,
        prior: &PriorTable,
    ) -> Result<LostElements> {
        let mut list = Vec::new();
        for element in body.changed_elements() {
            if let Some(own) = self.lost(mesh, body, material, element) {
                memory::push(&mut list, own, "what a cut body has lost")?;
            }
        }
        self.space.lost(list, prior)
    }

    /// What a mesh element has lost; `None` where its cells are still the whole of it.
    fn lost(&self, mesh: &Mesh, body: &CutBody, material: &Material, element: u32) -> Option<Lost> {
        let cells = body.elements_of(element);
        let share: f64 = cells.iter().map(|cell| cell.share).sum();
        let stiff: f64 = cells
            .iter()
            .map(|cell| cell.share * f64::from(cell.stiffness))
            .sum();
        // A cut that only parts an element changes no product of the modes: both pieces move as one
        // there.
        if (1.0 - share).abs() < SAME && (1.0 - stiff).abs() < SAME {
            return None;
        }
        let corners = body.mesh().tet(element);
        let rest = corners.map(|node| mesh.position(node).map(f64::from));
        let own = mesh.laws.stiffness_at(element);
        let whole = Tetrahedron::new(corners, rest, 1.0);
        let mut lost = Tetrahedron::new(corners, rest, f64::from(own));
        let laws = mesh.laws.view();
        // kg/m³ in g/mm³.
        let density = 1e-6 * laws.density_of(element as usize, material.density_kg_m3);
        let moduli = material.moduli();
        lost.volume *= 1.0 - stiff;
        Some(Lost {
            element,
            corners,
            is_free: corners.map(|node| !self.body.held.is[node as usize]),
            volume: lost.volume,
            gradients: lost.gradients,
            stiffness: lost.steady_stiffness(&lost.deformation([[0.0; 3]; 4]), moduli),
            mass: 0.25 * whole.volume * (1.0 - share) * density,
        })
    }

    /// Makes what the first cut of this intact body takes longest for.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn prepare_cut(&self, mesh: &Mesh, material: &Material) -> Result<()> {
        self.whole_diagonal(mesh, material).map(|_| ())
    }

    fn whole_diagonal(&self, mesh: &Mesh, material: &Material) -> Result<&Diagonal> {
        if let Some(whole) = self.diagonal.get() {
            return Ok(whole);
        }
        let made = Diagonal::of(mesh, material)?;
        Ok(self.diagonal.get_or_init(|| made))
    }

    /// Masses and diagonal blocks: the intact body's, summed anew at the touched nodes.
    fn cut_diagonal(
        &self,
        (intact, body, changes): (&Mesh, &CutBody, &Changes),
        material: &Material,
        touched: &[u32],
    ) -> Result<Diagonal> {
        let whole = self.whole_diagonal(intact, material)?;
        let count = body.node_count();
        let mut own = Diagonal {
            mass: memory::room(count, WHAT)?,
            blocks: memory::room(count, WHAT)?,
        };
        own.mass.extend_from_slice(&whole.mass);
        own.mass.resize(count, 0.0);
        own.blocks.extend_from_slice(&whole.blocks);
        own.blocks.resize(count, [0.0; 6]);
        let first = intact.node_count() as u32;
        // Elements of the intact mesh with a touched node, each once.
        let mut around = Vec::new();
        for &node in touched {
            // Sums are made anew and in one order, not corrected: the result depends on the body
            // alone.
            own.mass[node as usize] = 0.0;
            own.blocks[node as usize] = [0.0; 6];
            if node < first {
                let elements = body.mesh().around(node);
                memory::reserve(&mut around, elements.len(), WHAT)?;
                around.extend_from_slice(elements);
            }
        }
        around.sort_unstable();
        around.dedup();
        let moduli = material.moduli();
        let laws = intact.laws.view();
        let mut add = |corners: [u32; 4], parent: u32, (stiffness, share): (f32, f64)| {
            let rest = (body.mesh().tet(parent)).map(|node| intact.position(node).map(f64::from));
            let tet = Tetrahedron::new(corners, rest, f64::from(stiffness));
            let volume = tet.volume / f64::from(stiffness) * share;
            let density = 1e-6 * laws.density_of(parent as usize, material.density_kg_m3);
            let mass = 0.25 * volume * density;
            for (node, block) in corners.into_iter().zip(tet.diagonal_blocks(moduli)) {
                // Only some corners of an element are touched; the others keep the sums that they
                // have.
                if touched.binary_search(&node).is_err() {
                    continue;
                }
                own.mass[node as usize] += mass;
                let sums = own.blocks[node as usize].iter_mut();
                sums.zip(block).for_each(|(sum, value)| *sum += value);
            }
        };
        for element in around {
            if changes.gone.binary_search(&element).is_err() {
                let stiffness = intact.laws.stiffness_at(element);
                add(body.mesh().tet(element), element, (stiffness, 1.0));
            }
        }
        for element in &changes.new {
            let stiffness = intact.laws.stiffness_of(element);
            add(element.nodes, element.parent, (stiffness, element.share));
        }
        Ok(own)
    }

    /// The elements: those of the intact body without the changed ones, and the cells behind them.
    fn cut_body(
        &self,
        (intact, cut): (&Mesh, &Mesh),
        changes: &Changes,
        material: &Material,
        diagonal: &Diagonal,
    ) -> Result<Body> {
        let mut cells = memory::room(changes.new.len(), WHAT)?;
        for element in &changes.new {
            let place = changes.gone.partition_point(|gone| *gone < element.parent);
            cells.push((
                place as u32,
                element.nodes,
                intact.laws.stiffness_of(element),
            ));
        }
        let elements = CutTetrahedra {
            positions: cut.positions.as_chunks().0,
            tets: intact.tets.as_chunks().0,
            stiffness: &intact.laws.stiffness,
            fibre: &intact.laws.fibre,
            changed: &changes.gone,
            cells: &cells,
        };
        let forces = memory::tried(self.body.forces.cut(elements, material), WHAT)?;
        Body::of(cut, diagonal, forces)
    }
}

impl TimeStep {
    /// Those of a body that has been cut, with its diagonal.
    fn cut(&self, diagonal: &Diagonal, touched: &[u32]) -> Result<TimeStep> {
        let count = diagonal.mass.len();
        let mut inverse_blocks = memory::room(count, WHAT)?;
        inverse_blocks.extend_from_slice(&self.inverse_blocks);
        inverse_blocks.resize(count, [0.0; 6]);
        let kappa = self.integrator.kappa();
        for &node in touched {
            let at = node as usize;
            inverse_blocks[at] = inverse(diagonal.blocks[at], kappa * diagonal.mass[at]);
        }
        Ok(TimeStep {
            integrator: self.integrator,
            inverse_blocks,
        })
    }
}

/// Nodes of what has changed, as it was and as it is, and all copies; ascending.
fn touched(body: &CutBody, changes: &Changes) -> Result<Vec<u32>> {
    let copies = body.mesh().node_count() as u32..body.node_count() as u32;
    let most = 4 * (changes.gone.len() + changes.new.len()) + copies.len();
    let before = (changes.gone.iter()).flat_map(|element| body.mesh().tet(*element));
    let after = changes.new.iter().flat_map(|element| element.nodes);
    let mut touched = memory::collected(most, before.chain(after).chain(copies), WHAT)?;
    touched.sort_unstable();
    touched.dedup();
    Ok(touched)
}

/// The solver of a cut body takes over what was made of the near set before the cut, as far as it holds for both. Nodes keep their numbers, copies have new
/// ones.
///
/// # Errors
/// [`crate::Error::OutOfMemory`].
pub fn follow_set(
    context: SolverContext<'_>,
    before: &ImplicitSolver,
    own: &mut ImplicitSolver,
) -> Result<()> {
    match &before.local {
        Some(before) => {
            let local = LocalSolver::made(&mut own.local, context)?;
            local.set.follow(&before.set)
        }
        None => Ok(()),
    }
}
