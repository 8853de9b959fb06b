//! Named sets of a mesh by regions: what is held, what may be touched, where the skull is open.

use std::path::Path;

use anyhow::{Result, bail};
use tissue::mesh::Mesh;
use tissue::mesh_import::{ImportError, Opened, Region, faces_in, nodes_in};
use tissue::mesh_quality::measure;

use make::regions;

/// Fills the sets: nodes in `fixed`, faces with their centroid in `domain`, and of the surface's nodes those outside `window` that are
/// not fixed (without a window none). `input` is the file that the mesh came from, `scale` millimetres a unit.
pub fn select(
    mesh: &mut Mesh,
    [fixed, domain, window]: [&[Region]; 3],
    input: &Path,
    scale: f64,
) -> Result<()> {
    let open = |regions: &[Region]| -> Result<Vec<Opened>, ImportError> {
        let opened = regions.iter().map(|region| region.open(input, scale));
        opened.collect()
    };
    mesh.fixed = nodes_in(mesh, &open(fixed)?);
    mesh.domain = faces_in(mesh, &open(domain)?);
    for (name, what, asked, found) in [
        ("--fixed", "node", fixed, mesh.fixed.len()),
        ("--domain", "face of the surface", domain, mesh.domain.len()),
    ] {
        if !asked.is_empty() && found == 0 {
            let span = regions::span(&measure(mesh));
            bail!("no {what} lies in the region of {name}; the body spans {span}");
        }
    }
    if !window.is_empty() {
        let mut inside = vec![false; mesh.node_count()];
        let taken = nodes_in(mesh, &open(window)?);
        (taken.iter().chain(&mesh.fixed)).for_each(|&node| inside[node as usize] = true);
        let mut supported = mesh.surface.as_flattened().to_vec();
        supported.sort_unstable();
        supported.dedup();
        supported.retain(|&node| !inside[node as usize]);
        mesh.supported = supported;
    }
    Ok(())
}
