//! A bundle's body, factorised, with its linear response and natural modes: what coarse spaces are made on.

use std::path::Path;

use anyhow::{Context, Result, bail};
use elements::{ElementForces, Isa, Material};
use serde_json::Value;
use tissue::linear::{
    ColumnsFile, Factor, Lame, NaturalModes, Stiffness, compliance_columns, natural_modes,
};
use tissue::mesh::{Boundary, Mesh};
use upt::bundle::{BundleFiles, file_of};
use upt::prior::{CoarseSpace, PriorTable};

use super::pushes::Pushes;
use super::space::Space;
use super::whole::{self, Source};
use super::{FILE, manifest};
use crate::Watch;
use crate::modes;
use yardstick::manifest::Manifest;

/// Columns that are solved for together: each takes several times its length.
const SOLVED: usize = 96;

/// What files already hold of the same body.
#[derive(Default)]
pub struct Known<'a> {
    /// What `upt modes` wrote; without it the modes are found with the factor.
    pub modes: Option<&'a Path>,
    /// What `upt prior` wrote; without it a contact's columns are solved for.
    pub columns: Option<&'a Path>,
}

pub struct Workbench {
    pub mesh: Mesh,
    pub boundary: Boundary,
    pub material: Material,
    /// The same as the bundle's steps see it, where it relaxes.
    pub stepped: Material,
    pub prior: PriorTable,
    pub stiffness: Stiffness,
    pub factor: Factor,
    natural: NaturalModes,
    columns: Option<ColumnsFile>,
    pub held: Vec<u32>,
    pub held_flags: Vec<bool>,
    push_mm: f64,
    area_mm2: [f64; 2],
}

impl Workbench {
    /// Reads the bundle, factorises its stiffness and takes `natural` modes, or those that are known.
    pub fn open(
        bundle: &Path,
        natural: usize,
        known: &Known<'_>,
        threads: usize,
        watch: &Watch,
    ) -> Result<Self> {
        let files = BundleFiles::open(bundle)?;
        let stated = &files.manifest;
        let Some(entry) = &stated.prior else {
            bail!(
                "{}: bundle.json has no `prior`; corrections need a linear response",
                bundle.display()
            );
        };
        let boundary = match stated.boundary {
            upt::bundle::Boundary::Fixed => Boundary::Fixed,
            upt::bundle::Boundary::Supported => Boundary::Supported,
        };
        let mesh = Mesh::read(&file_of(bundle, stated.body.as_deref(), &stated.mesh.file))?;
        let held = mesh.held_nodes(boundary);
        let material = stated.material;
        let stepped = stated.step_material();
        let lame = Lame::from_young(stepped.young_pa, stepped.poisson)?;

        let bar = watch.spinner("factorisation");
        let stiffness = Stiffness::assemble(&mesh, &held, lame)?;
        let factor = Factor::new(&stiffness, &mesh.positions, threads)?;
        drop(bar);
        let natural = match known.modes {
            Some(path) => modes::read(path)?,
            None => {
                let bar = watch.spinner("natural modes: solves with the factor");
                let density = material.density_kg_m3;
                let done = || {
                    bar.inc(1);
                    true
                };
                let found = natural_modes(&mesh, &stiffness, &factor, density, natural, &done)?;
                drop(bar);
                found
            }
        };
        // After the factorisation, which needs the most memory.
        let runtime_mesh =
            upt::bundle::Mesh::parse(&files.tensors(&stated.mesh.file)?, stated.boundary)?;
        let prior = PriorTable::open(&files, entry, &runtime_mesh)?;
        let (young, poisson) = (stepped.young_pa, stepped.poisson);
        let open = |path| ColumnsFile::open(path, &mesh, boundary, young, poisson);
        let columns = known.columns.map(open).transpose()?;
        let mut held_flags = vec![false; mesh.node_count()];
        held.iter()
            .for_each(|&node| held_flags[node as usize] = true);
        Ok(Self {
            boundary,
            material,
            stepped,
            prior,
            stiffness,
            factor,
            natural,
            columns,
            held,
            held_flags,
            push_mm: f64::from(stated.envelope.max_push_mm),
            area_mm2: stated.envelope.contact_area_mm2.map(f64::from),
            mesh,
        })
    }

    /// Displacement of all nodes by a unit force at each degree of freedom of free `nodes`, `[3m,3K]`, mm/mN: read where a file has
    /// them, solved for otherwise.
    pub fn responses(&self, nodes: &[u32]) -> Result<Vec<f32>> {
        if let Some(file) = &self.columns {
            let row = |node: &u32| file.compliance.nodes.binary_search(node).ok();
            if let Some(rows) = nodes.iter().map(row).collect::<Option<Vec<usize>>>() {
                return Ok(file.columns(&rows)?);
            }
        }
        let is_free = |&&node: &&u32| self.stiffness.free.get(node).is_some();
        let nodes: Vec<u32> = nodes.iter().filter(is_free).copied().collect();
        let mut found = Vec::with_capacity(9 * self.mesh.node_count() * nodes.len());
        compliance_columns(&self.stiffness, &self.factor, &nodes, SOLVED, |_, rows| {
            found.extend_from_slice(rows);
            Ok(())
        })?;
        Ok(found)
    }

    /// Pushes of the bundle's envelope.
    pub fn pushes(&self) -> Pushes<'_> {
        Pushes {
            mesh: &self.mesh,
            nodes: &self.prior.contact_nodes,
            held: &self.held_flags,
            push_mm: self.push_mm,
            area_mm2: self.area_mm2,
        }
    }

    pub fn element_forces(&self) -> Result<ElementForces> {
        let made = ElementForces::new(self.mesh.tetrahedra(), &self.stepped, Isa::detect());
        Ok(made?)
    }

    /// Writes the natural modes and `more` (in block coordinates) as the coarse space of a copy of the bundle, with the manifest's
    /// entry; returns the number of modes.
    pub fn write_space(
        &self,
        bundle: &Path,
        more: impl Iterator<Item = Vec<f32>>,
        entry: &Value,
    ) -> Result<usize> {
        let density = self.material.density_kg_m3;
        let mut space = Space::new(&self.prior, &self.stiffness, &self.mesh, density);
        let frequency = space.add_natural(&self.natural)?;
        space.add(more);
        let path = bundle.join(FILE);
        let count = space
            .write(&path, &frequency)
            .with_context(|| format!("{}: cannot be written", path.display()))?;
        // What the space of before lacks is not what this one does.
        let mut entry = entry.clone();
        if let Some(keys) = entry.as_object_mut() {
            keys.remove(whole::KEY);
        }
        manifest::add(bundle, FILE, &entry)?;
        manifest::forget(bundle, whole::FILE)?;
        Ok(count)
    }

    /// Writes as whole fields what the coarse space of a bundle lacks of the natural modes; returns how many they are. None is no file.
    pub fn write_whole(&self, bundle: &Path) -> Result<usize> {
        let files = BundleFiles::open(bundle)?;
        let Some(mut entry) = Manifest::read(bundle)?.get::<Value>("corrections")? else {
            bail!(
                "{}: has no corrections whose modes to complete; leave --keep out to make them",
                bundle.display()
            );
        };
        let space = CoarseSpace::parse(&files.tensors(FILE)?, &self.prior, Isa::detect())?;
        let source = Source {
            mesh: &self.mesh,
            stiffness: &self.stiffness,
            natural: &self.natural,
            prior: &self.prior,
            space: &space,
            density_kg_m3: self.material.density_kg_m3,
        };
        let count = whole::write(&source, &bundle.join(whole::FILE))?;
        if count > 0 {
            entry[whole::KEY] = whole::FILE.into();
            manifest::add(bundle, FILE, &entry)?;
            manifest::list(bundle, whole::FILE, "corrections", |_| Ok(()))?;
        } else if let Some(keys) = entry.as_object_mut() {
            keys.remove(whole::KEY);
            manifest::add(bundle, FILE, &entry)?;
            manifest::forget(bundle, whole::FILE)?;
        }
        Ok(count)
    }
}
