//! Linear elasticity by a bundle's own tables, without what the bundle learned: `u = L(c)` in contact, a fitted decay after
//! a release. What the factorised baseline computes, at the run time of the library's kernels.

use std::sync::Arc;

use anyhow::{Context, Result};
use upt::bundle::{BundleFiles, Mesh};
use upt::kernels::rows::{RowPlan, decode_rows};
use upt::kernels::{Isa, Pool};
use upt::prior::{ContactResponse, PriorTable};

use crate::bundle_folder::BundleFolder;

pub struct PriorAlone {
    mesh: Arc<Mesh>,
    table: PriorTable,
    response: ContactResponse,
    rows: RowPlan,
    held: Vec<bool>,
    pool: Pool,
    isa: Isa,
    decay: f32,
    coordinates: Vec<f32>,
    state: Vec<[f32; 3]>,
}

impl PriorAlone {
    /// Whether the bundle has tables of the linear response.
    pub fn available(bundle: &BundleFolder) -> bool {
        BundleFiles::open(&bundle.path).is_ok_and(|files| files.manifest.prior.is_some())
    }

    /// Reads the tables. `decay` is the factor a step after a release.
    pub fn new(bundle: &BundleFolder, decay: f32, threads: u32) -> Result<Self> {
        let files = BundleFiles::open(&bundle.path)?;
        let entry = files.manifest.prior.as_ref().with_context(|| {
            format!(
                "{}: field `prior` is missing in bundle.json: no linear response to run alone",
                bundle.name
            )
        })?;
        let mesh = Mesh::parse(
            &files.tensors(&files.manifest.mesh.file)?,
            files.manifest.boundary,
        )?;
        let table = PriorTable::open(&files, entry, &mesh)?;
        let mut held = vec![false; mesh.node_count()];
        for node in &mesh.held_nodes {
            held[*node as usize] = true;
        }
        Ok(Self {
            response: ContactResponse::new(&table)?,
            rows: RowPlan::full(&table.basis()),
            held,
            pool: Pool::new(threads as usize)?,
            isa: Isa::detect(),
            decay,
            coordinates: vec![0.0; table.width()],
            state: vec![[0.0; 3]; mesh.node_count()],
            table,
            mesh: Arc::new(mesh),
        })
    }

    /// The bundle's mesh.
    pub fn mesh(&self) -> &Arc<Mesh> {
        &self.mesh
    }

    /// The tables.
    pub fn table(&self) -> &PriorTable {
        &self.table
    }

    /// Whether each node is held, `[K]`.
    pub fn held(&self) -> &[bool] {
        &self.held
    }

    /// Back to rest.
    pub fn reset(&mut self) {
        self.state.fill([0.0; 3]);
    }

    /// One step: `nodes` end it at `vectors` (mm). `out` `[K,3]`.
    pub fn step(
        &mut self,
        nodes: &[u32],
        vectors: &[[f32; 3]],
        out: &mut [[f32; 3]],
    ) -> Result<()> {
        if nodes.is_empty() {
            for u in self.state.as_flattened_mut() {
                *u *= self.decay;
            }
        } else {
            let (isa, pool, table) = (self.isa, &self.pool, &self.table);
            self.response
                .solve(isa, table, &self.held, nodes, vectors.as_flattened())?;
            self.response
                .field(isa, pool, table, &mut self.coordinates)?;
            let field = self.state.as_flattened_mut();
            decode_rows(
                isa,
                pool,
                &table.basis(),
                &self.rows,
                &self.coordinates,
                field,
            )?;
            for (node, vector) in nodes.iter().zip(vectors) {
                self.state[*node as usize] = *vector;
            }
        }
        out.copy_from_slice(&self.state);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;
    use tissue::baselines::LinearQuasiStatic;
    use tissue::linear::Lame;

    /// A bundle's compressed tables against a factorisation of its mesh: one push, one frame after the release.
    #[test]
    fn the_tables_answer_as_the_factorised_stiffness_does() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../onnx/brain-coarse-reduced");
        let bundle = BundleFolder::read(&folder).unwrap();
        let mesh = tissue::mesh::Mesh::read(&bundle.mesh_file).unwrap();
        let material = tissue::material::Material::default();
        let lame = Lame::from_young(material.young_pa, material.poisson).unwrap();
        let boundary = bundle.boundary.parse().unwrap();
        let mut exact = LinearQuasiStatic::new(&mesh, boundary, lame, 0.5, 1).unwrap();
        let mut tables = PriorAlone::new(&bundle, 0.5, 1).unwrap();

        let mut nodes: Vec<u32> = mesh.domain[..12]
            .iter()
            .flat_map(|face| mesh.surface[*face as usize])
            .collect();
        nodes.sort_unstable();
        nodes.dedup();
        let push = vec![[3.0, 1.0, -0.5]; nodes.len()];
        let zero = vec![[0.0; 3]; mesh.node_count()];
        let (mut a, mut b) = (zero.clone(), zero);
        for (nodes, vectors) in [(&nodes[..], &push[..]), (&[], &[])] {
            exact.step(nodes, vectors, &mut a).unwrap();
            tables.step(nodes, vectors, &mut b).unwrap();
            let values = a.as_flattened().iter().zip(b.as_flattened());
            let (error, size) = values.fold((0.0, 0.0), |(error, size), (a, b)| {
                (error + (a - b) * (a - b), size + a * a)
            });
            let relative = (error / size).sqrt();
            assert!(relative < 0.01, "relative difference {relative}");
        }
    }
}
