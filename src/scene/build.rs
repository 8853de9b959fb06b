//! What a scene of a model is made of.
//!
//! A scene is put together from the outside in: threads and instruction set, the mesh (the bundle's
//! or the host's own), the engine that predicts, the corrector that makes the elements' equation of
//! motion hold, and around them the step's states. Each part is checked where it is made, so that
//! what comes out can step. Large parts are boxed with room that was asked for, since `Box::new`
//! ends the process where memory runs out.

use std::sync::Arc;

use super::body::SceneBody;
use super::core::Core;
use super::corrected::Corrector;
use super::engine::Engine;
use super::maker::{Parts, StepMaker};
use super::published::SCENE;
use super::{reduced, upt};
use crate::bundle::{Mesh, TensorFile};
use crate::envelope::EnvelopeCheck;
use crate::error::{Error, Result};
use crate::features::Proven;
use crate::kernels::{FlushToZero, Pool};
use crate::memory;
use crate::model::{KindModel, Model};
use crate::options::{SceneOptions, StepPath};

/// The core of a new scene, at rest.
///
/// `envelope`: that of a cut body, which need not be made anew.
/// Called when a scene is made, and again when its body is cut or made whole: `model` is then that of the cut body, or the
/// intact one. Nothing of a scene that is there changes, so that an error leaves it as it was.
///
/// # Errors
/// [`Error::Argument`] for options out of range, [`Error::Unsupported`] for what the bundle cannot do, [`Error::Bundle`]
/// for a mesh of the host's own or a missing part, [`Error::OutOfMemory`].
pub(super) fn build(
    model: &Arc<Model>,
    options: &SceneOptions,
    envelope: Option<EnvelopeCheck>,
) -> Result<Core> {
    // 0 leaves it to the model, which was opened with the number of threads of its host.
    let threads = match options.threads {
        0 => model.execution.threads,
        threads => threads,
    };
    if threads > 1024 {
        return Err(Error::Argument(format!(
            "threads is {threads}, must be at most 1024"
        )));
    }
    let isa = model.execution.isa;
    // Tables that are made here are part of the bits of later steps, so they are made in the mode
    // of the steps; it is put back where this function ends.
    let _mode = FlushToZero::of_portable(isa);
    let pool = Pool::of(isa, threads)?;
    // A linear response is of the mesh that it was computed for. A network alone is not: it takes
    // the positions as an input, and gets tables of the other mesh.
    let own_mesh = match &options.mesh_path {
        None => None,
        Some(path) => {
            if model.prior.is_some() {
                return Err(Error::Unsupported(
                    "mesh_path: this bundle has a prior, which is valid only for its own mesh; leave mesh_path out".into(),
                ));
            }
            let bytes = crate::bundle::read_regular(path)?;
            let file = TensorFile::parse(&path.display().to_string(), bytes)?;
            let mesh = Mesh::parse(&file, model.manifest.boundary)?;
            mesh.check_laws(file.name(), &model.manifest.material)?;
            Some(Arc::new(mesh))
        }
    };
    let engine = match &model.kind {
        KindModel::Reduced(_) if options.step_path == StepPath::Whole => {
            return Err(Error::Unsupported(
                "step_path: bundles of kind reduced have no step.onnx".into(),
            ));
        }
        KindModel::Reduced(kind) => {
            let table = model
                .prior
                .as_ref()
                .ok_or_else(|| Error::bundle("bundle.json", "field `prior` is missing"))?;
            let engine = reduced::ReducedEngine::new(model, kind, table)?;
            Engine::Reduced(memory::boxed(engine, SCENE)?)
        }
        // Made inside of a closure: a build without the feature "learned" has no such model, and
        // none of its code.
        KindModel::Upt(kind) => {
            let make = || {
                let (tables, node_count) = match &own_mesh {
                    None => (Arc::clone(&kind.tables), model.mesh.node_count()),
                    Some(mesh) => (
                        Arc::new(kind.tables_of(mesh, model.runtime()?, threads)?),
                        mesh.node_count(),
                    ),
                };
                let parts = upt::step_path::Parts {
                    model,
                    kind,
                    tables: &tables,
                    pool: &pool,
                    node_count,
                };
                parts.engine(options)
            };
            Engine::Upt(Proven::new(make, SCENE)?)
        }
    };
    let corrected = Corrector::new(model, options, isa, &pool)?;
    let corrected = corrected.map(|own| memory::boxed(own, SCENE)).transpose()?;
    let mesh = own_mesh.unwrap_or_else(|| Arc::clone(&model.mesh));
    // Without corrections no step is integrated: the engine knows the bundle's own length alone.
    let of_scene = corrected.as_ref().map(|own| own.time_step.integrator);
    StepMaker::new(Parts {
        body: SceneBody::new(Arc::clone(model), mesh, of_scene)?,
        options: options.clone(),
        isa,
        pool,
        engine,
        corrected,
        envelope,
    })
    .map(Core::new)
}
