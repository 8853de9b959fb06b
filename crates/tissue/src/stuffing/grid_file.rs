//! Reads a signed distance grid that another program made (docs/reference/formats.md, "Distance field").

use super::GridField;
use crate::mesh::MeshError;
use crate::tensors;
use safetensors::{Dtype, SafeTensors};
use std::path::Path;

impl GridField {
    /// Reads `distance` `[nx, ny, nz]` f32 with the metadata `origin` (JSON `[x, y, z]`, mm) and
    /// `voxel` (mm).
    pub fn read(path: &Path) -> Result<Self, MeshError> {
        let bytes = crate::regular_file::read(path).map_err(|source| MeshError::Io {
            path: path.into(),
            source,
        })?;
        let not_safetensors = |error: safetensors::SafeTensorError| MeshError::NotSafetensors {
            path: path.into(),
            reason: error.to_string(),
        };
        let field = |field: &str, reason: String| MeshError::Field {
            path: path.into(),
            field: field.into(),
            reason,
        };
        let (_, header) = SafeTensors::read_metadata(&bytes).map_err(not_safetensors)?;
        let metadata = header.metadata().clone().unwrap_or_default();
        let text = |key: &str| {
            metadata
                .get(key)
                .ok_or_else(|| field(key, "is missing".into()))
        };
        if text("format")? != "upt-distance-field" {
            return Err(field(
                "format",
                format!("is `{}`; expected `upt-distance-field`", metadata["format"]),
            ));
        }
        let origin: [f64; 3] = serde_json::from_str(text("origin")?)
            .map_err(|error| field("origin", error.to_string()))?;
        let voxel: f64 = serde_json::from_str(text("voxel")?)
            .map_err(|error| field("voxel", error.to_string()))?;
        if !(voxel.is_finite() && voxel > 0.0 && origin.iter().all(|x| x.is_finite())) {
            return Err(field(
                "voxel",
                "and `origin` must be finite, voxel above 0".into(),
            ));
        }
        let file = SafeTensors::deserialize(&bytes).map_err(not_safetensors)?;
        let tensor = file
            .tensor("distance")
            .map_err(|_| field("distance", "is missing".into()))?;
        let shape = match tensor.shape() {
            &[x, y, z] if x.min(y).min(z) >= 2 && tensor.dtype() == Dtype::F32 => [x, y, z],
            other => {
                return Err(field(
                    "distance",
                    format!(
                        "is {:?} {other:?}; expected F32 [nx, ny, nz], 2 or more each",
                        tensor.dtype()
                    ),
                ));
            }
        };
        Ok(Self {
            origin,
            voxel,
            shape,
            values: tensors::f32_values(tensor.data()).collect(),
        })
    }
}
