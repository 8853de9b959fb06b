//! A simulated case as a file (docs/reference/formats.md, "Trajectory").

use crate::material::Material;
use crate::tensors::{self, Dtype, Tensor};
use crate::tool_tracks::ToolTracks;
use safetensors::SafeTensors;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// All frames of a case. `F` frames, `K` nodes, `N` contact entries over all frames.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    pub header: TrajectoryHeader,
    /// `[F,K,3]`, mm.
    pub displacement: Vec<[f32; 3]>,
    /// `[F+1]` rows of the contact arrays.
    pub contact_offsets: Vec<u32>,
    /// `[N]`, ascending in a row.
    pub contact_nodes: Vec<u32>,
    /// `[N,3]` prescribed displacement, mm.
    pub contact_vectors: Vec<[f32; 3]>,
    /// `[N,3]` elastic force of the tissue on the instrument, mN.
    pub reaction: Vec<[f32; 3]>,
    /// `[F]`, mJ.
    pub strain_energy: Vec<f32>,
    /// `[F]`, mJ.
    pub kinetic_energy: Vec<f32>,
    /// `[F]`, mJ.
    pub external_work: Vec<f32>,
    /// `[F]`.
    pub min_det_f: Vec<f32>,
    /// Tools, where there were any.
    pub tools: Option<ToolTracks>,
}

/// What a trajectory says about itself.
#[derive(Clone, Debug, PartialEq)]
pub struct TrajectoryHeader {
    pub mesh_name: String,
    pub mesh_sha256: String,
    /// `fixed` or `supported`.
    pub boundary: String,
    /// `1`..`5`, a hard regime's name, or `tool-` and the name of a programme of tools.
    pub scheme: String,
    pub seed: u64,
    /// Centroid of the seed face, or where the first tool is to touch, mm.
    pub site: [f64; 3],
    pub material: Material,
    /// Time between frames, s.
    pub dt_s: f64,
    /// Asked inner step, s.
    pub inner_dt_s: f64,
    /// Selective mass scaling: shortest critical step of an element, s; 0 for none.
    pub mass_scaling_s: f64,
    /// Solver name and version.
    pub solver: String,
}

/// A trajectory file that cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum TrajectoryError {
    #[error("{path}: {source}")]
    Io {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("{path}: not a safetensors file ({reason})")]
    NotSafetensors { path: PathBuf, reason: String },
    #[error("{path}: field `{field}` {reason}; write the file again with `upt simulate`")]
    Field {
        path: PathBuf,
        field: String,
        reason: String,
    },
}

impl Trajectory {
    /// A single frame: a body of `nodes` nodes at rest, without contact.
    pub fn at_rest(header: TrajectoryHeader, nodes: usize) -> Self {
        Self {
            header,
            displacement: vec![[0.0; 3]; nodes],
            contact_offsets: vec![0, 0],
            contact_nodes: Vec::new(),
            contact_vectors: Vec::new(),
            reaction: Vec::new(),
            strain_energy: vec![0.0],
            kinetic_energy: vec![0.0],
            external_work: vec![0.0],
            min_det_f: vec![1.0],
            tools: None,
        }
    }

    /// Number of frames, `F`.
    pub fn frame_count(&self) -> usize {
        self.min_det_f.len()
    }

    /// Displacement of one frame, `[K,3]` mm.
    pub fn frame(&self, frame: usize) -> &[[f32; 3]] {
        let count = self.displacement.len() / self.frame_count();
        &self.displacement[frame * count..(frame + 1) * count]
    }

    /// Contact entries of one frame: nodes and prescribed displacements.
    pub fn contact(&self, frame: usize) -> (&[u32], &[[f32; 3]]) {
        let row = self.contact_offsets[frame] as usize..self.contact_offsets[frame + 1] as usize;
        (&self.contact_nodes[row.clone()], &self.contact_vectors[row])
    }

    /// Elastic force of the tissue on the instrument at the nodes of [`Self::contact`], mN.
    pub fn reaction(&self, frame: usize) -> &[[f32; 3]] {
        let row = self.contact_offsets[frame] as usize..self.contact_offsets[frame + 1] as usize;
        &self.reaction[row]
    }

    /// Writes the file, whole or not at all; `half` stores `displacement` as f16.
    pub fn write(&self, path: &Path, half: bool) -> Result<(), TrajectoryError> {
        let frames = self.frame_count();
        let nodes = self.displacement.len() / frames.max(1);
        let floats = |values: &mut dyn Iterator<Item = f32>| -> Vec<u8> {
            values.flat_map(|v| v.to_le_bytes()).collect()
        };
        let indices = |values: &[u32]| -> Vec<u8> {
            values
                .iter()
                .flat_map(|v| (*v as i32).to_le_bytes())
                .collect()
        };
        let vectors = |name: &str, values: &[[f32; 3]]| {
            Tensor::new(
                name,
                Dtype::F32,
                vec![values.len(), 3],
                floats(&mut values.iter().flatten().copied()),
            )
        };
        let series = |name: &str, values: &[f32]| {
            Tensor::new(
                name,
                Dtype::F32,
                vec![values.len()],
                floats(&mut values.iter().copied()),
            )
        };
        let displacement = if half {
            let bytes = self.displacement.iter().flatten();
            Tensor::new(
                "displacement",
                Dtype::F16,
                vec![frames, nodes, 3],
                bytes
                    .flat_map(|v| half::f16::from_f32(*v).to_le_bytes())
                    .collect(),
            )
        } else {
            Tensor::new(
                "displacement",
                Dtype::F32,
                vec![frames, nodes, 3],
                floats(&mut self.displacement.iter().flatten().copied()),
            )
        };
        let mut tensors = vec![
            displacement,
            Tensor::new(
                "contact_offsets",
                Dtype::I32,
                vec![self.contact_offsets.len()],
                indices(&self.contact_offsets),
            ),
            Tensor::new(
                "contact_nodes",
                Dtype::I32,
                vec![self.contact_nodes.len()],
                indices(&self.contact_nodes),
            ),
            vectors("contact_vectors", &self.contact_vectors),
            vectors("reaction", &self.reaction),
            series("strain_energy", &self.strain_energy),
            series("kinetic_energy", &self.kinetic_energy),
            series("external_work", &self.external_work),
            series("min_det_f", &self.min_det_f),
        ];
        let mut metadata = self.header.metadata();
        if let Some(tracks) = &self.tools {
            tensors.extend(tracks.tensors());
            metadata.insert("tools".into(), serde_json::json!(tracks.tools).to_string());
        }
        tensors::write_file(path, &metadata, &tensors).map_err(|source| TrajectoryError::Io {
            path: path.into(),
            source,
        })
    }

    /// Reads a file written by [`Trajectory::write`] or by `training/`; f16 is widened.
    pub fn read(path: &Path) -> Result<Self, TrajectoryError> {
        let bytes = std::fs::read(path).map_err(|source| TrajectoryError::Io {
            path: path.into(),
            source,
        })?;
        let not_safetensors =
            |error: safetensors::SafeTensorError| TrajectoryError::NotSafetensors {
                path: path.into(),
                reason: error.to_string(),
            };
        let field = |field: &str, reason: String| TrajectoryError::Field {
            path: path.into(),
            field: field.into(),
            reason,
        };
        let (_, metadata) = SafeTensors::read_metadata(&bytes).map_err(not_safetensors)?;
        let metadata = metadata.metadata().clone().unwrap_or_default();
        let header = TrajectoryHeader::from_metadata(&metadata, &field)?;
        let file = SafeTensors::deserialize(&bytes).map_err(not_safetensors)?;
        let tensor = |name: &str, dimensions: usize| {
            let view = file
                .tensor(name)
                .map_err(|_| field(name, "is missing".into()))?;
            if view.shape().len() != dimensions {
                return Err(field(name, format!("has shape {:?}", view.shape())));
            }
            Ok(view)
        };
        let floats = |name: &str, dimensions: usize| -> Result<Vec<f32>, TrajectoryError> {
            let view = tensor(name, dimensions)?;
            match view.dtype() {
                safetensors::Dtype::F32 => Ok(tensors::f32_values(view.data()).collect()),
                safetensors::Dtype::F16 => Ok(view
                    .data()
                    .as_chunks()
                    .0
                    .iter()
                    .map(|b| half::f16::from_le_bytes(*b).to_f32())
                    .collect()),
                other => Err(field(name, format!("is {other:?}; expected F32 or F16"))),
            }
        };
        let indices = |name: &str| -> Result<Vec<u32>, TrajectoryError> {
            let view = tensor(name, 1)?;
            if view.dtype() != safetensors::Dtype::I32 {
                return Err(field(name, format!("is {:?}; expected I32", view.dtype())));
            }
            Ok(tensors::i32_values(view.data()).map(|v| v as u32).collect())
        };
        let vectors = |name: &str, dimensions| -> Result<Vec<[f32; 3]>, TrajectoryError> {
            Ok(floats(name, dimensions)?.as_chunks().0.to_vec())
        };
        let mut trajectory = Self {
            tools: None,
            header,
            displacement: vectors("displacement", 3)?,
            contact_offsets: indices("contact_offsets")?,
            contact_nodes: indices("contact_nodes")?,
            contact_vectors: vectors("contact_vectors", 2)?,
            reaction: vectors("reaction", 2)?,
            strain_energy: floats("strain_energy", 1)?,
            kinetic_energy: floats("kinetic_energy", 1)?,
            external_work: floats("external_work", 1)?,
            min_det_f: floats("min_det_f", 1)?,
        };
        let frames = trajectory.frame_count();
        let offsets = &trajectory.contact_offsets;
        if offsets.len() != frames + 1
            || offsets.windows(2).any(|w| w[1] < w[0])
            || offsets[frames] as usize != trajectory.contact_nodes.len()
            || trajectory.contact_vectors.len() != trajectory.contact_nodes.len()
        {
            return Err(field(
                "contact_offsets",
                format!("does not describe {frames} rows"),
            ));
        }
        if let Some(tools) = metadata.get("tools") {
            let tracks = ToolTracks::read(&file, tools, frames);
            trajectory.tools = Some(tracks.map_err(|(name, reason)| field(&name, reason))?);
        }
        Ok(trajectory)
    }
}

impl TrajectoryHeader {
    fn metadata(&self) -> BTreeMap<String, String> {
        [
            ("format", "upt-trajectory".to_string()),
            ("version", "1".into()),
            ("mesh_name", self.mesh_name.clone()),
            ("mesh_sha256", self.mesh_sha256.clone()),
            ("boundary", self.boundary.clone()),
            ("scheme", self.scheme.clone()),
            ("seed", self.seed.to_string()),
            ("site", serde_json::json!(self.site).to_string()),
            ("material", serde_json::json!(self.material).to_string()),
            ("dt_s", self.dt_s.to_string()),
            ("inner_dt_s", self.inner_dt_s.to_string()),
            ("mass_scaling_s", self.mass_scaling_s.to_string()),
            ("solver", self.solver.clone()),
        ]
        .map(|(key, value)| (key.to_string(), value))
        .into()
    }

    fn from_metadata(
        metadata: &std::collections::HashMap<String, String>,
        field: &impl Fn(&str, String) -> TrajectoryError,
    ) -> Result<Self, TrajectoryError> {
        let text = |key: &str| {
            metadata
                .get(key)
                .cloned()
                .ok_or_else(|| field(key, "is missing".into()))
        };
        fn json<T: serde::de::DeserializeOwned>(
            key: &str,
            value: String,
            field: &impl Fn(&str, String) -> TrajectoryError,
        ) -> Result<T, TrajectoryError> {
            serde_json::from_str(&value)
                .map_err(|error| field(key, format!("is `{value}` ({error})")))
        }
        for (key, wanted) in [("format", "upt-trajectory"), ("version", "1")] {
            let found = text(key)?;
            if found != wanted {
                return Err(field(key, format!("is `{found}`; expected `{wanted}`")));
            }
        }
        Ok(Self {
            mesh_name: text("mesh_name")?,
            mesh_sha256: text("mesh_sha256")?,
            boundary: text("boundary")?,
            scheme: text("scheme")?,
            seed: json("seed", text("seed")?, field)?,
            site: json("site", text("site")?, field)?,
            material: json("material", text("material")?, field)?,
            dt_s: json("dt_s", text("dt_s")?, field)?,
            inner_dt_s: json("inner_dt_s", text("inner_dt_s")?, field)?,
            mass_scaling_s: match metadata.get("mass_scaling_s") {
                Some(value) => json("mass_scaling_s", value.clone(), field)?,
                None => 0.0,
            },
            solver: text("solver")?,
        })
    }
}
