//! Corrections: a few quasi-Newton iterations on the real elements after each prediction (`docs/reference/corrections.md`).
//!
//! While there is contact, the predicted field is moved towards the equation of motion of the reference solver, discretised in time
//! by BDF2: `r(u) = f_int(u) + M (a + alpha v) = 0` on the free nodes, with the contact nodes where the instruments hold them.
//! `k` iterations of L-BFGS around a two-level preconditioner take it there; accuracy becomes a number that the host chooses.
//!
//! [`Corrections`] is what a model shares between scenes, made when the first scene asks for it; [`ImplicitSolver`] is a scene's own.
//! Displacements mm, forces µN, masses g, times s.

mod balance;
mod body;
mod boundary;
mod cut;
mod cut_groups;
mod cut_loads;
mod estimate;
mod extent;
mod far;
mod fields;
mod free;
mod gravity;
mod gravity_columns;
mod group;
mod history;
mod input;
mod integrate;
mod lift;
mod line_search;
mod load;
mod loading;
mod local;
mod memory;
mod motion;
mod oscillators;
mod passes;
mod precondition;
mod prescribed;
mod relax;
mod relaxing;
mod remember;
mod solver;
mod substepper;
mod substeps;
mod time_step;
mod tool_contact;
mod whole;

use std::sync::{Arc, OnceLock};

use elements::Material;

use crate::bundle::{BundleFiles, CorrectionsEntry, Manifest, Mesh};
use crate::error::{Error, Result};
use crate::kernels::Isa;
use crate::prior::{CoarseSpace, PriorTable};
use gravity::GravityResponse;
use time_step::Diagonal;
use whole::WholeModes;

pub use body::Body;
pub use boundary::Held;
pub use cut::follow_set;
pub use far::FarField;
pub use group::Group;
pub use history::{History, PAIRS};
pub use input::{Enough, Input, Report, SolverContext};
pub use lift::let_go;
pub use load::{Load, LoadPoint};
pub use local::Course;
pub use motion::Motion;
pub use solver::{ImplicitSolver, SMALLEST_DET};
pub use substepper::Substepper;
pub use substeps::Substeps;
pub use time_step::{Integrator, TimeStep};

/// The tables and elements of a bundle's corrections.
pub struct Corrections {
    /// The modes and their products: the coarse level of the preconditioner.
    pub space: CoarseSpace,
    /// Elements and masses, in the packing that the kernels read.
    pub body: Body,
    /// The elements that tools do not touch.
    pub far: FarField,
    /// Steps as long as the bundle's.
    pub time_step: Arc<TimeStep>,
    /// Of a body that has been cut: nodes of what has changed, a few millimetres apart, ascending. They are near in every step.
    pub changed: Vec<u32>,
    /// The bundle's support groups.
    pub groups: Vec<group::Group>,
    /// Made at the first step in which gravity turns.
    gravity: OnceLock<GravityResponse>,
    /// Of the intact body from its first cut on, and of every cut one.
    diagonal: OnceLock<Diagonal>,
    /// Read at the first step that has a load; none where the bundle has no such file.
    whole: OnceLock<Option<WholeModes>>,
}

impl Corrections {
    /// Reads `corrections.safetensors` and prepares the elements.
    ///
    /// # Errors
    /// [`Error::Unsupported`] where the bundle has no linear response or no coarse space; [`Error::Bundle`] for a damaged file.
    pub fn open(
        files: &BundleFiles,
        mesh: &Mesh,
        prior: Option<&PriorTable>,
        isa: Isa,
    ) -> Result<Corrections> {
        let manifest = &files.manifest;
        let (entry, prior) = needed(manifest, prior)?;
        let material = &manifest.step_material();
        let integrator = Integrator {
            step_s: manifest.dt_s,
            damping_per_s: material.damping_per_s,
        };
        let diagonal = Diagonal::of(mesh, material)?;
        let space = CoarseSpace::parse(&files.tensors(&entry.file)?, prior, isa)?;
        let body = Body::new(mesh, material, &diagonal, isa)?;
        Ok(Corrections {
            far: FarField::new(&body, mesh, material.moduli(), prior, &space)?,
            space,
            body,
            time_step: Arc::new(TimeStep::new(&diagonal, integrator)?),
            changed: Vec::new(),
            groups: group::groups(mesh)?,
            gravity: OnceLock::new(),
            diagonal: OnceLock::new(),
            whole: OnceLock::new(),
        })
    }

    /// Reads what steps under a load need beside the modes, once.
    ///
    /// # Errors
    /// [`Error::Bundle`] and [`Error::Io`] for the file, [`Error::OutOfMemory`].
    pub fn prepare_loads(&self, files: &BundleFiles) -> Result<()> {
        // Two scenes may read the file at once: the first one's tables stand, and the other's are
        // dropped.
        if self.whole.get().is_some() {
            return Ok(());
        }
        let entry = files.manifest.corrections.as_ref();
        let modes = match entry.and_then(|entry| entry.whole.as_ref()) {
            Some(name) => {
                let nodes = self.body.mass.len();
                Some(WholeModes::parse(
                    &files.tensors(name)?,
                    nodes,
                    &self.space,
                )?)
            }
            None => None,
        };
        self.whole.get_or_init(|| modes);
        Ok(())
    }

    /// Whether the bundle has whole modes, and they have been read.
    pub fn has_whole_modes(&self) -> bool {
        self.whole.get().is_some_and(Option::is_some)
    }

    /// Steps of another length or damping.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn time_step(
        &self,
        mesh: &Mesh,
        material: &Material,
        integrator: Integrator,
    ) -> Result<TimeStep> {
        match self.diagonal.get() {
            Some(diagonal) => TimeStep::new(diagonal, integrator),
            None => TimeStep::new(&Diagonal::of(mesh, material)?, integrator),
        }
    }
}

/// The tables that corrections cannot do without; the error names the command that makes them.
fn needed<'a>(
    manifest: &'a Manifest,
    prior: Option<&'a PriorTable>,
) -> Result<(&'a CorrectionsEntry, &'a PriorTable)> {
    let lacks = |what: &str| {
        Error::Unsupported(format!(
            "corrections: the bundle has no {what}; run `upt corrections BUNDLE` on a bundle with a linear response"
        ))
    };
    let prior = prior.ok_or_else(|| lacks("linear response (`prior` in bundle.json)"))?;
    let entry = manifest.corrections.as_ref();
    Ok((
        entry.ok_or_else(|| lacks("coarse space (`corrections` in bundle.json)"))?,
        prior,
    ))
}
