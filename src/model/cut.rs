//! A model of a body that has been cut: what a scene goes on with.
//!
//! It shares files and runtime with the model of the intact body, and has a mesh, a linear response, corrections and touchable samples of its own. The
//! learned part knows the intact body alone and is off.

use std::sync::{Arc, OnceLock};

use topology::{Body, RestMesh};

use super::made::MadeOnce;
use super::{KindModel, Model, ReducedModel};
use crate::error::{Error, Result};
use crate::library::Alive;

impl Model {
    /// The mesh as what can be cut; made when it is first asked for.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub(crate) fn rest_mesh(&self) -> Result<Arc<RestMesh>> {
        if let Some(made) = self.made.rest.get() {
            return Ok(Arc::clone(made));
        }
        let mesh = &self.mesh;
        let made = RestMesh::new(mesh.positions.as_chunks().0, mesh.tets.as_chunks().0)?;
        Ok(Arc::clone(self.made.rest.get_or_init(|| Arc::new(made))))
    }

    /// The model of a body that this one's has been cut to; this is that of the intact body.
    ///
    /// # Errors
    /// [`Error::Unsupported`] where the bundle has no corrections, [`Error::OutOfMemory`].
    pub(crate) fn cut(&self, body: &Body) -> Result<Arc<Model>> {
        let Some(prior) = &self.prior else {
            return Err(Error::Unsupported(
                "cut: the bundle has no linear response (`prior` in bundle.json)".into(),
            ));
        };
        let intact = self.corrections()?;
        let changes = body.changes()?;
        let mesh = self.mesh.cut(body, &changes)?;
        let own = prior.cut(&mesh, body.parents())?;
        let material = &self.manifest.step_material();
        let priors = (&**prior, &own);
        let corrections = intact.cut((&self.mesh, &mesh), (body, &changes), material, priors)?;
        let corrections = crate::memory::boxed(corrections, "the corrections of a cut body")?;
        Ok(Arc::new(Model {
            manifest: self.manifest.clone(),
            hash: self.hash,
            mesh: Arc::new(mesh),
            prior: Some(Arc::new(own)),
            kind: KindModel::Reduced(Arc::new(ReducedModel { learned: None })),
            made: MadeOnce {
                corrections: OnceLock::from(corrections),
                ..MadeOnce::default()
            },
            files: Arc::clone(&self.files),
            execution: self.execution.clone(),
            load_seconds: self.load_seconds,
            _alive: Alive::new(),
        }))
    }

    /// Gives the model of a body that this one's has been cut to what steps under loads need.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub(crate) fn cut_loads(&self, body: &Body, cut: &Model) -> Result<()> {
        let Some(prior) = &self.prior else {
            return Ok(());
        };
        let material = &self.manifest.step_material();
        (self.corrections()?).cut_loads(cut.corrections()?, (&self.mesh, body), material, prior)
    }
}
