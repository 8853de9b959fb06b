//! Reading and writing `*.mesh.safetensors` (docs/reference/formats.md, "Mesh").

use super::{Mesh, MeshError};
use crate::tensors::{self, Dtype, Tensor};
use safetensors::{SafeTensors, tensor::TensorView};
use std::collections::BTreeMap;
use std::path::Path;

impl Mesh {
    /// Reads and validates a mesh file.
    pub fn read(path: &Path) -> Result<Self, MeshError> {
        let bytes = crate::regular_file::read(path).map_err(|source| MeshError::Io {
            path: path.into(),
            source,
        })?;
        let mesh = Self::from_bytes(&bytes, path)?;
        mesh.validate()?;
        Ok(mesh)
    }

    /// Parses a mesh file's bytes without validating the geometry; `path` only names it in errors.
    pub fn from_bytes(bytes: &[u8], path: &Path) -> Result<Self, MeshError> {
        let not_safetensors = |error: safetensors::SafeTensorError| MeshError::NotSafetensors {
            path: path.into(),
            reason: error.to_string(),
        };
        let (_, header) = SafeTensors::read_metadata(bytes).map_err(not_safetensors)?;
        let metadata = header.metadata().clone().unwrap_or_default();
        let field = |field: &str, reason: String| MeshError::Field {
            path: path.into(),
            field: field.into(),
            reason,
        };
        for (key, wanted) in [("format", "upt-mesh"), ("version", "1"), ("units", "mm")] {
            match metadata.get(key) {
                Some(found) if found == wanted => {}
                Some(found) => {
                    return Err(field(key, format!("is `{found}`; expected `{wanted}`")));
                }
                None => return Err(field(key, format!("is missing; expected `{wanted}`"))),
            }
        }
        let file = SafeTensors::deserialize(bytes).map_err(not_safetensors)?;
        let tensor = |name: &str, dtype: safetensors::Dtype, width: Option<usize>| {
            let view: TensorView = file
                .tensor(name)
                .map_err(|_| field(name, "is missing".into()))?;
            let shape_fits = match width {
                Some(width) => view.shape().len() == 2 && view.shape()[1] == width,
                None => view.shape().len() == 1,
            };
            if view.dtype() != dtype || !shape_fits {
                let columns = width.map_or(String::new(), |w| format!(",{w}"));
                return Err(field(
                    name,
                    format!(
                        "is {:?} {:?}; expected {dtype:?} [n{columns}]",
                        view.dtype(),
                        view.shape()
                    ),
                ));
            }
            Ok(view.data().to_vec())
        };
        let indices = |name: &str, width: Option<usize>| -> Result<Vec<u32>, MeshError> {
            tensors::i32_values(&tensor(name, safetensors::Dtype::I32, width)?)
                .enumerate()
                .map(|(index, value)| {
                    u32::try_from(value)
                        .map_err(|_| field(name, format!("entry {index} is negative ({value})")))
                })
                .collect()
        };
        let text = |key: &str| metadata.get(key).cloned().unwrap_or_default();
        let positions: Vec<f32> =
            tensors::f32_values(&tensor("positions", safetensors::Dtype::F32, Some(3))?).collect();
        Ok(Self {
            name: text("name"),
            source: text("source"),
            license: text("license"),
            positions: positions.as_chunks().0.to_vec(),
            tets: indices("tets", Some(4))?.as_chunks().0.to_vec(),
            surface: indices("surface", Some(3))?.as_chunks().0.to_vec(),
            domain: indices("domain", None)?,
            fixed: indices("fixed", None)?,
            supported: indices("supported", None)?,
            stiffness: match file.tensor("stiffness") {
                Ok(_) => tensors::f32_values(&tensor("stiffness", safetensors::Dtype::F32, None)?)
                    .collect(),
                Err(_) => Vec::new(),
            },
            region: match file.tensor("region") {
                Ok(_) => (indices("region", None)?.into_iter().enumerate())
                    .map(|(index, number)| {
                        u8::try_from(number).map_err(|_| {
                            let reason =
                                format!("entry {index} is {number}; it must be at most 64");
                            field("region", reason)
                        })
                    })
                    .collect::<Result<_, _>>()?,
                Err(_) => Vec::new(),
            },
            regions: match metadata.get("laws") {
                Some(text) => elements::Region::list(text)
                    .map_err(|error| field("laws", format!("is no list of regions: {error}")))?,
                None => Vec::new(),
            },
            fibre: match file.tensor("fibre") {
                Ok(_) => {
                    let values = tensor("fibre", safetensors::Dtype::F32, Some(3))?;
                    let values: Vec<f32> = tensors::f32_values(&values).collect();
                    values.as_chunks().0.to_vec()
                }
                Err(_) => Vec::new(),
            },
        })
    }

    /// Validates and writes the mesh; the file is whole or absent.
    pub fn write(&self, path: &Path) -> Result<(), MeshError> {
        self.validate()?;
        let mut metadata: BTreeMap<String, String> = [
            ("format", "upt-mesh"),
            ("version", "1"),
            ("units", "mm"),
            ("name", &self.name),
            ("source", &self.source),
            ("license", &self.license),
        ]
        .map(|(key, value)| (key.to_string(), value.to_string()))
        .into();
        let index_bytes = |values: &mut dyn Iterator<Item = u32>| -> Vec<u8> {
            values.flat_map(|v| (v as i32).to_le_bytes()).collect()
        };
        let rows = |count: usize, width: usize| vec![count, width];
        let mut tensors = vec![
            Tensor::new(
                "positions",
                Dtype::F32,
                rows(self.positions.len(), 3),
                self.positions
                    .iter()
                    .flatten()
                    .flat_map(|v| v.to_le_bytes())
                    .collect(),
            ),
            Tensor::new(
                "tets",
                Dtype::I32,
                rows(self.tets.len(), 4),
                index_bytes(&mut self.tets.iter().flatten().copied()),
            ),
            Tensor::new(
                "surface",
                Dtype::I32,
                rows(self.surface.len(), 3),
                index_bytes(&mut self.surface.iter().flatten().copied()),
            ),
            Tensor::new(
                "domain",
                Dtype::I32,
                vec![self.domain.len()],
                index_bytes(&mut self.domain.iter().copied()),
            ),
            Tensor::new(
                "fixed",
                Dtype::I32,
                vec![self.fixed.len()],
                index_bytes(&mut self.fixed.iter().copied()),
            ),
            Tensor::new(
                "supported",
                Dtype::I32,
                vec![self.supported.len()],
                index_bytes(&mut self.supported.iter().copied()),
            ),
        ];
        if !self.stiffness.is_empty() {
            tensors.push(Tensor::new(
                "stiffness",
                Dtype::F32,
                vec![self.stiffness.len()],
                self.stiffness
                    .iter()
                    .flat_map(|v| v.to_le_bytes())
                    .collect(),
            ));
        }
        if !self.region.is_empty() {
            metadata.insert("laws".into(), self.laws_text());
            tensors.push(Tensor::new(
                "region",
                Dtype::I32,
                vec![self.region.len()],
                index_bytes(&mut self.region.iter().map(|number| u32::from(*number))),
            ));
        }
        if !self.fibre.is_empty() {
            tensors.push(Tensor::new(
                "fibre",
                Dtype::F32,
                rows(self.fibre.len(), 3),
                self.fibre
                    .iter()
                    .flatten()
                    .flat_map(|v| v.to_le_bytes())
                    .collect(),
            ));
        }
        tensors::write_file(path, &metadata, &tensors).map_err(|source| MeshError::Io {
            path: path.into(),
            source,
        })
    }
}
