//! `upt-study report --hang`: beds of ties that a thread tears node by node, through the library and the reference solver.
//!
//! Both get the same ties, step by step from their own last state. The solver runs here: a case is three seconds of tissue.

use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use contact::Vector;
use serde::Serialize;
use tissue::hang::Hang;
use tissue::mesh::{Boundary, Mesh};
use tissue::schemes::FRAME_S;
use tissue::solver::{Solver, SolverOptions};
use upt::{Corrections, Loads, Model, ModelOptions, Scene, SceneOptions, StepInput};

use crate::quantile::median;
use crate::report::options::Options;
use crate::table::{Column, Table};
use upt_cli::bundle_folder::BundleFolder;
use upt_cli::effort::Effort;
use upt_cli::marks::replace_between;

/// A case of the reference solver: by frame the force of each tie (mN), the field, and when each broke.
struct Truth {
    hang: Hang,
    forces: Vec<Vec<Vector>>,
    fields: Vec<Vec<[f32; 3]>>,
    broke_s: Vec<Option<f64>>,
}

/// A bundle with a number of corrections.
#[derive(Serialize)]
struct Row {
    bundle: String,
    corrections: String,
    cases: usize,
    /// Ties of a bed, the thread not counted; median over the cases.
    ties: f64,
    /// Of them torn at the end, all cases: by the solver, and by the library.
    torn: [usize; 2],
    /// Sums over ties, frames and cases: what forces are off by, over what they are; of ties that are whole in both.
    force_error: f64,
    /// Of the thread alone.
    thread_error: f64,
    /// Cases in which the first tie to break is the same.
    same_first: usize,
    /// Ties that the library breaks in the step of the first one, mean over the cases.
    first_step: f64,
    /// Median and largest over the ties that both break, in frames of 50 ms.
    late: [f64; 2],
    mse: f64,
    worst_mse: f64,
    smallest_det: f64,
    step_ms: f64,
}

/// Measures and prints the table.
pub fn report(asked: &Options) -> Result<ExitCode> {
    if asked.bundles.is_empty() {
        bail!("name the bundles to measure with --bundle");
    }
    let mut rows = Vec::new();
    for path in &asked.bundles {
        let bundle = BundleFolder::read(path)?;
        let mesh = Mesh::read(&bundle.mesh_file)?;
        let boundary: Boundary = bundle.boundary.parse().map_err(anyhow::Error::msg)?;
        let options = ModelOptions::default();
        let model = Model::open(path, &options).with_context(|| path.display().to_string())?;
        let mut truths = Vec::new();
        for seed in 1..=asked.hang as u64 {
            eprintln!("{}: case {seed} of {}", bundle.name, asked.hang);
            truths.push(truth(asked, seed, &mesh, boundary, &model)?);
        }
        let recommended = bundle.corrections.unwrap_or(Effort::NONE);
        let efforts = match asked.corrections.as_slice() {
            [] => &[recommended],
            efforts => efforts,
        };
        for effort in efforts {
            rows.push(measure(asked, *effort, &bundle, &model, &truths)?);
        }
    }
    let table = Table::of(&[0], &COLUMNS, &rows).markdown();
    match asked.json {
        true => println!("{}", serde_json::to_string_pretty(&rows)?),
        false => print!("{table}"),
    }
    for page in &asked.markdown {
        replace_between(page, "study report --hang", &format!("\n{table}"))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The reference solver's answer, with the bundle's material.
fn truth(
    asked: &Options,
    seed: u64,
    mesh: &Mesh,
    boundary: Boundary,
    model: &Model,
) -> Result<Truth> {
    let options = SolverOptions {
        material: model.manifest.material,
        threads: asked.most_threads() as usize,
        ..SolverOptions::default()
    };
    let hang = Hang::new(mesh, boundary, seed, asked.bed_sizes())
        .context("no part of the domain has room for the bed; give a smaller radius")?;
    let mut solver = Solver::new(mesh, boundary, options)?;
    let (mut forces, mut fields, mut broke_s) = (Vec::new(), Vec::new(), Vec::new());
    for frame in 1..=(hang.duration_s() / FRAME_S).round() as usize {
        solver.set_ties(&hang.ties(frame as f64 * FRAME_S))?;
        let report = solver.step_frame(&[], FRAME_S)?;
        let own = report.ties.iter().map(|tie| Vector::from(tie.force));
        forces.push(own.collect());
        broke_s = report.ties.iter().map(|tie| tie.broke_s).collect();
        let mut u = vec![[0.0; 3]; mesh.node_count()];
        solver.displacement(&mut u);
        fields.push(u);
    }
    Ok(Truth {
        hang,
        forces,
        fields,
        broke_s,
    })
}

fn measure(
    asked: &Options,
    effort: Effort,
    bundle: &BundleFolder,
    model: &Arc<Model>,
    truths: &[Truth],
) -> Result<Row> {
    let options = SceneOptions {
        threads: asked.most_threads() as usize,
        corrections: match (effort.most, effort.target_mm) {
            (0, _) => bail!("ties pull in corrections; give --corrections at least 1"),
            (most, 0.0) => Corrections::Fixed(most),
            (most, target_mm) => Corrections::Auto {
                most,
                target_mm,
                budget_us: 0,
            },
        },
        substeps: effort.substeps,
        ..SceneOptions::default()
    };
    let scene = Scene::new(Arc::clone(model), &options)?;
    let mut u = vec![0.0; 3 * scene.node_count()];
    let (mut errors, mut times, mut late) = (Vec::new(), Vec::new(), Vec::new());
    let (mut sums, mut thread, mut torn) = ([0.0; 2], [0.0; 2], [0; 2]);
    let (mut same_first, mut in_first_step, mut smallest_det) = (0, 0, 1.0f64);
    for truth in truths {
        scene.reset()?;
        let mut broke: Vec<Option<f64>> = vec![None; truth.broke_s.len()];
        for (frame, (forces, field)) in truth.forces.iter().zip(&truth.fields).enumerate() {
            let time_s = (frame + 1) as f64 * FRAME_S;
            let ties = truth.hang.ties(time_s);
            let loads = Loads {
                ties: &ties,
                ..Loads::default()
            };
            let input = StepInput {
                loads,
                ..StepInput::default()
            };
            let start = Instant::now();
            scene.step(input, Some(&mut u))?;
            times.push(1e3 * start.elapsed().as_secs_f64());
            let det = f64::from(scene.stats().min_det);
            smallest_det = smallest_det.min(if det == 0.0 { 1.0 } else { det });
            let pairs = u.as_chunks::<3>().0.iter().zip(field);
            let squares =
                pairs.map(|(a, b)| (Vector::from(*a) - Vector::from(*b)).length_squared());
            errors.push(squares.map(f64::from).sum::<f64>() / field.len() as f64);
            let last = forces.len() - 1;
            for (index, (reading, wanted)) in scene.tie_readings()?.iter().zip(forces).enumerate() {
                if reading.broke {
                    broke[index] = Some(time_s);
                }
                let is_whole = truth.broke_s[index].is_none_or(|broke| broke > time_s);
                if reading.broken || !is_whole {
                    continue;
                }
                let off = f64::from((Vector::from(reading.force) - *wanted).length());
                let size = f64::from(wanted.length());
                let sum = if index == last {
                    &mut thread
                } else {
                    &mut sums
                };
                sum[0] += off;
                sum[1] += size;
            }
        }
        let first = |times: &[Option<f64>]| {
            let broken = times.iter().enumerate();
            let broken = broken.filter_map(|(index, time)| Some((index, (*time)?)));
            broken.min_by(|a, b| a.1.total_cmp(&b.1))
        };
        // Ties that break in the same step are not told apart by the library.
        let wanted = first(&truth.broke_s).map(|(index, _)| index);
        let earliest = first(&broke).map(|(_, time)| time);
        same_first += usize::from(match wanted {
            Some(index) => broke[index].is_some() && broke[index] == earliest,
            None => earliest.is_none(),
        });
        let is_first = |time: &&Option<f64>| time.is_some() && **time == earliest;
        in_first_step += broke.iter().filter(is_first).count();
        for (own, wanted) in broke.iter().zip(&truth.broke_s) {
            torn[0] += usize::from(wanted.is_some());
            torn[1] += usize::from(own.is_some());
            if let (Some(own), Some(wanted)) = (own, wanted) {
                late.push(((own - wanted) / FRAME_S).abs());
            }
        }
    }
    let counts = truths.iter().map(|truth| truth.broke_s.len() as f64 - 1.0);
    Ok(Row {
        bundle: bundle.name.clone(),
        corrections: effort.to_string(),
        cases: truths.len(),
        ties: median(counts),
        torn,
        force_error: sums[0] / f64::max(sums[1], f64::MIN_POSITIVE),
        thread_error: thread[0] / f64::max(thread[1], f64::MIN_POSITIVE),
        same_first,
        first_step: in_first_step as f64 / truths.len() as f64,
        late: match late.is_empty() {
            true => [0.0; 2],
            false => [
                median(late.iter().copied()),
                late.iter().copied().fold(0.0, f64::max),
            ],
        },
        mse: median(errors.iter().copied()),
        worst_mse: errors.iter().copied().fold(0.0, f64::max),
        smallest_det,
        step_ms: median(times),
    })
}

const COLUMNS: [Column<Row>; 13] = [
    ("bundle", |row| format!("`{}`", row.bundle)),
    ("k", |row| row.corrections.clone()),
    ("cases", |row| row.cases.to_string()),
    ("ties", |row| row.ties.to_string()),
    ("torn: solver, libupt", |row| {
        format!("{}, {}", row.torn[0], row.torn[1])
    }),
    ("the same first (of so many in that step)", |row| {
        format!(
            "{} of {} ({:.1})",
            row.same_first, row.cases, row.first_step
        )
    }),
    ("late, steps (worst)", |row| {
        format!("{:.1} ({:.1})", row.late[0], row.late[1])
    }),
    ("force error: bed", |row| {
        format!("{:.1} %", 100.0 * row.force_error)
    }),
    ("thread", |row| format!("{:.1} %", 100.0 * row.thread_error)),
    ("MSE, mm² (median)", |row| format!("{:.2e}", row.mse)),
    ("worst", |row| format!("{:.2e}", row.worst_mse)),
    ("smallest det F", |row| format!("{:.2}", row.smallest_det)),
    ("ms a step", |row| format!("{:.1}", row.step_ms)),
];
