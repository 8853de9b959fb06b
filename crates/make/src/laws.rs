//! `--material REGION=LAW`: regions with a law of their own; `--fibre REGION=X,Y,Z`: directions of fibres.

use std::path::Path;

use anyhow::{Context, Result, bail};
use elements::{MOST_REGIONS, Material, Region as LawRegion};
use tissue::mesh::Mesh;
use tissue::mesh_import::{Region, tets_in};

use super::material::Choice;
use super::options::Options;
use super::stages::Stage;

/// Gives the tetrahedra of the regions their laws, and the stiffness of laws that have a modulus of their own.
pub fn apply(
    mesh: &mut Mesh,
    options: &Options,
    (input, scale): (&Path, f64),
    stage: &mut Stage,
) -> Result<()> {
    let chosen: Vec<&LawRegion> = (options.material.iter())
        .filter_map(|choice| match choice {
            Choice::Law(region, _) => Some(region.as_ref()),
            Choice::Numbers(_) => None,
        })
        .collect();
    give_directions(mesh, options, (input, scale), stage)?;
    let has_fibres =
        |name: &str| (options.fibre.iter()).any(|own| own.name.as_deref() == Some(name));
    for region in &options.region {
        let name = region.name.as_deref().with_context(|| {
            format!("--region {region} has no name; write --region NAME=REGION")
        })?;
        if !chosen.iter().any(|own| own.name == name) && !has_fibres(name) {
            bail!("region `{name}` has no law; give --material {name}=LAW");
        }
    }
    let material = options.material()?;
    for own in chosen {
        let rows = tets_of(mesh, options, (input, scale), &own.name)?;
        if rows.is_empty() {
            bail!("no tetrahedron lies in region `{}` of --material", own.name);
        }
        take(mesh, own, &rows, &material)?;
        let source = match own.source.is_empty() {
            true => String::new(),
            false => format!(", from {}", own.source),
        };
        let density = match own.density_kg_m3 {
            None => String::new(),
            Some(density) => format!(" and {density} kg/m³"),
        };
        let relaxation = match own.relaxation {
            None => String::new(),
            Some(own) if own.is_empty() => " and do not relax".into(),
            Some(own) => format!(" and the relaxation {own}"),
        };
        stage.decided(&format!(
            "{} tetrahedra of region `{}` have the law {}{source}{density}{relaxation}",
            rows.len(),
            own.name,
            own.law
        ));
    }
    mesh.check_laws(&material)?;
    Ok(())
}

/// Gives tetrahedra their directions; those of the mesh file stay where no option names them.
fn give_directions(
    mesh: &mut Mesh,
    options: &Options,
    from: (&Path, f64),
    stage: &mut Stage,
) -> Result<()> {
    for own in &options.fibre {
        let (rows, what) = match &own.name {
            None => ((0..mesh.tets.len()).collect(), String::from("the body")),
            Some(name) => (
                tets_of(mesh, options, from, name)?,
                format!("region `{name}`"),
            ),
        };
        if rows.is_empty() {
            bail!("no tetrahedron lies in {what} of --fibre {own}");
        }
        mesh.fibre.resize(mesh.tets.len(), [0.0; 3]);
        rows.iter().for_each(|&row| mesh.fibre[row] = own.direction);
        let [x, y, z] = own.direction;
        stage.decided(&format!(
            "{} tetrahedra of {what} have fibres along {x:.3}, {y:.3}, {z:.3}",
            rows.len()
        ));
    }
    Ok(())
}

/// The tetrahedra of a region by name: as `--region` has it, else as the mesh file has it, else a group of the input.
fn tets_of(
    mesh: &Mesh,
    options: &Options,
    (input, scale): (&Path, f64),
    name: &str,
) -> Result<Vec<usize>> {
    let mut rows = Vec::new();
    let named = || (options.region.iter()).filter(|region| region.name.as_deref() == Some(name));
    for region in named() {
        rows.extend(tets_in(mesh, &region.region.open(input, scale)?));
    }
    if named().next().is_some() {
        rows.sort_unstable();
        rows.dedup();
        return Ok(rows);
    }
    if let Some(at) = mesh.regions.iter().position(|region| region.name == name) {
        let is_own = |row: &usize| usize::from(mesh.region[*row]) == at + 1;
        return Ok((0..mesh.tets.len()).filter(is_own).collect());
    }
    let group = Region::Group(name.to_owned()).open(input, scale);
    let group = group.with_context(|| {
        format!("`{name}`: there is no region of that name; give --region {name}=REGION")
    })?;
    Ok(tets_in(mesh, &group))
}

fn take(mesh: &mut Mesh, own: &LawRegion, rows: &[usize], material: &Material) -> Result<()> {
    mesh.region.resize(mesh.tets.len(), 0);
    let at = match mesh
        .regions
        .iter()
        .position(|region| region.name == own.name)
    {
        Some(at) => {
            mesh.regions[at] = own.clone();
            at
        }
        None => {
            mesh.regions.push(own.clone());
            mesh.regions.len() - 1
        }
    };
    if at >= MOST_REGIONS {
        bail!("more than {MOST_REGIONS} regions have a law of their own");
    }
    let before = |row: &usize| mesh.region[*row];
    let was_plain = rows.iter().all(|row| before(row) == 0);
    let modulus = own.law.young_pa(material.poisson);
    let uneven = rows.iter().any(|row| mesh.stiffness_of(*row) != 1.0);
    if modulus.is_some() && uneven && was_plain {
        bail!(
            "region `{}` has a law with a modulus of its own, and another stiffness by --stiffness or its mesh file: give one of them",
            own.name
        );
    }
    rows.iter().for_each(|&row| mesh.region[row] = at as u8 + 1);
    if let Some(young) = modulus {
        mesh.stiffness.resize(mesh.tets.len(), 1.0);
        let factor = (young / material.young_pa) as f32;
        rows.iter().for_each(|&row| mesh.stiffness[row] = factor);
    }
    Ok(())
}
