//! A bundle of a report, before it is loaded: what its manifest says.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use tissue::material::Material;
use tissue::trajectory::TrajectoryHeader;
use upt::kernels::decoder::DecoderPrecision;

use crate::setting::Precision;
use host::Effort;

/// A bundle on disk, as its manifest describes it.
#[derive(Clone, Debug)]
pub struct BundleFolder {
    pub path: PathBuf,
    pub name: String,
    pub boundary: String,
    pub mesh_sha256: String,
    pub material: Material,
    pub mesh_file: PathBuf,
    pub sha256: String,
    /// Float32, the variants of the graphs that the manifest lists, and bfloat16 where kind and CPU have it.
    pub precisions: Vec<Precision>,
    /// Corrections a step that the manifest recommends; none where the bundle has no tables for them.
    pub corrections: Option<Effort>,
}

impl BundleFolder {
    pub fn read(path: &Path) -> Result<Self> {
        let file = path.join("bundle.json");
        let bytes = std::fs::read(&file).with_context(|| {
            format!(
                "{}: cannot be read; a bundle is a folder with a bundle.json",
                file.display()
            )
        })?;
        let fields: serde_json::Value = serde_json::from_slice(&bytes)
            .with_context(|| format!("{}: is not JSON", file.display()))?;
        let text = |value: &serde_json::Value, name: &str| {
            value
                .as_str()
                .map(str::to_owned)
                .with_context(|| format!("{}: field `{name}` is missing", file.display()))
        };
        let listed = |name: &str| {
            let list = fields["precisions"].as_array();
            list.is_some_and(|list| list.iter().any(|one| one == name))
        };
        let mut precisions = vec![Precision::F32];
        if fields["kind"] == "upt" && DecoderPrecision::fastest_bf16() != DecoderPrecision::F32 {
            precisions.push(Precision::Bf16);
        }
        for narrow in [Precision::F16, Precision::Int8] {
            if listed(narrow.name()) {
                precisions.push(narrow);
            }
        }
        use sha2::Digest;
        Ok(Self {
            precisions,
            corrections: fields["corrections"]["recommended"]
                .as_u64()
                .map(|count| Effort {
                    most: count as u32,
                    target_mm: fields["corrections"]["target_mm"].as_f64().unwrap_or(0.0) as f32,
                    substeps: 0,
                }),
            path: path.to_path_buf(),
            name: text(&fields["name"], "name")?,
            boundary: text(&fields["boundary"], "boundary")?,
            mesh_sha256: text(&fields["mesh"]["mesh_sha256"], "mesh.mesh_sha256")?,
            material: serde_json::from_value(fields["material"].clone())
                .with_context(|| format!("{}: field `material`", file.display()))?,
            mesh_file: upt::bundle::file_of(
                path,
                fields["body"].as_str(),
                &text(&fields["mesh"]["file"], "mesh.file")?,
            ),
            sha256: format!("{:x}", sha2::Sha256::digest(&bytes)),
        })
    }

    /// Why errors on a case would say nothing about the bundle: it is made for another mesh, boundary or tissue.
    pub fn misfit(&self, case: &TrajectoryHeader) -> Option<String> {
        let name = &self.name;
        if self.mesh_sha256 != case.mesh_sha256 {
            return Some(format!(
                "{name}: made for a mesh other than that of the cases ({})",
                case.mesh_name
            ));
        }
        if self.boundary != case.boundary {
            return Some(format!(
                "{name}: made for the boundary `{}`, but the cases have `{}`",
                self.boundary, case.boundary
            ));
        }
        let [own, theirs] = [&self.material, &case.material];
        (!is_one_tissue(own, theirs)).then(|| {
            format!(
                "{name}: made for {}, but the cases have {}; simulate them with --young, --poisson, --density, --law and --relaxation",
                tissue_of(own),
                tissue_of(theirs)
            )
        })
    }
}

/// Whether two materials differ in nothing but damping, which a scene takes from its options.
pub fn is_one_tissue(a: &Material, b: &Material) -> bool {
    let damping_per_s = a.damping_per_s;
    *a == Material {
        damping_per_s,
        ..*b
    }
}

fn tissue_of(material: &Material) -> String {
    let law = serde_json::to_string(&material.law).unwrap_or_default();
    let relaxation = match material.relaxation.is_empty() {
        true => String::new(),
        false => format!(", relaxation {}", material.relaxation),
    };
    format!(
        "E = {} Pa, nu = {}, {} kg/m³, law {law}{relaxation}",
        material.young_pa, material.poisson, material.density_kg_m3
    )
}
