//! [`Model`]: a bundle made ready to step. Immutable, shared by scenes, safe from any thread.

mod anchors;
mod cut;
mod execution;
mod info;
mod made;
mod portable;
mod precision;
mod reduced;
mod samples;
mod supports;
mod upt;
mod upt_stages;

use crate::clock::Instant;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

pub use anchors::Anchors;
pub(crate) use execution::Execution;
pub use info::{Kind, ModelInfo};
use made::MadeOnce;
pub use reduced::{LearnedMap, ReducedModel};
pub use upt::{UptModel, UptTables};
pub use upt_stages::DECODER_TILE;

use crate::bundle::{BundleFiles, Manifest, ManifestKind, Mesh, NodeSet, Place};
use crate::corrections::Corrections;
use crate::error::Result;
use crate::features::HAS_INSTRUMENTS;
use crate::kernels::FlushToZero;
use crate::library::{self, Alive};
use crate::memory::HeldBytes;
use crate::onnx::{ProviderPlan, Runtime};
use crate::options::{IndexSet, ModelOptions, Precision, Provider};
use crate::prior::PriorTable;

/// What differs between the kinds.
pub enum KindModel {
    /// Kind `upt`.
    Upt(Arc<UptModel>),
    /// Kind `reduced`.
    Reduced(Arc<ReducedModel>),
}

/// A bundle made ready to step.
pub struct Model {
    /// The manifest.
    #[doc(hidden)]
    pub manifest: Manifest,
    /// SHA-256 of `bundle.json`.
    pub hash: [u8; 32],
    /// The bundle's mesh.
    #[doc(hidden)]
    pub mesh: Arc<Mesh>,
    /// The linear response, where the bundle has one.
    #[doc(hidden)]
    pub prior: Option<Arc<PriorTable>>,
    /// The kind's own part.
    #[doc(hidden)]
    pub kind: KindModel,
    made: MadeOnce,
    files: Arc<BundleFiles>,
    pub(crate) execution: Execution,
    load_seconds: f64,
    _alive: Alive,
}

impl Model {
    /// Opens and validates the bundle in the folder `path`, loads ONNX Runtime where the bundle has a graph, and computes the
    /// static tables.
    ///
    /// ```
    /// use std::path::Path;
    /// use upt::{Kind, Model, ModelOptions};
    ///
    /// let model = Model::open(Path::new("onnx/liver-coarse"), &ModelOptions::default())?;
    /// let info = model.info();
    /// assert_eq!((info.kind, info.dt), (Kind::Reduced, 0.05));
    ///
    /// let missing = Model::open(Path::new("onnx/no-such-bundle"), &ModelOptions::default());
    /// assert!(matches!(missing, Err(upt::Error::Io { .. })));
    /// # upt::Result::Ok(())
    /// ```
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Bundle`] (names file and field), [`crate::Error::Version`],
    /// [`crate::Error::Runtime`], [`crate::Error::Provider`].
    pub fn open(path: &Path, options: &ModelOptions) -> Result<Arc<Model>> {
        let _span = tracing::info_span!("open", path = %path.display()).entered();
        Model::open_at(Place::folder(path), options)
    }

    /// As [`Model::open`], of a bundle whose files are in memory, by name.
    ///
    /// # Errors
    /// Those of [`Model::open`]; [`crate::Error::Io`] names a file that is not among them.
    pub fn open_memory(
        files: BTreeMap<String, Vec<u8>>,
        options: &ModelOptions,
    ) -> Result<Arc<Model>> {
        Model::open_at(Place::Memory(Mutex::new(files)), options)
    }

    fn open_at(place: Place, options: &ModelOptions) -> Result<Arc<Model>> {
        let start = Instant::now();
        if options.device_id < 0 {
            return Err(crate::error::Error::Argument(format!(
                "device_id is {}; devices are counted from 0",
                options.device_id
            )));
        }
        let on_device = options.providers.iter().any(|&p| p != Provider::Cpu);
        for (name, set) in [
            ("user_stream", options.user_stream.is_some()),
            ("gpu_memory_limit", options.gpu_memory_limit != 0),
        ] {
            if set && !on_device {
                return Err(crate::error::Error::Argument(format!(
                    "{name} is set, but `providers` names no GPU provider"
                )));
            }
        }
        let files = Arc::new(BundleFiles::at(place)?);
        Model::of_files(Arc::clone(&files), options, start).map_err(|error| files.name_maker(error))
    }

    fn of_files(
        files: Arc<BundleFiles>,
        options: &ModelOptions,
        start: Instant,
    ) -> Result<Arc<Model>> {
        let process = library::current();
        let manifest = files.manifest.clone();
        let isa = portable::set_of(options, &manifest)?;
        let _mode = FlushToZero::of_portable(isa);
        let mesh_file = files.tensors(&manifest.mesh.file)?;
        let mut mesh = Mesh::parse(&mesh_file, manifest.boundary)?;
        mesh.take_named(&manifest.supports, &manifest.regions)?;
        mesh.check_laws(&manifest.mesh.file, &manifest.material)?;
        mesh.check_named_laws(&mesh_file, &manifest.laws)?;
        if mesh.node_count() != manifest.mesh.nodes {
            return Err(crate::error::Error::bundle(
                "bundle.json",
                format!(
                    "field `mesh.nodes` is {}, {} has {} nodes",
                    manifest.mesh.nodes,
                    manifest.mesh.file,
                    mesh.node_count()
                ),
            ));
        }
        if !mesh.sha256.eq_ignore_ascii_case(&manifest.mesh.mesh_sha256) {
            return Err(crate::error::Error::bundle(
                "bundle.json",
                format!(
                    "field `mesh.mesh_sha256` is {}, the mesh in {} has {}",
                    manifest.mesh.mesh_sha256, manifest.mesh.file, mesh.sha256
                ),
            ));
        }
        let prior = match &manifest.prior {
            Some(entry) => Some(Arc::new(PriorTable::open(&files, entry, &mesh)?)),
            None => None,
        };
        let load = || Runtime::get(process.onnxruntime_path.as_deref());
        // Whatever is wrong with a bundle's graphs, a library that is missing is told of first.
        let runtime = match (manifest.kind, &manifest.reduced) {
            (ManifestKind::Reduced, None) => None,
            (ManifestKind::Reduced, Some(_)) | (ManifestKind::Upt, _) => Some(load()?),
        };
        let plan = ProviderPlan::new(options);
        let threads = match (options.threads, process.threads) {
            (0, 0) => 1,
            (0, n) => n,
            (n, _) => n,
        };
        let graphs = precision::of_graphs(&files, options);
        let (kind, choice) = match manifest.kind {
            ManifestKind::Reduced => {
                let (model, choice) = ReducedModel::open(&files, load, &plan, graphs)?;
                (KindModel::Reduced(Arc::new(model)), choice)
            }
            ManifestKind::Upt => {
                let (model, choice) =
                    UptModel::open(&files, &mesh, load()?, &plan, threads, graphs)?;
                (KindModel::Upt(Arc::new(model)), choice)
            }
        };
        let model = Model {
            hash: files.hash,
            made: MadeOnce::default(),
            files,
            mesh: Arc::new(mesh),
            prior,
            kind,
            execution: Execution {
                runtime,
                plan,
                choice,
                threads,
                isa,
                precision: options.precision.unwrap_or(Precision::F32),
            },
            load_seconds: start.elapsed().as_secs_f64(),
            manifest,
            _alive: Alive::new(),
        };
        tracing::info!(name = %model.manifest.name, seconds = model.load_seconds, "model opened");
        Ok(Arc::new(model))
    }

    /// The corrections' tables, read when the first scene asks for them.
    ///
    /// # Errors
    /// [`crate::Error::Unsupported`] where the bundle lacks what they need; [`crate::Error::Io`] and
    /// [`crate::Error::Bundle`] for their file.
    #[doc(hidden)]
    pub fn corrections(&self) -> Result<&Corrections> {
        let _opening = self
            .made
            .opening
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        if let Some(made) = self.made.corrections.get() {
            return Ok(made);
        }
        let _mode = FlushToZero::of_portable(self.execution.isa);
        let made = Corrections::open(
            &self.files,
            &self.mesh,
            self.prior.as_deref(),
            self.execution.isa,
        )
        .and_then(|made| crate::memory::boxed(made, "the corrections"))
        .map_err(|error| self.files.name_maker(error))?;
        Ok(self.made.corrections.get_or_init(|| made))
    }

    /// Reads what corrections need for loads, at the first that a scene is given.
    ///
    /// # Errors
    /// Those of [`Model::corrections`], and those of the file.
    #[doc(hidden)]
    pub fn prepare_loads(&self) -> Result<()> {
        let corrections = self.corrections()?;
        let _opening = self
            .made
            .opening
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        (corrections.prepare_loads(&self.files)).map_err(|error| self.files.name_maker(error))
    }

    /// Where tools touch the domain, those of the reference solver; made when the first scene is given tools.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    #[doc(hidden)]
    pub fn samples(&self) -> Result<Arc<::contact::Samples>> {
        if let Some(made) = self.made.samples.get() {
            return Ok(Arc::clone(made));
        }
        let made = Arc::new(samples::of(&self.mesh)?);
        Ok(Arc::clone(self.made.samples.get_or_init(|| made)))
    }

    /// What the model is.
    pub fn info(&self) -> ModelInfo {
        let (kind, supernodes, own) = match &self.kind {
            KindModel::Upt(upt) => (
                Kind::Upt,
                upt.tables.graph.supernodes.len(),
                upt.held_bytes() + upt.tables.held_bytes(),
            ),
            KindModel::Reduced(reduced) => (Kind::Reduced, 0, reduced.held_bytes()),
        };
        let prior = self.prior.as_ref().map_or(0, |table| table.held_bytes());
        ModelInfo {
            kind,
            node_count: self.mesh.node_count() as u64,
            tet_count: (self.mesh.tets.len() / 4) as u64,
            surface_face_count: (self.mesh.surface.faces.len() / 3) as u64,
            domain_node_count: self.mesh.domain.nodes.len() as u64,
            held_node_count: self.mesh.held_nodes.len() as u64,
            supernode_count: supernodes as u64,
            dt: self.manifest.dt_s as f32,
            max_push_mm: self.manifest.envelope.max_push_mm,
            provider: self.execution.choice.provider,
            precision: match &self.kind {
                KindModel::Upt(upt) => upt.precision,
                KindModel::Reduced(reduced) => reduced.precision(),
            },
            memory_bytes: (own + prior + self.mesh.held_bytes()) as u64,
            load_seconds: self.load_seconds,
            // A build without instruments presents no frames between steps.
            frame_step_s: match HAS_INSTRUMENTS {
                true => self.manifest.frame_step_s(),
                false => self.manifest.dt_s,
            },
        }
    }

    /// JSON: name, bundle hash, provider of each stage and why others were not taken, ONNX Runtime's file and version.
    pub fn describe_json(&self) -> String {
        let refused: Vec<serde_json::Value> = self
            .execution
            .choice
            .refused
            .iter()
            .map(
                |(provider, reason)| serde_json::json!({"name": provider.name(), "reason": reason}),
            )
            .collect();
        let native = "native";
        let latent = self.execution.choice.provider.name();
        let stages = match &self.kind {
            KindModel::Upt(kind) => serde_json::json!({
                "encode": native, "aggregate": native, "latent": latent,
                "decode": "native, or onnxruntime where the scene asks for it",
                "step_graph": kind.has_step(),
            }),
            KindModel::Reduced(_) if self.execution.runtime.is_none() => {
                serde_json::json!({"prior": native, "decode": native})
            }
            KindModel::Reduced(_) => {
                serde_json::json!({"prior": native, "latent": latent, "decode": native})
            }
        };
        serde_json::json!({
            "name": self.manifest.name,
            "kind": self.manifest_kind(),
            "bundle_sha256": crate::bundle::hex(&self.hash),
            "mesh_sha256": self.mesh.sha256,
            "nodes": self.mesh.node_count(),
            "supports": NodeSet::listed(&self.mesh.supports),
            "regions": NodeSet::listed(&self.mesh.regions),
            "gravity_at_rest_m_s2": self.manifest.gravity_at_rest_m_s2,
            "threads": self.execution.threads,
            "stages": stages,
            "providers_refused": refused,
            "latent_nodes": self.execution.choice.nodes,
            "latent_memory": self.execution.choice.memory,
            "instruction_set": format!("{:?}", self.execution.isa),
            "onnxruntime": self.execution.runtime.map(|runtime| {
                serde_json::json!({"path": runtime.path().display().to_string(), "version": runtime.version()})
            }),
        })
        .to_string()
    }

    /// ONNX Runtime, which a model with graphs has loaded.
    ///
    /// # Errors
    /// [`crate::Error::Unsupported`] for a bundle without graphs.
    pub(crate) fn runtime(&self) -> Result<&'static Runtime> {
        self.execution.runtime.ok_or_else(|| {
            crate::error::Error::Unsupported(format!("{} has no graph", self.manifest.name))
        })
    }

    fn manifest_kind(&self) -> &'static str {
        match self.manifest.kind {
            ManifestKind::Upt => "upt",
            ManifestKind::Reduced => "reduced",
        }
    }

    /// Rest positions `[K,3]`, mm.
    pub fn positions(&self) -> &[f32] {
        &self.mesh.positions
    }

    /// A static index set.
    ///
    /// ```
    /// # use std::path::Path;
    /// # use upt::{Model, ModelOptions};
    /// use upt::IndexSet;
    /// # let model = Model::open(Path::new("onnx/liver-coarse"), &ModelOptions::default())?;
    /// let tets = model.indices(IndexSet::Tets);
    /// let nodes = model.positions().len() / 3;
    /// assert!(tets.len() % 4 == 0 && tets.iter().all(|&node| (node as usize) < nodes));
    /// # upt::Result::Ok(())
    /// ```
    pub fn indices(&self, set: IndexSet) -> &[u32] {
        match set {
            IndexSet::SurfaceNodes => &self.mesh.surface.nodes,
            IndexSet::DomainNodes => &self.mesh.domain.nodes,
            IndexSet::HeldNodes => &self.mesh.held_nodes,
            IndexSet::SurfaceFaces => &self.mesh.surface.faces,
            IndexSet::DomainFaces => &self.mesh.domain.faces,
            IndexSet::Tets => &self.mesh.tets,
        }
    }
}
