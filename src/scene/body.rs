//! The body of a scene: its model and mesh, what holds it, how its steps are counted, and what cuts have made of it.

use std::sync::Arc;

use topology::{Body, Point};

use super::StepInput;
use super::cut_state::CutState;
use super::published::Frame;
use super::published::SCENE;
use crate::bundle::Mesh;
use crate::corrections::{Integrator, SolverContext};
use crate::error::{Error, Result};
use crate::kernels::Machine;
use crate::memory::{self, HeldBytes};
use crate::model::Model;

/// A cut body has at most as many copies as the mesh has nodes.
pub const MOST_COPIES: usize = 1;

/// See the module. A step changes nothing of it; an operation that does puts another one in its place.
#[derive(HeldBytes)]
pub struct SceneBody {
    /// That of the cut body, where it has been cut.
    #[held(skip)]
    pub model: Arc<Model>,
    #[held(skip)]
    pub mesh: Arc<Mesh>,
    /// By node: the boundary condition holds it, so its displacement is zero whatever the contact says.
    pub held: Vec<bool>,
    /// The length of a step and the damping: the bundle's, or the scene's own.
    #[held(skip)]
    pub integrator: Integrator,
    /// What cuts have made of the body; none while it is intact.
    pub cut: Option<Box<CutState>>,
}

impl SceneBody {
    /// An intact body.
    pub fn new(
        model: Arc<Model>,
        mesh: Arc<Mesh>,
        of_scene: Option<Integrator>,
    ) -> Result<SceneBody> {
        let mut held = memory::filled(mesh.node_count(), false, SCENE)?;
        for &node in &mesh.held_nodes {
            held[node as usize] = true;
        }
        let of_bundle = Integrator {
            step_s: model.manifest.dt_s,
            damping_per_s: model.manifest.material.damping_per_s,
        };
        Ok(SceneBody {
            held,
            integrator: of_scene.unwrap_or(of_bundle),
            model,
            mesh,
            cut: None,
        })
    }

    /// The length of a step, s.
    pub fn step_s(&self) -> f64 {
        self.integrator.step_s
    }

    /// What solves on the intact body, where this one has been cut: at the bundle's own step, and as the bundle holds it.
    pub fn intact_context<'a>(
        &'a self,
        machine: &'a Machine,
    ) -> Result<Option<(&'a CutState, SolverContext<'a>)>> {
        let Some(cut) = &self.cut else {
            return Ok(None);
        };
        let Some(context) = at_rest(&cut.intact, machine)? else {
            return Ok(None);
        };
        Ok(Some((cut, context)))
    }

    /// The mesh before any cut.
    pub fn intact_mesh(&self) -> &Arc<Mesh> {
        self.cut.as_ref().map_or(&self.mesh, |cut| &cut.intact.mesh)
    }

    /// The model that the scene was made with.
    pub fn intact(&self) -> &Arc<Model> {
        self.cut.as_ref().map_or(&self.model, |cut| &cut.intact)
    }

    /// What a scene of a cut body does not do.
    ///
    /// # Errors
    /// [`Error::Unsupported`].
    pub fn check_intact(&self, what: &str) -> Result<()> {
        match &self.cut {
            None => Ok(()),
            Some(_) => Err(refused(what)),
        }
    }

    /// Whether a cut body can make such a step.
    pub fn check_cut(&self, input: &StepInput<'_>) -> Result<()> {
        match input.displacement {
            Some(_) => self.check_intact("a step from a displacement"),
            None => Ok(()),
        }
    }

    /// Whether cuts and resections have left nothing around a node of the intact mesh.
    pub fn is_gone(&self, node: u32) -> bool {
        let Some(corrected) = self.cut.as_ref().and(self.model.corrections().ok()) else {
            return false;
        };
        corrected.body.mass.get(node as usize) == Some(&0.0)
    }

    /// The intact mesh, as what can be cut.
    pub fn whole_body(&self) -> Result<Body> {
        Ok(with_most_copies(Body::new(self.intact().rest_mesh()?)))
    }

    /// Where each node is in a state, mm.
    pub fn positions(&self, frame: &Frame) -> Result<Vec<Point>> {
        let rest = self.mesh.positions.as_chunks::<3>().0;
        let moved = frame.field.as_chunks::<3>().0;
        let place = |(rest, u): (&[f32; 3], &[f32; 3])| -> Point {
            [0, 1, 2].map(|k| f64::from(rest[k]) + f64::from(u[k]))
        };
        memory::collected(rest.len(), rest.iter().zip(moved).map(place), SCENE)
    }

    /// Bytes that making the surface of the body takes, at most.
    pub fn most_surface_bytes(&self) -> usize {
        let mesh = 64 * self.mesh.tets.len() + 320 * self.mesh.node_count();
        mesh + self.cut.as_ref().map_or(0, |cut| 8 * cut.body.heap_bytes())
    }
}

/// What solves on a body of this model at the bundle's own step, as the bundle holds it.
pub fn at_rest<'a>(model: &'a Model, machine: &'a Machine) -> Result<Option<SolverContext<'a>>> {
    let Some(prior) = &model.prior else {
        return Ok(None);
    };
    let corrections = model.corrections()?;
    Ok(Some(SolverContext {
        isa: machine.isa,
        pool: &machine.pool,
        prior,
        corrections,
        time_step: &corrections.time_step,
        held: &corrections.body.held,
    }))
}

/// A body that cuts may double.
pub fn with_most_copies(body: Body) -> Body {
    let room = MOST_COPIES * body.mesh().node_count();
    body.with_room(room)
}

/// What a cut scene says to a call that it does not make.
pub fn refused(what: &str) -> Error {
    Error::Unsupported(format!(
        "{what}: the body of this scene has been cut; reset it, or restore a snapshot from before"
    ))
}
