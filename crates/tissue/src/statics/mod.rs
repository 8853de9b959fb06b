//! Static equilibria of the nonlinear solid under prescribed contact displacements.
//!
//! What a learned correction lacks is contact sites, and a site costs the explicit solver tens of seconds of motion whose
//! end is known: under a held contact the body comes to rest where its strain energy is smallest. Here that state is
//! found directly, by minimisation of the reference's energy in f64 (see `energy` and `path`): the stiffness at rest is
//! factorised once, several sites go through each solve together, and a site is followed from depth to depth.
//!
//! The result has no damping, no inertia and no history. It equals the end of a long hold where the equilibrium is unique,
//! as it is for pushes of the size of instruments.

pub(crate) mod energy;
mod path;
mod quasi_newton;
mod relax;
mod unload;

use std::path::Path as FilePath;

use crate::contact::{ContactDomain, ContactError};
use crate::linear::{
    ColumnsError, ColumnsFile, ContactFactor, Factor, Lame, LinearError, Stiffness,
};
use crate::material::{Material, MaterialError};
use crate::mesh::{Boundary, Mesh};
use crate::schemes::{Programme, Scheme};
use crate::simulate::SOLVER_NAME;
use crate::solver::ContactNode;
use crate::trajectory::{Trajectory, TrajectoryHeader};
use energy::StrainEnergy;
use path::{Equilibrium, Path};
pub use relax::relax;
pub use unload::unload;

/// Root mean square over the nodes of the last step to an equilibrium, mm.
pub const TOLERANCE_MM: f64 = 5e-4;

/// Equilibria that cannot be computed.
#[derive(Debug, thiserror::Error)]
pub enum StaticsError {
    #[error(transparent)]
    Contact(#[from] ContactError),
    #[error(transparent)]
    Linear(#[from] LinearError),
    #[error(transparent)]
    Material(#[from] MaterialError),
    #[error(transparent)]
    Columns(#[from] ColumnsError),
    /// The mesh has another domain than the one that the columns were made for.
    #[error(
        "contact node {node} has no compliance column: write them with `upt prior` for this mesh's domain"
    )]
    NoColumn { node: u32 },
    /// None of a case's displacements was reached.
    #[error("no equilibrium: {0}")]
    None(String),
}

/// A body ready for any contact in its domain. Threads may share it.
pub struct StaticSolver {
    body: StrainEnergy,
    stiffness: Stiffness,
    factor: Factor,
    columns: ColumnsFile,
    domain: ContactDomain,
    header: TrajectoryHeader,
    tolerance_mm: f64,
}

/// What was found at one site.
struct Outcome {
    nodes: Vec<u32>,
    vectors: Vec<Vec<f64>>,
    found: Vec<Equilibrium>,
    failure: Option<(usize, String)>,
}

impl StaticSolver {
    /// Factorises the mesh's stiffness at rest; `columns` is the file of `upt prior` for the same mesh, boundary condition
    /// and material.
    ///
    /// # Errors
    /// See [`StaticsError`]; a file of another mesh is refused.
    pub fn new(
        mesh: &Mesh,
        boundary: Boundary,
        material: Material,
        columns: &FilePath,
    ) -> Result<Self, StaticsError> {
        let domain = ContactDomain::new(mesh, boundary)?;
        let columns =
            ColumnsFile::open(columns, mesh, boundary, material.young_pa, material.poisson)?;
        let lame = Lame::from_young(material.young_pa, material.poisson)?;
        let stiffness = Stiffness::assemble(mesh, &mesh.held_nodes(boundary), lame)?;
        let factor = Factor::new(&stiffness, &mesh.positions, 1)?;
        Ok(Self {
            body: StrainEnergy::new(mesh, &material),
            stiffness,
            factor,
            columns,
            domain,
            header: TrajectoryHeader {
                mesh_name: mesh.name.clone(),
                mesh_sha256: mesh.hash(),
                boundary: boundary.as_str().into(),
                scheme: String::new(),
                seed: 0,
                site: [0.0; 3],
                material,
                dt_s: 0.0,
                inner_dt_s: 0.0,
                mass_scaling_s: 0.0,
                solver: SOLVER_NAME.into(),
            },
            tolerance_mm: TOLERANCE_MM,
        })
    }

    /// The equilibria of a case of a static scheme as a trajectory: rest, then each equilibrium that was found, and what
    /// was not found and why. `progress` hears how many frames are found or given up.
    ///
    /// The same inputs give the same bytes on one machine and instruction set.
    ///
    /// # Errors
    /// [`StaticsError::None`] where not one displacement was reached; a file that cannot be read.
    ///
    /// # Panics
    /// If the scheme is not static.
    pub fn trajectory(
        &self,
        scheme: Scheme,
        seed: u64,
        progress: impl FnMut(usize),
    ) -> Result<(Trajectory, Vec<String>), StaticsError> {
        assert!(scheme.is_static(), "scheme {} moves", scheme.name());
        let programme = Programme::new(scheme, &self.domain, seed)?;
        // Frames of a site touch the same nodes.
        let mut sites: Vec<Vec<Vec<ContactNode>>> = Vec::new();
        for frame in 1..scheme.frames() {
            let contact = programme.contact(frame);
            match sites.last_mut() {
                Some(site) if same_nodes(&site[0], &contact) => site.push(contact),
                _ => sites.push(vec![contact]),
            }
        }
        let outcomes = self.equilibria(&sites, progress)?;
        let mut skipped = Vec::new();
        for (site, outcome) in outcomes.iter().enumerate() {
            if let Some((index, cause)) = &outcome.failure {
                let push = length(&outcome.vectors[*index]);
                skipped.push(format!("site {site} from {push:.1} mm on: {cause}"));
            }
        }
        if outcomes.iter().all(|outcome| outcome.found.is_empty()) {
            return Err(StaticsError::None(skipped.join("; ")));
        }
        let header = TrajectoryHeader {
            scheme: scheme.name().into(),
            seed,
            site: programme.site(),
            ..self.header.clone()
        };
        let mut trajectory = Trajectory::at_rest(header, self.stiffness.free.index.len());
        outcomes
            .iter()
            .for_each(|outcome| append(&mut trajectory, outcome));
        Ok((trajectory, skipped))
    }

    /// The displacement at rest under each push, `[3K]` mm; none where no equilibrium was found. All pushes share each solve.
    ///
    /// # Errors
    /// [`StaticsError::NoColumn`]; a file that cannot be read.
    pub fn at_rest(
        &self,
        pushes: &[Vec<ContactNode>],
    ) -> Result<Vec<Option<Vec<f64>>>, StaticsError> {
        let sites: Vec<Vec<Vec<ContactNode>>> =
            pushes.iter().map(|push| vec![push.clone()]).collect();
        let outcomes = self.equilibria(&sites, |_| {})?;
        let fields = outcomes
            .into_iter()
            .map(|mut outcome| Some(outcome.found.pop()?.displacement));
        Ok(fields.collect())
    }

    /// Follows every site through its contacts; all sites share each solve.
    fn equilibria(
        &self,
        sites: &[Vec<Vec<ContactNode>>],
        mut progress: impl FnMut(usize),
    ) -> Result<Vec<Outcome>, StaticsError> {
        let mut paths = Vec::new();
        for site in sites {
            let nodes: Vec<u32> = site[0].iter().map(|entry| entry.node).collect();
            let rows = nodes.iter().map(|node| {
                let row = self.columns.compliance.nodes.binary_search(node);
                row.map_err(|_| StaticsError::NoColumn { node: *node })
            });
            let rows: Vec<usize> = rows.collect::<Result<_, _>>()?;
            let asked = site.iter().map(|contact| flat(contact)).collect();
            paths.push(Path::new(
                &self.body,
                &self.stiffness.free,
                nodes,
                self.columns.columns(&rows)?,
                ContactFactor::new(&self.columns.compliance, &rows)?,
                asked,
                self.tolerance_mm,
            ));
        }
        let dofs = self.stiffness.dofs();
        let mut columns = Vec::new();
        loop {
            let mut active: Vec<&mut Path> =
                paths.iter_mut().filter(|path| !path.is_done()).collect();
            if active.is_empty() {
                break;
            }
            columns.resize(active.len() * dofs, 0.0);
            for (path, column) in active.iter_mut().zip(columns.chunks_exact_mut(dofs)) {
                path.right_side(column);
            }
            self.factor.solve(&mut columns);
            for (path, column) in active.iter_mut().zip(columns.chunks_exact(dofs)) {
                path.advance(column);
            }
            let ends = paths.iter().zip(sites).map(|(path, site)| {
                if path.is_done() {
                    site.len()
                } else {
                    path.found.len()
                }
            });
            progress(ends.sum());
        }
        let outcomes = paths.into_iter().zip(sites).map(|(path, site)| Outcome {
            nodes: site[0].iter().map(|entry| entry.node).collect(),
            vectors: site.iter().map(|contact| flat(contact)).collect(),
            found: path.found,
            failure: path.failure,
        });
        Ok(outcomes.collect())
    }
}

fn append(trajectory: &mut Trajectory, outcome: &Outcome) {
    let single = |values: &[f64]| -> Vec<[f32; 3]> {
        let rows = values.as_chunks::<3>().0.iter();
        rows.map(|row| row.map(|v| v as f32)).collect()
    };
    for equilibrium in &outcome.found {
        trajectory
            .displacement
            .extend(single(&equilibrium.displacement));
        trajectory.contact_nodes.extend(&outcome.nodes);
        let vectors = &outcome.vectors[equilibrium.index];
        trajectory.contact_vectors.extend(single(vectors));
        trajectory.reaction.extend(single(&equilibrium.reaction));
        let count = trajectory.contact_nodes.len() as u32;
        trajectory.contact_offsets.push(count);
        // A conservative body, loaded without motion: the work is the energy.
        let energy = (equilibrium.energy.value * 1e-3) as f32;
        trajectory.strain_energy.push(energy);
        trajectory.kinetic_energy.push(0.0);
        trajectory.external_work.push(energy);
        trajectory.min_det_f.push(equilibrium.energy.min_det as f32);
    }
}

fn same_nodes(a: &[ContactNode], b: &[ContactNode]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.node == b.node)
}

fn flat(contact: &[ContactNode]) -> Vec<f64> {
    let vectors = contact.iter().flat_map(|entry| entry.displacement);
    vectors.map(f64::from).collect()
}

/// Largest displacement of `vectors [3m]`, mm.
fn length(vectors: &[f64]) -> f64 {
    let squares = vectors.as_chunks::<3>().0.iter();
    squares
        .map(|v| elements::vector::length(*v))
        .fold(0.0, f64::max)
}

#[cfg(test)]
mod tests;
