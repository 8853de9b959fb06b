//! The body: the input as tetrahedra, what is held and what may be touched, and whether it is fit for simulation.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use foreign::labels::{Said, convert};
use tissue::mesh::{Boundary, Mesh, face_area};
use tissue::mesh_import::{
    ImportError, ImportOptions, Opened, Region, Resolution, faces_in, import, nodes_in, tets_in,
};
use tissue::mesh_quality::measure;

use super::fixed;
use super::laws;
use super::options::Options;
use super::stages::Stage;
use super::unload::unload;
use crate::regions::span;

/// A body's longest side, mm: outside of this the unit is taken to be wrong.
const LENGTH_MM: [f64; 2] = [3.0, 2000.0];
/// Tetrahedra with a smaller dihedral angle make the reference solver's step too short.
const SMALLEST_ANGLE_DEG: f64 = 2.0;
/// The rim around what is held that is not touched, in mean surface edges.
const RIM_EDGES: f64 = 1.5;

/// Writes `mesh.safetensors` with its sets.
pub fn make(options: &Options, stage: &mut Stage) -> Result<()> {
    let (mut mesh, input) = read(options, stage)?;
    let mut groups = Vec::new();
    check_length(&mesh, options)?;
    let scale = options.scale()?;
    let open = |regions: &[Region]| -> Result<Vec<Opened>, ImportError> {
        regions
            .iter()
            .map(|region| region.open(&input, scale))
            .collect()
    };
    if !options.fixed.is_empty() {
        let held: Vec<Vec<u32>> = (options.fixed.iter())
            .map(|fixed| Ok(nodes_in(&mesh, &[fixed.region.open(&input, scale)?])))
            .collect::<Result<_, ImportError>>()?;
        mesh.fixed = held.concat();
        mesh.fixed.sort_unstable();
        mesh.fixed.dedup();
        groups = fixed::groups(&options.fixed, &held)?;
        mesh.supported.clear();
        if mesh.fixed.is_empty() {
            bail!(
                "no node lies in the region of --fixed; the body spans {}",
                span(&measure(&mesh))
            );
        }
    }
    if mesh.fixed.is_empty() {
        bail!(
            "nothing is held, so nothing resists a push: {}",
            suggestion(&mesh)
        );
    }
    if options.boundary == Boundary::Supported && mesh.supported.is_empty() {
        bail!(
            "--boundary supported: {} has no set `supported`; only a mesh file (.mesh.safetensors) can have one, and --fixed replaces both sets",
            options.input.display()
        );
    }
    if mesh.held_nodes(options.boundary).len() == mesh.node_count() {
        bail!("--fixed holds every node; hold only a part of the body");
    }
    for (region, factor) in &options.stiffness {
        let rows = tets_in(&mesh, &region.open(&input, scale)?);
        if rows.is_empty() {
            bail!("no tetrahedron lies in the region of --stiffness {region}={factor}");
        }
        mesh.stiffness.resize(mesh.tets.len(), 1.0);
        rows.iter().for_each(|&row| mesh.stiffness[row] = *factor);
        stage.decided(&format!(
            "{} tetrahedra have {factor} times the stiffness ({region})",
            rows.len()
        ));
    }
    laws::apply(&mut mesh, options, (&input, scale), stage)?;
    choose_domain(&mut mesh, options, &open(&options.domain)?, stage)?;
    let inside: Vec<Vec<u32>> = (options.pressure.iter())
        .map(|own| Ok(nodes_in(&mesh, &[own.region.open(&input, scale)?])))
        .collect::<Result<_, ImportError>>()?;
    let regions = fixed::regions(&options.pressure, &inside, &mesh.surface)?;
    if let Some(name) = &options.name {
        mesh.name.clone_from(name);
    }
    mesh.license.clone_from(&options.license);
    unload(&mut mesh, options, stage)?;
    let path = stage.folder.join("mesh.safetensors");
    mesh.write(&path)
        .with_context(|| format!("{}: cannot be written", path.display()))?;
    fixed::write(&groups, &stage.folder, fixed::SUPPORTS)?;
    fixed::write(&regions, &stage.folder, fixed::REGIONS)?;
    for (what, sets) in [("support group", &groups), ("region", &regions)] {
        for set in sets {
            let (name, count) = (&set.name, set.nodes.len());
            stage.decided(&format!("{what} `{name}`: {count} nodes"));
        }
    }
    let quality = measure(&mesh);
    stage.decided(&format!(
        "{} nodes, {} tetrahedra, {:.1} ml, {}; {} nodes held; {} of {} mm² of surface may be touched",
        quality.nodes,
        quality.tets,
        quality.volume_mm3 * 1e-3,
        span(&quality),
        quality.fixed_nodes,
        quality.domain_area_mm2.round(),
        quality.surface_area_mm2.round()
    ));
    Ok(())
}

/// The mesh, and the file that it came from in the end.
fn read(options: &Options, stage: &mut Stage) -> Result<(Mesh, PathBuf)> {
    let name = options
        .input
        .file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned();
    if name.ends_with(".safetensors") {
        if options.scale()? != 1.0 {
            bail!("{name}: a mesh file is in mm; leave --unit out");
        }
        if !options.label.is_empty() || options.part.is_some() {
            bail!("{name}: a mesh file holds one body; leave --label and --part out");
        }
        if options.refill {
            bail!(
                "{name}: --refill is for files of other programs; make the mesh file anew with `upt mesh import --refill`"
            );
        }
        return Ok((Mesh::read(&options.input)?, options.input.clone()));
    }
    let folder = stage.folder.clone();
    let mut bar = None;
    let input = convert(
        &options.input,
        &options.label,
        &folder,
        &mut |said| match said {
            Said::Line(line) => stage.decided(line),
            Said::Percent(done) => bar
                .get_or_insert_with(|| options.watch.bar(100, "reading the labels"))
                .set_position(done),
        },
    )?;
    drop(bar);
    let stem = name.split('.').next().unwrap_or_default().to_owned();
    let imported = import(
        &input,
        &ImportOptions {
            name: Some(options.name.clone().unwrap_or(stem)),
            scale: options.scale()?,
            resolution: Some(Resolution::Nodes(options.nodes)),
            repair: !options.no_repair,
            part: options.part.clone(),
            refill: options.refill,
        },
    )
    .map_err(|error| {
        let hint = hint(&error);
        let error = match error.names_file() {
            true => anyhow::Error::new(error),
            false => anyhow::Error::new(error).context(input.display().to_string()),
        };
        match hint {
            Some(hint) => error.context(hint),
            None => error,
        }
    })?;
    for repair in &imported.repairs {
        stage.decided(&format!("repaired: {repair}"));
    }
    imported.notes.iter().for_each(|note| stage.decided(note));
    Ok((imported.mesh, input))
}

/// What to do about a file that no repair helps, in the words of this command.
fn hint(error: &ImportError) -> Option<&'static str> {
    match error {
        ImportError::Open { .. } => Some("only a closed surface can be filled"),
        ImportError::Stuffing(_) => {
            Some("the surface could not be filled; look at --unit and --nodes")
        }
        _ => None,
    }
}

fn check_length(mesh: &Mesh, options: &Options) -> Result<()> {
    let quality = measure(mesh);
    let longest = (0..3)
        .map(|k| f64::from(quality.high_mm[k] - quality.low_mm[k]))
        .fold(0.0, f64::max);
    if (LENGTH_MM[0]..=LENGTH_MM[1]).contains(&longest) {
        return Ok(());
    }
    let scale = options.scale()?;
    let likely = [("mm", 1.0), ("cm", 10.0), ("m", 1000.0)]
        .into_iter()
        .find(|(_, unit)| {
            let length = longest / scale * unit;
            (30.0..=600.0).contains(&length)
        });
    let advice = match likely {
        Some((unit, factor)) => format!(
            "with --unit {unit} it would be {:.0} mm",
            longest / scale * factor
        ),
        None => "give --unit in millimetres a unit of the file".to_owned(),
    };
    bail!(
        "the body is {longest:.3} mm long with --unit {}, which no organ is: {advice}",
        options.unit
    );
}

/// A `--fixed` for a body that has none: the lowest sixth along its shortest axis.
fn suggestion(mesh: &Mesh) -> String {
    let quality = measure(mesh);
    let length = |k: usize| quality.high_mm[k] - quality.low_mm[k];
    let axis = (0..3).fold(0, |best, k| if length(k) < length(best) { k } else { best });
    let mut plane = [0.0f32; 4];
    plane[axis] = -1.0;
    plane[3] = quality.low_mm[axis] + length(axis) / 6.0;
    let [a, b, c, d] = plane.map(|x| x + 0.0);
    format!(
        "give --fixed, for example --fixed plane:{a},{b},{c},{d:.1} for the side of smallest {}; the body spans {}",
        ["x", "y", "z"][axis],
        span(&quality)
    )
}

fn choose_domain(
    mesh: &mut Mesh,
    options: &Options,
    regions: &[Opened],
    stage: &mut Stage,
) -> Result<()> {
    let mut held = vec![false; mesh.node_count()];
    mesh.held_nodes(options.boundary)
        .iter()
        .for_each(|&node| held[node as usize] = true);
    let free = |mesh: &Mesh, row: u32| {
        let corners = mesh.surface[row as usize];
        !corners.iter().all(|&node| held[node as usize])
    };
    if !options.domain.is_empty() {
        let chosen = faces_in(mesh, regions);
        let count = chosen.len();
        if count == 0 {
            bail!(
                "no face of the surface lies in the region of --domain; the body spans {}",
                span(&measure(mesh))
            );
        }
        mesh.domain = chosen.into_iter().filter(|&row| free(mesh, row)).collect();
        if mesh.domain.is_empty() {
            bail!(
                "--fixed holds all {count} faces of --domain; choose another place for one of them, or hold less"
            );
        }
        if mesh.domain.len() < count {
            stage.decided(&format!(
                "{} held faces left out of the domain",
                count - mesh.domain.len()
            ));
        }
        return Ok(());
    }
    if !mesh.domain.is_empty() {
        mesh.domain.retain(|&row| {
            !mesh.surface[row as usize]
                .iter()
                .all(|&node| held[node as usize])
        });
        if mesh.domain.is_empty() {
            bail!("the whole domain of the mesh file is held; give another with --domain");
        }
        return Ok(());
    }
    let edge = (mesh
        .surface
        .iter()
        .map(|&face| face_area(&mesh.positions, face))
        .sum::<f64>()
        / mesh.surface.len() as f64
        * 2.3)
        .sqrt();
    let rim = RIM_EDGES * edge;
    let all_held = mesh.held_nodes(options.boundary);
    let far = |node: u32| {
        let p = mesh.positions[node as usize];
        all_held.iter().all(|&other| {
            let q = mesh.positions[other as usize];
            (0..3).map(|k| f64::from(p[k] - q[k]).powi(2)).sum::<f64>() > rim * rim
        })
    };
    mesh.domain = (0..mesh.surface.len() as u32)
        .filter(|&row| mesh.surface[row as usize].iter().all(|&node| far(node)))
        .collect();
    if mesh.domain.is_empty() {
        bail!(
            "no surface is farther than {rim:.1} mm from what is held; hold less, or give --domain"
        );
    }
    stage.decided(&format!(
        "domain: all of the surface at least {rim:.1} mm from what is held; a smaller --domain makes a smaller and faster bundle"
    ));
    Ok(())
}

/// Refuses a mesh on which the reference solver would need steps too short to be of use.
pub fn gate(mesh: &Mesh, options: &Options) -> Result<()> {
    let quality = measure(mesh);
    if quality.min_dihedral_deg < SMALLEST_ANGLE_DEG {
        bail!(
            "tetrahedra with an angle of {:.2} degrees (at least {SMALLEST_ANGLE_DEG} are needed): re-mesh, or give --refill, which fills \
             the mesh's own boundary anew with about --nodes nodes; upt mesh info tells more",
            quality.min_dihedral_deg
        );
    }
    if !quality.non_manifold_edges.is_empty() {
        bail!(
            "the boundary is not manifold at {} edges, the first {:?}: tetrahedra meet there in an edge alone; re-mesh",
            quality.non_manifold_edges.len(),
            quality.non_manifold_edges[0]
        );
    }
    if mesh.node_count() > 40_000 && options.minutes < 20.0 {
        options.watch.tell(&format!(
            "      {} nodes take longer than {} minutes",
            mesh.node_count(),
            options.minutes
        ));
    }
    Ok(())
}

/// Where nothing is held the page shows at least the body, so that coordinates can be picked.
pub fn preview_of_failure(options: &Options) {
    let Ok(scale) = options.scale() else { return };
    let name = options.input.to_string_lossy().into_owned();
    let read = || -> Option<Mesh> {
        if name.ends_with(".safetensors") {
            return Mesh::read(&options.input).ok();
        }
        let import_options = ImportOptions {
            scale,
            resolution: Some(Resolution::Nodes(options.nodes.min(3000))),
            repair: true,
            part: options.part.clone(),
            ..ImportOptions::default()
        };
        import(&options.input, &import_options)
            .ok()
            .map(|found| found.mesh)
    };
    let Some(mesh) = read() else { return };
    let path = options.out.with_extension("preview.html");
    let facts = vec![
        ("name".to_owned(), mesh.name.clone()),
        ("nodes".to_owned(), mesh.node_count().to_string()),
    ];
    let content = page::Content {
        mesh: &mesh,
        node_errors: None,
        facts: &facts,
        film: &serde_json::Value::Null,
        pick: true,
    };
    if page::write(&path, &content).is_ok() {
        options.watch.tell(&format!(
            "{}: open it in a browser and click to get coordinates",
            path.display()
        ));
    }
}
