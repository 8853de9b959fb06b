//! `upt make`: from an organ's surface or mesh to a bundle that steps in real time, with its certificate, in one command
//! (`docs/guide/make.md`).
//!
//! Stages, each kept in a work folder and not made again: body (import, repair, tetrahedra, what is held and touched), columns
//! (the linear response to every touch), modes (how it swings), tables, coarse space, check. A bundle is published as a whole
//! folder as soon as it works, and again with each stage that makes it better.

mod body;
mod bundle;
mod emit;
mod options;
mod patches;
mod stages;
mod tables;
mod vibration;

pub use options::Options;

use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use serde_json::json;
use tissue::linear::ColumnsFile;
use tissue::mesh::{Boundary, Mesh};

use crate::check;
use crate::{corrections, modes, preview, prior};
use options::Sizes;
use stages::{Work, key_of};

/// The bundles of `upt make` hold the mesh's set `fixed`.
const BOUNDARY: Boundary = Boundary::Fixed;

/// Runs the command.
pub fn run(options: &Options) -> Result<ExitCode> {
    let started = Instant::now();
    options.check()?;
    if let [cluster, folder] = options.emit.as_slice() {
        let start = emit::write(options, cluster, Path::new(folder))?;
        println!("{}: start this", start.display());
        return Ok(ExitCode::SUCCESS);
    }
    bundle::check_target(&options.out)?;
    let mut work = Work::open(&options.work_folder(), options.json)?;

    let input = std::fs::read(&options.input)
        .with_context(|| format!("{}: cannot be read", options.input.display()))?;
    let body_key = key_of(&[&input, options.body_words()?.as_bytes()]);
    let made = work.stage("body", &body_key, &["mesh.safetensors"], |stage| {
        body::make(options, stage)
    });
    let body = match made {
        Ok(body) => body,
        Err(error) => {
            body::preview_of_failure(options);
            return Err(error);
        }
    };
    let mesh_file = work.file("mesh.safetensors");
    let mesh = Mesh::read(&mesh_file)?;
    let sizes = Sizes::of(options, &mesh)?;
    work.tell(&sizes.words());
    let page = options.out.with_extension("preview.html");
    preview::write(&page, &mesh, &preview::Error::None, &sizes.scene(&mesh))?;
    work.tell(&format!(
        "{}: open it in a browser to see what is held and touched",
        page.display()
    ));
    if options.preview {
        return Ok(ExitCode::SUCCESS);
    }
    body::gate(&mesh, options)?;

    let material = options.material()?;
    let held_key = key_of(&[
        body.key.as_bytes(),
        mesh.hash().as_bytes(),
        &mesh
            .domain
            .iter()
            .flat_map(|row| row.to_le_bytes())
            .collect::<Vec<u8>>(),
        material.young_pa.to_string().as_bytes(),
        material.poisson.to_string().as_bytes(),
    ]);
    let columns_file = work.file("columns.safetensors");
    work.stage("columns", &held_key, &["columns.safetensors"], |stage| {
        let found = prior::write_columns(&prior::Options {
            mesh: mesh_file.clone(),
            boundary: BOUNDARY,
            out: columns_file.clone(),
            young: material.young_pa,
            poisson: material.poisson,
            batch: 96,
            threads: options.threads,
            json: options.json,
        })?;
        stage.decided(&format!(
            "{} columns of {} degrees of freedom",
            found.rows, found.width
        ));
        Ok(())
    })?;

    let modes_key = key_of(&[
        held_key.as_bytes(),
        material.density_kg_m3.to_string().as_bytes(),
        options.natural.to_string().as_bytes(),
    ]);
    let modes_file = work.file("modes.safetensors");
    work.stage("modes", &modes_key, &["modes.safetensors"], |stage| {
        let hertz = modes::write(&modes::Options {
            mesh: mesh_file.clone(),
            boundary: BOUNDARY,
            count: vibration::count(&mesh, options.natural),
            out: modes_file.clone(),
            young: material.young_pa,
            poisson: material.poisson,
            density: material.density_kg_m3,
            threads: options.threads,
            json: options.json,
        })?;
        stage.decided(&format!(
            "natural modes from {:.2} to {:.2} Hz",
            hertz[0], hertz[1]
        ));
        Ok(())
    })?;

    let tables_key = key_of(&[
        modes_key.as_bytes(),
        sizes.words().as_bytes(),
        options.tolerance_mm.to_string().as_bytes(),
        options.seed.to_string().as_bytes(),
    ]);
    let files = ["prior.safetensors", "vibration.safetensors"];
    work.stage("tables", &tables_key, &files, |stage| {
        let columns = ColumnsFile::open(
            &columns_file,
            &mesh,
            BOUNDARY,
            material.young_pa,
            material.poisson,
        )?;
        let modes = vibration::Modes::read(&modes_file)?;
        tables::make(options, &mesh, &columns, &modes, &sizes, stage)
    })?;

    // From here on there is a bundle that works.
    let coarse_key = key_of(&[
        tables_key.as_bytes(),
        format!("{:?} {} {}", material, options.natural, options.patches).as_bytes(),
        options.recommended.to_string().as_bytes(),
    ]);
    let draft = work.file("bundle");
    work.stage("coarse", &coarse_key, &["bundle/bundle.json"], |stage| {
        bundle::assemble(options, &mesh, &sizes, &stage.folder, &draft)?;
        bundle::publish(&draft, &options.out)?;
        stage.decided("a bundle of the linear response and its free vibration is there");
        let count = corrections::write(&corrections::Options {
            bundle: draft.clone(),
            natural: vibration::count(&mesh, options.natural),
            patch_modes: options.patches.div_ceil(3).min(60),
            patches: options.patches,
            residual: false,
            recommended: options.recommended,
            calibration: 1.0,
            seed: options.seed,
            threads: options.threads,
            json: options.json,
        })?;
        stage.decided(&format!(
            "{count} modes of the coarse space, {} corrections a step",
            options.recommended
        ));
        Ok(())
    })?;

    let check_key = key_of(&[
        coarse_key.as_bytes(),
        format!("{} {:?}", options.seed, options.cases).as_bytes(),
    ]);
    let left = (60.0 * options.minutes - started.elapsed().as_secs_f64()).max(20.0);
    let mut certificate = work
        .stage("check", &check_key, &["certificate.json"], |stage| {
            let plan = check::Plan {
                bundle: draft.clone(),
                cases: options.cases,
                seconds: 0.7 * left,
                seed: options.seed ^ 0xCE27,
                threads: options.threads,
                quiet: options.json,
            };
            let found = check::measure(&plan)?;
            stage.decided(&found.words());
            std::fs::write(
                stage.folder.join("certificate.json"),
                serde_json::to_vec_pretty(&found.json())?,
            )?;
            std::fs::write(stage.folder.join("errors.bin"), found.node_errors_bytes())?;
            Ok(())
        })
        .and_then(|_| {
            check::Certificate::read(&work.file("certificate.json"), &work.file("errors.bin"))
        })?;
    // The draft stays as its stage left it.
    let certified = work.file("certified");
    bundle::copy(&draft, &certified)?;
    if let Some(factor) = certificate.calibration() {
        corrections::set_calibration(&certified, options.recommended, factor)?;
    }
    certificate.finish(
        &certified,
        &json!({
            "command": "upt make",
            "input": options.input.file_name().map(|name| name.to_string_lossy()),
            "input_sha256": key_of(&[&input]),
            "options": options.words(),
            "seed": options.seed,
        }),
    )?;
    certificate.write(&certified, &mesh, &sizes.scene(&mesh))?;
    bundle::publish(&certified, &options.out)?;
    let seconds = started.elapsed().as_secs_f64();
    if options.json {
        println!(
            "{}",
            json!({"bundle": options.out, "seconds": seconds, "certificate": certificate.json()})
        );
    } else {
        println!("{}", certificate.text());
        println!(
            "{}: made in {seconds:.0} s; certificate.html says how good it is",
            options.out.display()
        );
    }
    if let Some(target) = options.target_error
        && certificate.mse_in_contact() > target
    {
        bail!(
            "the error in contact is {:.3e} mm², above --target-error {target:.3e}; raise --corrections, or --nodes for a finer mesh",
            certificate.mse_in_contact()
        );
    }
    Ok(ExitCode::SUCCESS)
}
