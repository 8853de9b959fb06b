//! `mesh.safetensors`: the tetrahedral mesh of a bundle, checked, and the node sets that follow from it.

use sha2::{Digest, Sha256};

use super::domain::Domain;
use super::files::hex;
use super::geometry::volume;
use super::laws::ElementLaws;
use super::manifest::Boundary;
use super::node_set::{NodeSet, unique};
use super::surface::Surface;
use super::tensors::TensorFile;
use field::error::{Error, Result};
use field::memory::{self, HeldBytes};
use safetensors::Dtype;

const WHAT: &str = "a mesh";
/// Support groups at most.
/// Which groups are let go is kept as one bit each in a `u64`. Named regions have the same limit.
const MOST_SUPPORTS: usize = 64;

/// A checked mesh; lengths in mm.
#[derive(Debug, HeldBytes)]
pub struct Mesh {
    /// Rest positions `[K,3]`.
    pub positions: Vec<f32>,
    /// Tetrahedra `[T,4]`.
    pub tets: Vec<u32>,
    /// What each tetrahedron is made of.
    pub laws: ElementLaws,
    /// The boundary of the intact body.
    pub surface: Surface,
    /// What tools may touch.
    pub domain: Domain,
    /// Nodes held at zero, ascending.
    pub held_nodes: Vec<u32>,
    /// Parts of them that move apart from the others.
    pub supports: Vec<NodeSet>,
    /// Named parts of the surface.
    pub regions: Vec<NodeSet>,
    /// The mesh hash of `docs/reference/formats.md`.
    pub sha256: String,
}

impl Mesh {
    /// Reads and checks a mesh.
    ///
    /// `boundary` says which of the file's two lists of nodes are held: the fixed ones, or the
    /// supported ones as well. Groups and regions are named by the manifest and come later
    /// ([`Mesh::take_named`]).
    ///
    /// # Errors
    /// [`Error::Version`], and [`Error::Bundle`] with the tensor and the element that is at fault.
    pub fn parse(file: &TensorFile, boundary: Boundary) -> Result<Mesh> {
        let text = file.text();
        if text.get("format").map(String::as_str) != Some("upt-mesh") {
            return Err(Error::bundle(
                file.name(),
                "metadata `format` must be `upt-mesh`",
            ));
        }
        if text.get("version").map(String::as_str) != Some("1") {
            return Err(Error::Version(format!(
                "{}: metadata `version` is {:?}, this library reads version 1",
                file.name(),
                text.get("version")
            )));
        }
        let positions = file.f32("positions", &[None, Some(3)])?;
        let count = positions.len() / 3;
        if count < 4 {
            return Err(file.bad("positions", "needs at least 4 nodes"));
        }
        let tets = file.indices("tets", &[None, Some(4)], count)?;
        if let Some(at) = tets
            .chunks_exact(4)
            .position(|tet| volume(&positions, tet) <= 0.0)
        {
            return Err(file.bad("tets", format!("element {at} has no positive volume")));
        }
        let laws = ElementLaws::read(file, tets.len() / 4)?;
        let surface_faces = file.indices("surface", &[None, Some(3)], count)?;
        let domain = if file.has("domain") {
            file.indices("domain", &[None], surface_faces.len() / 3)?
        } else {
            Vec::new()
        };
        let corners = domain.iter().flat_map(|&face| {
            surface_faces[3 * face as usize..3 * face as usize + 3]
                .iter()
                .copied()
        });
        let domain_faces = memory::collected(3 * domain.len(), corners, WHAT)?;
        let set = |name: &str| {
            if file.has(name) {
                file.ascending(name, count)
            } else {
                Ok(Vec::new())
            }
        };
        let fixed = set("fixed")?;
        let supported = set("supported")?;
        // Of what the motion depends on, in a fixed order: a list that is absent adds nothing, so
        // that meshes from before it existed keep their hash. The surface is left out, since the
        // tetrahedra have it.
        let mut hash = Sha256::new();
        hash.update(file.raw("positions", Dtype::F32, &[None, Some(3)])?);
        hash.update(file.raw("tets", Dtype::I32, &[None, Some(4)])?);
        for name in ["fixed", "supported"] {
            if file.has(name) {
                hash.update(file.raw(name, Dtype::I32, &[None])?);
            }
        }
        if file.has("stiffness") {
            hash.update(file.raw("stiffness", Dtype::F32, &[None])?);
        }
        if file.has("region") {
            hash.update(file.raw("region", Dtype::I32, &[None])?);
            hash.update(text.get("laws").map_or("", String::as_str));
        }
        if file.has("fibre") {
            hash.update(file.raw("fibre", Dtype::F32, &[None, Some(3)])?);
        }
        let mut held_nodes = fixed;
        if boundary == Boundary::Supported {
            memory::reserve(&mut held_nodes, supported.len(), WHAT)?;
            held_nodes.extend(supported);
        }
        Ok(Mesh {
            surface: Surface::of(&positions, surface_faces)?,
            domain: Domain::of(domain_faces)?,
            held_nodes: unique(held_nodes),
            positions,
            tets,
            laws,
            sha256: hex(&hash.finalize()),
            supports: Vec::new(),
            regions: Vec::new(),
        })
    }

    /// What the element law needs.
    pub fn tetrahedra(&self) -> elements::Tetrahedra<'_> {
        elements::Tetrahedra {
            positions: self.positions.as_chunks().0,
            tets: self.tets.as_chunks().0,
            stiffness: &self.laws.stiffness,
            laws: self.laws.view(),
        }
    }

    /// Takes the support groups and the regions of the bundle that it is of.
    ///
    /// # Errors
    /// [`Error::Bundle`] with the group or region.
    pub fn take_named(&mut self, supports: &[NodeSet], regions: &[NodeSet]) -> Result<()> {
        self.take_supports(supports)?;
        self.take_regions(regions)
    }

    /// Takes the support groups of the bundle that it is of.
    ///
    /// # Errors
    /// [`Error::Bundle`] with the group.
    fn take_supports(&mut self, groups: &[NodeSet]) -> Result<()> {
        let bad = |index: usize, problem: String| {
            Err(Error::bundle(
                "bundle.json",
                format!("field `supports[{index}]` {problem}"),
            ))
        };
        if groups.len() > MOST_SUPPORTS {
            return bad(MOST_SUPPORTS, format!("is one more than {MOST_SUPPORTS}"));
        }
        for (index, group) in groups.iter().enumerate() {
            // Each pair of groups is compared once, by the later one.
            let others = &groups[..index];
            if group.name.is_empty() || others.iter().any(|other| other.name == group.name) {
                return bad(
                    index,
                    format!("has the name `{}`, must have one of its own", group.name),
                );
            }
            if group.nodes.is_empty() || !group.nodes.is_sorted_by(|a, b| a < b) {
                return bad(index, "must have nodes, ascending".into());
            }
            for node in &group.nodes {
                if self.held_nodes.binary_search(node).is_err() {
                    return bad(index, format!("has node {node}, which is not held"));
                }
                if others
                    .iter()
                    .any(|other| other.nodes.binary_search(node).is_ok())
                {
                    return bad(index, format!("has node {node}, which another group has"));
                }
            }
        }
        self.supports = memory::collected(groups.len(), groups.iter().cloned(), WHAT)?;
        Ok(())
    }

    /// Takes the named regions of the bundle that it is of.
    ///
    /// # Errors
    /// [`Error::Bundle`] with the region.
    fn take_regions(&mut self, regions: &[NodeSet]) -> Result<()> {
        let bad = |index: usize, problem: String| {
            Err(Error::bundle(
                "bundle.json",
                format!("field `regions[{index}]` {problem}"),
            ))
        };
        if regions.len() > MOST_SUPPORTS {
            return bad(MOST_SUPPORTS, format!("is one more than {MOST_SUPPORTS}"));
        }
        for (index, region) in regions.iter().enumerate() {
            // Unlike groups, regions may overlap: they are names for parts of the surface, and move
            // nothing.
            let mut others = regions[..index].iter();
            if region.name.is_empty() || others.any(|other| other.name == region.name) {
                return bad(
                    index,
                    format!("has the name `{}`, must have one of its own", region.name),
                );
            }
            let is_in = |node: &u32| region.nodes.binary_search(node).is_ok();
            let faces = self.surface.faces.as_chunks::<3>().0;
            if !region.nodes.is_sorted_by(|a, b| a < b)
                || !faces.iter().any(|face| face.iter().all(is_in))
            {
                return bad(
                    index,
                    "must have the nodes of at least one boundary triangle, ascending".into(),
                );
            }
            if let Some(node) =
                (region.nodes.iter()).find(|node| **node as usize >= self.node_count())
            {
                return bad(index, format!("has node {node}, which the mesh lacks"));
            }
        }
        self.regions = memory::collected(regions.len(), regions.iter().cloned(), WHAT)?;
        Ok(())
    }

    /// Number of nodes, `K`.
    pub fn node_count(&self) -> usize {
        self.positions.len() / 3
    }

    /// Rest position of a node, mm.
    pub fn position(&self, node: u32) -> [f32; 3] {
        let i = 3 * node as usize;
        [
            self.positions[i],
            self.positions[i + 1],
            self.positions[i + 2],
        ]
    }
}
