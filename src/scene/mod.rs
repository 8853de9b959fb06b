//! [`Scene`]: a tissue that is stepped. One thread at a time; a call while another thread steps it is
//! [`Error::Busy`]. Reading the published states (`read`, `sample`, their points, `stats`) is allowed from any thread
//! at any time, also while a submitted step is in flight, and never waits for a step.
//!
//! REQ-017: A call stays within the stack that the C ABI's page states.

mod bed;
mod body;
mod build;
mod copied_loads;
mod core;
mod correct;
mod corrected;
mod counters;
mod cut;
mod cut_motion;
mod cut_state;
mod cut_surface;
mod cutting;
mod driven;
mod elastic;
mod engine;
mod followed_surface;
mod frame_state;
mod free_motion;
mod hands;
mod haptics;
mod inputs;
mod instruments;
mod inversion;
mod linear;
mod load_limits;
mod load_state;
mod loading;
mod loads;
mod maker;
mod node_forces;
mod own_pace;
mod plan;
mod point_force;
mod points;
mod present;
mod presenter;
mod pressed;
mod publish;
mod published;
mod reaction;
mod read;
mod record;
mod recording;
mod reduced;
mod region;
mod shared;
mod shown;
mod snapshot;
mod state;
mod step_input;
mod step_states;
mod support;
mod supports;
mod ties;
mod timing;
mod tissue;
mod tool_contact;
mod tools;
mod upt;
mod verdict;
mod watch;
mod worker;

use std::borrow::Cow;
use std::sync::Arc;
use std::time::Duration;

pub use bed::Bed;
pub use cut_surface::{CutSurface, SceneSurface, SurfaceUpdate};
pub use cutting::{Blade, Cut};
pub use load_limits::{LARGEST_FORCE, LARGEST_PRESSURE};
pub use loads::{Loads, MAX_PRESSURES, Pressure};
pub use point_force::{MAX_POINT_FORCES, PointForce};
pub use points::check_point_count;
pub use publish::{QUIET_DISPLACEMENT, QUIET_STEPS};
pub use published::View;
pub use step_input::{Contact, Progress, StepInput};
pub use support::SupportPose;
pub use supports::{GroupMotion, MAX_SUPPORTS};
pub(crate) use tools::Lists;

use crate::bundle::Mesh;
use crate::corrections::Integrator;
use crate::error::{Error, Result};
use crate::field::check_count;
use crate::memory;
use crate::model::{KindModel, Model};
use crate::options::SceneOptions;
use crate::output::Output;
use crate::replay::Recorder;
use crate::replay::base64::Bytes;
use crate::replay::lines::Line;
use build::build;
use points::AttachedPoints;
use published::Published;
use published::lock_read;
use region::check_nodes;
use shared::{CoreGuard, Shared};
use worker::Worker;

/// A tissue that is stepped. All methods take `&self`; concurrent use gives [`Error::Busy`], never a wait.
pub struct Scene {
    // Dropped first: it stops the worker, which uses the rest.
    worker: Worker,
    shared: Arc<Shared>,
    model: Arc<Model>,
    mesh: Arc<Mesh>,
    integrator: Integrator,
    tools: tools::Tools,
    // Dropped last.
    _given_back: memory::GivenBack,
}

impl Scene {
    /// Makes a scene at rest.
    ///
    /// ```
    /// # use std::path::Path;
    /// # use upt::{Contact, Model, ModelOptions, Scene, SceneOptions, StepInput};
    /// # let model = Model::open(Path::new("onnx/liver-coarse"), &ModelOptions::default())?;
    /// use upt::{Corrections, GuardPolicy};
    ///
    /// let options = SceneOptions {
    ///     corrections: Corrections::Fixed(4),
    ///     guard_policy: GuardPolicy::Blend,
    ///     ..SceneOptions::default()
    /// };
    /// let scene = Scene::new(model, &options)?;
    /// assert_eq!(scene.stats().step_count, 0);
    /// # upt::Result::Ok(())
    /// ```
    ///
    /// # Errors
    /// What [`Model::open`] says of sessions; [`Error::Unsupported`] for a mesh of the scene's own with a bundle that
    /// has a prior; [`Error::Io`] and [`Error::Bundle`] for that mesh.
    pub fn new(model: Arc<Model>, options: &SceneOptions) -> Result<Scene> {
        let _span = tracing::info_span!("scene").entered();
        let core = build(&model, options, None)?;
        let mesh = Arc::clone(&core.maker.body.mesh);
        let integrator = core.maker.body.integrator;
        let published = Published::rest(&core)?;
        Ok(Scene {
            worker: Worker::new(options.latest_wins),
            shared: Arc::new(Shared::new(core, published)),
            model,
            mesh,
            integrator,
            tools: tools::Tools::default(),
            _given_back: memory::GivenBack,
        })
    }

    /// The model of this scene.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// The scene's mesh: the bundle's, or its own.
    #[doc(hidden)]
    pub fn mesh(&self) -> &Arc<Mesh> {
        &self.mesh
    }

    /// The length of a step, s: the bundle's, or the scene's own.
    pub fn step_s(&self) -> f64 {
        self.integrator.step_s
    }

    /// Nodes of the scene's mesh, `K`, and those that cuts have added.
    pub fn node_count(&self) -> usize {
        lock_read(&self.shared.published).last.field.len() / 3
    }

    /// The core for one call, where no submitted step is in flight and no other thread has it.
    ///
    /// # Errors
    /// [`Error::Busy`].
    fn core(&self) -> Result<CoreGuard<'_>> {
        if self.worker.in_flight() {
            return Err(Error::Busy(
                "a submitted step is in flight; poll or wait first".into(),
            ));
        }
        self.shared.core()
    }

    /// Back to rest; region and points stay.
    pub fn reset(&self) -> Result<()> {
        let _frames = self.hold_frames(lock_read(&self.shared.published).body.cut.is_some())?;
        let line = |recorder: &mut Recorder| recorder.open(&Line::Reset {});
        self.core()?.told(Some(line), |core, published| {
            core.reset(published)?;
            self.tools.reset();
            Ok(())
        })
    }

    /// No list of the mesh's nodes is longer than the mesh: asked before a host's array is touched.
    ///
    /// # Errors
    /// [`Error::Argument`].
    pub(crate) fn check_node_count(&self, name: &str, count: u64) -> Result<()> {
        check_count(name, count, self.node_count())
    }

    /// One step of `dt`; `out` is `[n,3]` (n: `K`, or the region's count).
    ///
    /// ```
    /// # use std::path::Path;
    /// # use upt::{Contact, Model, ModelOptions, Scene, SceneOptions, StepInput};
    /// # let model = Model::open(Path::new("onnx/liver-coarse"), &ModelOptions::default())?;
    /// # let scene = Scene::new(model.clone(), &SceneOptions::default())?;
    /// # use upt::IndexSet;
    /// let node = model.indices(IndexSet::DomainNodes)[0];
    /// let mut u = vec![0.0; 3 * scene.node_count()];
    /// let pushed = Contact::Sparse { nodes: &[node], vectors: &[0.0, 0.0, -0.5] };
    /// scene.step(pushed, Some(&mut u))?;
    /// assert_eq!(u[3 * node as usize..][..3], [0.0, 0.0, -0.5]);
    /// # upt::Result::Ok(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Argument`], [`Error::NonFinite`] for inputs, [`Error::Guard`] for a refused state: the last good state
    /// stays.
    pub fn step<'a>(&self, input: impl Into<StepInput<'a>>, out: Option<&mut [f32]>) -> Result<()> {
        self.step_to(input.into(), out.map(Output::from))
    }

    /// [`Scene::step`] into memory that need not be initialised.
    pub(crate) fn step_to(&self, input: StepInput<'_>, out: Option<Output<'_, f32>>) -> Result<()> {
        let line = |recorder: &mut Recorder| record::step(recorder, &input);
        self.core()?.told(Some(line), |core, published| {
            core.step(published, input, out)
        })
    }

    /// Restricts output to these nodes (any order); `None` is all nodes. Both published states are decoded for the new
    /// region at once, to the bits that a full decode would have given.
    ///
    /// ```
    /// # use std::path::Path;
    /// # use upt::{Contact, Model, ModelOptions, Scene, SceneOptions, StepInput};
    /// # let model = Model::open(Path::new("onnx/liver-coarse"), &ModelOptions::default())?;
    /// # let scene = Scene::new(model.clone(), &SceneOptions::default())?;
    /// scene.set_region(Some(&[7, 3]))?;
    /// let mut two = [0.0; 6];
    /// scene.step(Contact::None, Some(&mut two))?;
    /// assert!(scene.set_region(Some(&[u32::MAX])).is_err());
    /// # upt::Result::Ok(())
    /// ```
    pub fn set_region(&self, nodes: Option<&[u32]>) -> Result<()> {
        let line = Line::Region(nodes.map(Cow::Borrowed));
        let line = |recorder: &mut Recorder| recorder.open(&line);
        self.core()?.told(Some(line), |core, published| {
            if let Some(nodes) = nodes {
                check_nodes(nodes, core.maker.body.mesh.node_count())?;
            }
            let points = Arc::clone(&core.maker.shown.points);
            let nodes = nodes.map(|nodes| memory::copied(nodes, "a region"));
            core.set_plan(published, nodes.transpose()?, points)
        })
    }

    /// Attaches points `[n,3]` in rest mm; `None` detaches. A `upt` bundle decodes them, unless the scene was made with
    /// `interpolate_points`; a `reduced` bundle has no network in space: its tables are interpolated. A point goes with the side of a cut on which it lies.
    ///
    /// ```
    /// # use std::path::Path;
    /// # use upt::{Contact, Model, ModelOptions, Scene, SceneOptions, StepInput};
    /// # let model = Model::open(Path::new("onnx/liver-coarse"), &ModelOptions::default())?;
    /// # let scene = Scene::new(model.clone(), &SceneOptions::default())?;
    /// let corner = &model.positions()[..3];
    /// scene.attach_points(Some(corner))?;
    /// scene.step(Contact::None, None)?;
    /// let mut u = [0.0; 3];
    /// scene.read_view(upt::View::Points, &mut u)?;
    /// assert_eq!(scene.point_count(), 1);
    /// # upt::Result::Ok(())
    /// ```
    pub fn attach_points(&self, points: Option<&[f32]>) -> Result<()> {
        self.core()?.call(|core, published| {
            let maker = &core.maker;
            let mesh = maker.body.intact_mesh();
            let mut points = match points {
                Some(points) => AttachedPoints::new(mesh, points)?,
                None => AttachedPoints::default(),
            };
            if let Some(cut) = &maker.body.cut {
                points = points.following(mesh, Some(&cut.body))?;
            }
            let interpolated = maker.corrected.is_some() || maker.options.interpolate_points;
            match &maker.body.model.kind {
                KindModel::Upt(kind) if !interpolated && points.len() > 0 => {
                    let threads = maker.machine.pool.threads();
                    let queries =
                        kind.queries(points.places(), maker.body.model.runtime()?, threads)?;
                    points.set_queries(queries)?;
                }
                KindModel::Upt(_) | KindModel::Reduced(_) => {}
            }
            let region = lock_read(published).region_copy()?;
            core.set_plan(published, region, Arc::new(points))
        })
    }

    /// Starts a step on the scene's worker; the input is checked and copied.
    ///
    /// # Errors
    /// [`Error::Argument`] and [`Error::NonFinite`] for the input, as [`Scene::step`]. [`Error::Busy`] while a submitted
    /// step has not finished, unless the scene was made with `latest_wins`: then an input that has not started is
    /// replaced. [`Error::State`] where no thread can be started.
    pub fn submit<'a>(&self, input: impl Into<StepInput<'a>>) -> Result<()> {
        self.worker.submit(&self.shared, &input.into(), &self.mesh)
    }

    /// Whether the submitted step has finished; an error that was not told yet, once, also of an earlier step. With
    /// `latest_wins`: whether a step has finished since this was last said, while another may be in flight.
    pub fn poll(&self) -> Result<Progress> {
        self.worker.poll()
    }

    /// Waits for the submitted step at most `timeout`.
    ///
    /// ```
    /// # use std::path::Path;
    /// # use upt::{Contact, Model, ModelOptions, Scene, SceneOptions, StepInput};
    /// # let model = Model::open(Path::new("onnx/liver-coarse"), &ModelOptions::default())?;
    /// # let scene = Scene::new(model.clone(), &SceneOptions::default())?;
    /// use std::time::Duration;
    /// use upt::Progress;
    ///
    /// scene.submit(Contact::None)?;
    /// let done = scene.wait(Duration::from_secs(60))?;
    /// assert_eq!(done, Progress::Done);
    /// assert_eq!(scene.stats().step_count, 1);
    /// # upt::Result::Ok(())
    /// ```
    pub fn wait(&self, timeout: Duration) -> Result<Progress> {
        self.worker.wait(timeout)
    }

    /// A snapshot from which the scene resumes to the bit.
    ///
    /// ```
    /// # use std::path::Path;
    /// # use upt::{Contact, Model, ModelOptions, Scene, SceneOptions, StepInput};
    /// # let model = Model::open(Path::new("onnx/liver-coarse"), &ModelOptions::default())?;
    /// # let scene = Scene::new(model.clone(), &SceneOptions::default())?;
    /// let saved = scene.save()?;
    /// scene.step(Contact::None, None)?;
    /// scene.restore(&saved)?;
    /// assert_eq!(scene.save()?, saved);
    /// assert!(scene.restore(&saved[1..]).is_err());
    /// # upt::Result::Ok(())
    /// ```
    pub fn save(&self) -> Result<Vec<u8>> {
        self.core()?.call(|core, published| core.save(published))
    }

    /// Restores a snapshot.
    ///
    /// # Errors
    /// [`Error::Snapshot`] when it is damaged or of another model or mesh, [`Error::Version`].
    pub fn restore(&self, bytes: &[u8]) -> Result<()> {
        let is_cut = lock_read(&self.shared.published).body.cut.is_some();
        let _frames = self.hold_frames(is_cut || snapshot::has_body(bytes))?;
        let line = Line::Restore(Bytes(Cow::Borrowed(bytes)));
        let line = |recorder: &mut Recorder| recorder.open(&line);
        self.core()?
            .told(Some(line), |core, published| core.restore(published, bytes))
    }
}

#[cfg(all(test, target_arch = "x86_64"))] // MXCSR tells what was met
mod tests;
