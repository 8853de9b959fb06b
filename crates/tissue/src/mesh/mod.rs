//! Tetrahedral meshes: what the solver, the schemes and the exporters read.
//!
//! Lengths are millimetres (RAS: x right, y anterior, z superior); `K` nodes,
//! `T` linear tetrahedra of positive volume, `F` boundary triangles oriented
//! outward. The file format is `docs/reference/formats.md`, "Mesh".

mod error;
mod file;
mod phantom;
mod topology;
mod validate;

pub use error::MeshError;
pub use phantom::{box_phantom, ellipsoid_phantom, regular_box};
pub use topology::{
    FaceAdjacency, boundary_faces, components, face_area, face_centroid, face_normal, face_values,
    tet_volume,
};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// A validated tetrahedral mesh with its named sets.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Short name, e.g. `brain`.
    pub name: String,
    /// How the mesh was made, free text.
    pub source: String,
    /// License of the anatomy, free text.
    pub license: String,
    /// `[K,3]` rest positions, mm.
    pub positions: Vec<[f32; 3]>,
    /// `[T,4]` node indices, positive volume.
    pub tets: Vec<[u32; 4]>,
    /// `[F,3]` boundary triangles, outward.
    pub surface: Vec<[u32; 3]>,
    /// Rows of `surface` that instruments may touch.
    pub domain: Vec<u32>,
    /// Nodes held at zero under either boundary condition, ascending.
    pub fixed: Vec<u32>,
    /// Nodes held in addition under [`Boundary::Supported`], ascending, disjoint from `fixed`.
    pub supported: Vec<u32>,
    /// `[T]` Young's modulus of each tetrahedron over the material's; empty where the body is uniform.
    pub stiffness: Vec<f32>,
    /// `[T]` 0 for a tetrahedron of the material's law, else one more than the place of its region in `regions`; empty where the body has one law.
    pub region: Vec<u8>,
    /// Regions with a law of their own.
    pub regions: Vec<elements::Region>,
    /// `[T]` directions of fibres at rest, unit vectors or zero for a tetrahedron without; empty where the body has none.
    pub fibre: Vec<[f32; 3]>,
}

/// Which nodes are held at zero displacement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Boundary {
    /// The set `fixed` alone: the paper's boundary condition.
    #[default]
    Fixed,
    /// `fixed` and `supported`: the surface outside the craniotomy window is held as well.
    Supported,
}

impl Boundary {
    /// The word used in files and on the command line.
    pub fn as_str(self) -> &'static str {
        match self {
            Boundary::Fixed => "fixed",
            Boundary::Supported => "supported",
        }
    }
}

impl std::str::FromStr for Boundary {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "fixed" => Ok(Boundary::Fixed),
            "supported" => Ok(Boundary::Supported),
            other => Err(format!(
                "boundary `{other}` is unknown; use `fixed` or `supported`"
            )),
        }
    }
}

impl Mesh {
    /// Number of nodes, `K`.
    pub fn node_count(&self) -> usize {
        self.positions.len()
    }

    /// What the element law needs.
    pub fn tetrahedra(&self) -> elements::Tetrahedra<'_> {
        elements::Tetrahedra {
            positions: &self.positions,
            tets: &self.tets,
            stiffness: &self.stiffness,
            laws: self.laws(),
        }
    }

    /// Which tetrahedra have which law.
    pub fn laws(&self) -> elements::Laws<'_> {
        elements::Laws {
            of_tet: &self.region,
            regions: &self.regions,
            fibre: &self.fibre,
        }
    }

    /// Checks the laws of the regions, and that those with a shear modulus of their own agree with the stiffness of their tetrahedra.
    pub fn check_laws(&self, material: &elements::Material) -> Result<(), elements::MaterialError> {
        self.laws()
            .check_with(self.tets.len(), &self.stiffness, material)
    }

    /// The laws of the regions as the file has them.
    fn laws_text(&self) -> String {
        serde_json::to_string(&self.regions).unwrap_or_default()
    }

    /// Young's modulus of tetrahedron `tet` over the material's.
    pub fn stiffness_of(&self, tet: usize) -> f32 {
        self.stiffness.get(tet).copied().unwrap_or(1.0)
    }

    /// Nodes held at zero under `boundary`, ascending, each once.
    pub fn held_nodes(&self, boundary: Boundary) -> Vec<u32> {
        let mut nodes = self.fixed.clone();
        if boundary == Boundary::Supported {
            nodes.extend_from_slice(&self.supported);
        }
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// Where tools touch the mesh: points of `domain` at most [`contact::SPACING_MM`] apart, without those that `boundary` holds.
    pub fn samples(&self, boundary: Boundary) -> contact::Samples {
        let held = self.held_nodes(boundary);
        contact::Samples::of_domain(
            &self.positions,
            &self.surface,
            &self.domain,
            &held,
            contact::SPACING_MM,
        )
    }

    /// SHA-256 (lower-case hex) over the bytes of `positions`, `tets`, `fixed`, `supported` and,
    /// where there is one, `stiffness`, `region` and the text `laws`, and `fibre`, as the file stores them. Identifies the mesh in trajectories, datasets and bundles.
    pub fn hash(&self) -> String {
        let mut digest = Sha256::new();
        for value in self.positions.iter().flatten() {
            digest.update(value.to_le_bytes());
        }
        for value in self.tets.iter().flatten() {
            digest.update((*value as i32).to_le_bytes());
        }
        for value in self.fixed.iter().chain(&self.supported) {
            digest.update((*value as i32).to_le_bytes());
        }
        for value in &self.stiffness {
            digest.update(value.to_le_bytes());
        }
        if !self.region.is_empty() {
            for number in &self.region {
                digest.update(i32::from(*number).to_le_bytes());
            }
            digest.update(self.laws_text());
        }
        for value in self.fibre.iter().flatten() {
            digest.update(value.to_le_bytes());
        }
        digest
            .finalize()
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect()
    }
}
