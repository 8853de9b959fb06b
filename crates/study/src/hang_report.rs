//! `upt-study report --hang`: beds of ties that a thread tears node by node, through the library and the reference solver.
//!
//! Both get the same ties, step by step from their own last state. The solver runs here: a case is three seconds of tissue.

use std::process::ExitCode;

use anyhow::{Context, Result, ensure};
use contact::Vector;
use gauge::median;
use serde::Serialize;
use tissue::hang::Hang;
use tissue::schemes::FRAME_S;
use tissue::solver::Solver;
use upt::{Loads, StepInput};

use crate::beside::{self, Relative, Steps, Subject, largest, percent, square};
use crate::report::options::Options;
use crate::table::Column;
use host::Effort;

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
    force_error: Option<f64>,
    /// Of the thread alone.
    thread_error: Option<f64>,
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
    beside::report(asked, "study report --hang", (&[0], &COLUMNS), |subject| {
        let case = |seed| {
            eprintln!("{}: case {seed} of {}", subject.name, asked.hang);
            truth(asked, seed, &subject)
        };
        let truths: Vec<Truth> = (1..=asked.hang as u64).map(case).collect::<Result<_>>()?;
        let efforts = subject.efforts.iter();
        (efforts.map(|effort| measure(*effort, &subject, &truths))).collect()
    })
}

/// The reference solver's answer.
fn truth(asked: &Options, seed: u64, subject: &Subject) -> Result<Truth> {
    let (mesh, boundary) = (&subject.mesh, subject.boundary);
    let hang = Hang::new(mesh, boundary, seed, asked.bed_sizes())
        .context("no part of the domain has room for the bed; give a smaller radius")?;
    let mut solver = Solver::new(mesh, boundary, subject.solver())?;
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

fn measure(effort: Effort, subject: &Subject, truths: &[Truth]) -> Result<Row> {
    let scene = subject.scene(effort)?;
    let mut u = vec![0.0; 3 * scene.node_count()];
    let (mut errors, mut steps, mut late) = (Vec::new(), Steps::default(), Vec::new());
    let (mut bed, mut thread, mut torn) = (Relative::default(), Relative::default(), [0; 2]);
    let (mut same_first, mut in_first_step) = (0, 0);
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
            steps.step(&scene, input, &mut u)?;
            ensure!(steps.refused == 0, "the guard refused a step");
            let pairs = u.as_chunks::<3>().0.iter().zip(field);
            let squares = pairs.map(|(own, wanted)| square(*own, *wanted));
            errors.push(squares.sum::<f64>() / field.len() as f64);
            let last = forces.len() - 1;
            for (index, (reading, wanted)) in scene.tie_readings()?.iter().zip(forces).enumerate() {
                if reading.broke {
                    broke[index] = Some(time_s);
                }
                let is_whole = truth.broke_s[index].is_none_or(|broke| broke > time_s);
                if reading.broken || !is_whole {
                    continue;
                }
                match index == last {
                    true => thread.add(reading.force, *wanted),
                    false => bed.add(reading.force, *wanted),
                }
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
        bundle: subject.name.clone(),
        corrections: effort.to_string(),
        cases: truths.len(),
        ties: median(counts),
        torn,
        force_error: bed.ratio(),
        thread_error: thread.ratio(),
        same_first,
        first_step: in_first_step as f64 / truths.len() as f64,
        late: match late.is_empty() {
            true => [0.0; 2],
            false => [median(late.iter().copied()), largest(late.iter().copied())],
        },
        mse: median(errors.iter().copied()),
        worst_mse: largest(errors.iter().copied()),
        smallest_det: steps.smallest_det,
        step_ms: median(steps.ms),
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
    ("force error: bed", |row| percent(row.force_error)),
    ("thread", |row| percent(row.thread_error)),
    ("MSE, mm² (median)", |row| format!("{:.2e}", row.mse)),
    ("worst", |row| format!("{:.2e}", row.worst_mse)),
    ("smallest det F", |row| format!("{:.2}", row.smallest_det)),
    ("ms a step", |row| format!("{:.1}", row.step_ms)),
];
