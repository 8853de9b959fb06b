//! From an organ's surface or mesh to a bundle that steps in real time, with its certificate (`docs/guide/make.md`).
//!
//! Stages, each kept in a work folder and not made again: body (import, repair, tetrahedra, what is held and touched), columns
//! (the linear response to every touch), modes (how it swings), tables, coarse space, refinement, check. A bundle is published as a whole
//! folder as soon as it works, and again with each stage that makes it better.
//!
//! REQ-092: A run that is killed leaves nothing or a bundle that works, and goes on when it is started again.
//!
//! REQ-093: A made bundle carries a certificate of its errors on contacts that it has not seen, and it can be repeated.

use std::path::PathBuf;

use anyhow::{Context, Result};
use serde_json::json;
use tissue::linear::{ColumnsFile, LinearError};
use tissue::mesh::Mesh;

use crate::check::Certificate;
use crate::clock::{self, Clock};
use crate::corrections::{self, Known, Workbench, principal};
use crate::options::Options;
use crate::sizes::Sizes;
use crate::stages::{Work, key_of};
use crate::{body, bundle, certify, fixed, learn, modes, prior, refine, tables, vibration};
use host::Effort;

/// Length of step for hosts that show frames, where one takes less than half of it here, s.
const FRAME_STEP_S: f64 = 0.02;

/// What a run leaves.
pub enum Made {
    /// A page that shows what is held and touched: `Options::preview`.
    Page(PathBuf),
    Bundle(Box<Finished>),
}

/// A bundle that is published, with its certificate.
pub struct Finished {
    pub certificate: Certificate,
    /// What it recommends.
    pub corrections: Effort,
    pub seconds: f64,
}

/// Makes the bundle in `options.out`; what an earlier run left in the work folder is not made again.
///
/// # Errors
/// Each names the file, the stage or the option, and says what to do. What is published by then stays, and works.
pub fn run(options: &Options) -> Result<Made> {
    let clock = Clock::start(options.minutes);
    options.check()?;
    bundle::check_target(&options.out)?;
    let mut work = Work::open(&options.work_folder(), &options.watch)?;

    let mut input = Vec::new();
    for file in tissue::mesh_import::files_of(&options.input) {
        input.extend(
            tissue::regular_file::read(&file)
                .with_context(|| format!("{}: cannot be read", file.display()))?,
        );
    }
    let body_key = key_of(&[&input, options.body_words()?.as_bytes()]);
    let made = work.stage(
        "body",
        &body_key,
        &["mesh.safetensors", fixed::SUPPORTS, fixed::REGIONS],
        |stage| body::make(options, stage),
    );
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
    let effort = sizes.corrections(options);
    work.tell(&sizes.words());
    let shown = options.out.with_extension("preview.html");
    page::write(
        &shown,
        &page::Content {
            mesh: &mesh,
            node_errors: None,
            facts: &sizes.scene(&mesh),
            film: &serde_json::Value::Null,
            pick: true,
        },
    )?;
    work.tell(&format!(
        "{}: open it in a browser to see what is held and touched",
        shown.display()
    ));
    let fit = body::gate(&mesh, options);
    if options.preview {
        return fit
            .context("the run itself would refuse this body")
            .map(|()| Made::Page(shown));
    }
    fit?;

    let material = options.material()?;
    // The tables answer within a step.
    let stepped = material.in_steps_of(tissue::schemes::FRAME_S);
    let held_key = key_of(&[
        body.key.as_bytes(),
        mesh.hash().as_bytes(),
        &mesh
            .domain
            .iter()
            .flat_map(|row| row.to_le_bytes())
            .collect::<Vec<u8>>(),
        stepped.young_pa.to_string().as_bytes(),
        stepped.poisson.to_string().as_bytes(),
        options.boundary.as_str().as_bytes(),
    ]);
    let columns_file = work.file("columns.safetensors");
    work.stage("columns", &held_key, &["columns.safetensors"], |stage| {
        clock.go_on(clock::COLUMNS, "the tetrahedra took all of it")?;
        let found = prior::write_columns(
            &prior::Options {
                mesh: mesh_file.clone(),
                boundary: options.boundary,
                out: columns_file.clone(),
                young: stepped.young_pa,
                poisson: stepped.poisson,
                batch: 96,
                threads: options.threads,
                watch: options.watch.clone(),
            },
            &mut |made| clock.columns(made),
        )?;
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
        let go_on = || clock.go_on(clock::MODES, "the natural modes are not there");
        let order = modes::Options {
            mesh: mesh_file.clone(),
            boundary: options.boundary,
            count: vibration::count(&mesh, options),
            out: modes_file.clone(),
            young: stepped.young_pa,
            poisson: stepped.poisson,
            density: material.density_kg_m3,
            threads: options.threads,
            watch: options.watch.clone(),
        };
        let found = match modes::write(&order, &|| go_on().is_ok()) {
            Err(error) if matches!(error.downcast_ref(), Some(LinearError::Stopped)) => {
                return go_on();
            }
            found => found?.hertz,
        };
        stage.decided(&format!(
            "natural modes from {:.2} to {:.2} Hz",
            found[0], found[1]
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
            options.boundary,
            stepped.young_pa,
            stepped.poisson,
        )?;
        let modes = vibration::Modes::read(&modes_file)?;
        tables::make(options, &mesh, &columns, &modes, &sizes, &clock, stage)
    })?;

    // From here on there is a bundle that works.
    let natural = vibration::count(&mesh, options);
    let known = Known {
        modes: Some(&modes_file),
        columns: Some(&columns_file),
    };
    let coarse_key = key_of(&[
        tables_key.as_bytes(),
        format!("{:?} {} {}", material, options.natural, options.patches).as_bytes(),
        options.draft().to_string().as_bytes(),
    ]);
    let draft = work.file("bundle");
    let until = clock.until(clock::PATCHED);
    work.stage(
        "coarse",
        &coarse_key,
        &["bundle/bundle.json", refine::PATCHES],
        |stage| {
            bundle::assemble(options, &mesh, &sizes, &stage.folder, &draft)?;
            bundle::publish(&draft, &options.out)?;
            stage.decided("a bundle of the linear response and its free vibration is there");
            let bench =
                Workbench::open(&draft, natural, &known, options.threads, &options.watch)?;
            let found =
                corrections::differences(&bench, options.patches, Some(until), options.seed, &options.watch)?;
            refine::write_differences(&stage.folder.join(refine::PATCHES), &found)?;
            let count = bench.write_space(
                &draft,
                principal(&found, options.patches.div_ceil(3).min(60)).into_iter(),
                &corrections::entry(options.draft(), 1.0),
            )?;
            bundle::publish(&draft, &options.out)?;
            stage.decided(&format!(
                "{count} modes of the coarse space, {} corrections a step until their estimated error is calibrated",
                options.draft()
            ));
            Ok(())
        },
    )?;

    if clock.left(clock::REFINED) < 0.0 {
        work.tell(&format!(
            "what every bundle needs took {:.1} of {} minutes: nothing is refined",
            clock.spent() / 60.0,
            options.minutes
        ));
    }
    let refine_key = key_of(&[coarse_key.as_bytes(), clock.budget().to_string().as_bytes()]);
    let seconds = clock.left(clock::REFINED);
    let made = work.stage(
        "refine",
        &refine_key,
        &["refined/bundle.json", refine::ERRORS],
        |stage| {
            let rounds = refine::Rounds {
                options,
                draft: &draft,
                columns: &columns_file,
                natural,
                known: &known,
                key: coarse_key.clone(),
                seconds,
            };
            refine::run(&rounds, stage)
        },
    )?;
    let work_refined = work.file("refined");
    let seconds = clock.left(clock::LEARNED);
    let learn_key = key_of(&[made.key.as_bytes(), effort.to_string().as_bytes()]);
    let made = work.stage("learn", &learn_key, &["learned/bundle.json"], |stage| {
        let learning = learn::Learning {
            options,
            sizes: &sizes,
            effort,
            refined: &work_refined,
            natural,
            known: &known,
            seconds,
        };
        learn::run(&learning, stage)
    })?;
    let draft = work.file("learned");

    let certify::Certified {
        mut certificate,
        folder: certified,
        corrections,
    } = certify::run(options, &mut work, &made.key, &draft, effort, &clock)?;
    if corrections.most > 0 && certificate.median_step_ms() < 0.5e3 * FRAME_STEP_S {
        let change = corrections::Change {
            frame_step_s: Some(FRAME_STEP_S),
            ..corrections::Change::default()
        };
        corrections::recommend(&certified, &change)?;
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
    Ok(Made::Bundle(Box::new(Finished {
        certificate,
        corrections,
        seconds: clock.spent(),
    })))
}
