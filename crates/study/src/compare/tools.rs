//! Random tools and the reference solver, one programme after another on one body without a reset: the library gets
//! the poses alone, the solver the same poses.

use std::fmt::Write;
use std::path::Path;

use anyhow::{Context, Result};
use gauge::median;
use tissue::metrics;
use tissue::programmes::{ToolCase, ToolProgramme};
use tissue::schemes::FRAME_S;
use tissue::solver::Solver;

use crate::bench::{Bench, names};
use crate::table::{Column, Table};
use picture::plot::label;
use upt_cli::progress;
use yardstick::drive::{Drive, Driver};
use yardstick::yard::Yard;

/// Seeds that no dataset has.
const SEEDS: u64 = 80_000;

/// A programme that was driven on both sides.
pub struct Driven {
    programme: &'static str,
    /// By step, mm² and mm.
    mse: Vec<f64>,
    largest_error: f64,
    /// Squared size of the force errors and of the forces, all tools and steps.
    wrong: f64,
    all: f64,
    det: f64,
    flags: u32,
}

/// Drives `count` programmes in turn; those that find no site are left out.
pub fn run(bench: &Bench, path: &Path, count: usize) -> Result<Vec<Driven>> {
    let programmes = ToolProgramme::parse_list("all").map_err(anyhow::Error::msg)?;
    let model = host::Model::open(path, &host::ModelSettings::default())?;
    let mut driver = Driver::new(&model, Drive::Solved)?;
    let mut solver = Solver::new(&bench.mesh, bench.boundary, super::pair::options(bench))?;
    let yard = Yard::new(&bench.mesh, bench.boundary);
    let samples = bench.mesh.samples(bench.boundary);
    let mut field = vec![[0.0; 3]; bench.mesh.node_count()];
    let mut truth = field.clone();
    let bar = progress::cases(count, &bench.subject);
    let mut driven = Vec::new();
    for index in 0..count {
        let programme = programmes[index % programmes.len()];
        bar.inc(1);
        let Ok(case) = ToolCase::new(programme, &bench.mesh, SEEDS + index as u64, None) else {
            continue;
        };
        // What the last programme left swings out first, so that no tool starts in it.
        solver.set_tools(samples.clone(), &[], &[])?;
        settle(&mut solver, &mut driver, &mut field)?;
        solver
            .set_tools(samples.clone(), &case.tools, &case.start)
            .with_context(|| format!("{}, case {index}", programme.name()))?;
        driver.take(&case.tools)?;
        let mut one = Driven {
            programme: programme.name(),
            mse: Vec::new(),
            largest_error: 0.0,
            wrong: 0.0,
            all: 0.0,
            det: 1.0,
            flags: 0,
        };
        for poses in &case.frames {
            let report = solver.step_tools(&[], poses, FRAME_S)?;
            solver.displacement(&mut truth);
            let step = driver.step(poses, &mut field)?;
            one.mse.push(metrics::mse_mm2(&truth, &field));
            one.largest_error = one.largest_error.max(metrics::max_error_mm(&truth, &field));
            one.det = one.det.min(yard.smallest_det(&field));
            one.flags |= step.flags;
            for (felt, wanted) in step.felt.iter().zip(&report.tools) {
                for k in 0..3 {
                    one.wrong += (felt.force[k] - f64::from(wanted.force[k])).powi(2);
                    one.all += f64::from(wanted.force[k]).powi(2);
                }
            }
        }
        driven.push(one);
    }
    bar.finish_and_clear();
    Ok(driven)
}

/// Steps without tools on both sides.
fn settle(solver: &mut Solver, driver: &mut Driver, field: &mut [[f32; 3]]) -> Result<()> {
    const STEPS: usize = 10;
    driver.take(&[])?;
    for _ in 0..STEPS {
        solver.step_frame(&[], FRAME_S)?;
        driver.step(&[], field)?;
    }
    Ok(())
}

const COLUMNS: [Column<Driven>; 6] = [
    ("programme of tools", |one| one.programme.to_string()),
    ("MSE, mm²", |one| label(mean(&one.mse))),
    ("largest error, mm", |one| {
        format!("{:.2}", one.largest_error)
    }),
    ("force", |one| {
        let error = (one.wrong / one.all.max(f64::MIN_POSITIVE)).sqrt();
        format!("{:.1} %", 100.0 * error)
    }),
    ("smallest det F", |one| format!("{:.2}", one.det)),
    ("flags", |one| names(one.flags)),
];

/// A row a programme, then the first half of the cases against the second; true where the second is no worse than twice the first.
pub fn table(text: &mut String, driven: &[Driven]) -> bool {
    text.push_str(&Table::of(&[0, 5], &COLUMNS, driven).markdown());
    // Medians: a slip-off to another place of the tissue is one case's, not growth.
    let middle = |half: &[Driven]| {
        let middle = median(half.iter().map(|one| mean(&one.mse)));
        if middle.is_nan() { 0.0 } else { middle }
    };
    let (first, later) = driven.split_at(driven.len() / 2);
    let (first, later) = (middle(first), middle(later));
    let _ = writeln!(
        text,
        "\nMedian MSE of the first half of the programmes {} mm², of the rest {} mm², on one body without a reset.\n",
        label(first),
        label(later)
    );
    later <= 2.0 * first.max(1e-3)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}
