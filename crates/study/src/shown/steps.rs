//! The error of steps by their length (`upt-study report --step-ms`): the same tools, a scene that steps every 10 to 50 ms, and the reference
//! solver's state at the end of each step.

use std::process::ExitCode;

use anyhow::{Result, bail};
use gauge::median;
use serde::Serialize;
use serde_json::json;
use tissue::metrics;
use tissue::schemes::FRAME_S;

use super::truth::{Truth, places};
use crate::posed::Posed;
use crate::report::options::Options;
use crate::table::{Column, Table};
use host::Effort;
use host::{Model, ModelSettings};
use picture::plot::label;
use upt_cli::counted::counted;
use yardstick::cases::ToolCase;
use yardstick::drive::{Drive, Driver};
use yardstick::yard::Yard;

/// The truth's forces are taken as their mean over this time about a moment, s: impulses of contact are noisy.
const FORCE_S: f64 = 0.025;

/// One length of step with one number of corrections, over all cases.
#[derive(Debug, Serialize)]
struct Row {
    bundle: String,
    #[serde(flatten)]
    corrections: Effort,
    step_ms: f64,
    /// Medians over the cases of the mean over steps in which the truth touches, and in which it does not.
    contact_mse_mm2: f64,
    free_mse_mm2: f64,
    worst_case_mm2: f64,
    /// Relative L2 over all moments and tools.
    force_error: f64,
    penetration_mm: f64,
    /// Median time of a step in contact, and of one without.
    contact_ms: f64,
    free_ms: f64,
}

/// A case's sums.
#[derive(Default)]
struct Sums {
    /// Error and moments: in contact, and free.
    error: [(f64, usize); 2],
    /// Of squared force differences and forces.
    force: [f64; 2],
    penetration_mm: f64,
    ms: [Vec<f64>; 2],
}

impl Sums {
    fn mean(&self, free: usize) -> Option<f64> {
        let (sum, count) = self.error[free];
        (count > 0).then(|| sum / count as f64)
    }

    fn all(&self) -> f64 {
        let [a, b] = self.error;
        (a.0 + b.0) / (a.1 + b.1).max(1) as f64
    }
}

/// Measures, and writes the table.
pub fn report(options: &Options) -> Result<ExitCode> {
    let mut posed = Posed::asked(options)?;
    let truths = Truth::of_all(&posed.cases)?;
    let mut yard = Yard::new(&posed.mesh, posed.boundary);
    let publisher = options.publisher();
    let mut all = Vec::new();
    let mut notes = Vec::new();
    for bundle in &posed.bundles {
        let Some(recommended) = bundle.corrections else {
            let name = &bundle.name;
            notes.push(format!("{name}: has no corrections, so it has only one length of step; add them with `upt corrections`"));
            continue;
        };
        let counts = match options.corrections.as_slice() {
            [] => &[recommended],
            given => given,
        };
        let mut rows = Vec::new();
        for &count in counts {
            for &step_ms in &options.step_ms {
                let settings = ModelSettings {
                    threads: options.most_threads(),
                    corrections: Some(count),
                    step_s: 1e-3 * step_ms,
                    ..ModelSettings::default()
                };
                let model = Model::open(&bundle.path, &settings)?;
                let mut driver = Driver::new(&model, Drive::Solved)?;
                let mut sums = Vec::new();
                posed.each(&format!("{}, {step_ms} ms", bundle.name), |at, case| {
                    let step_s = 1e-3 * step_ms;
                    sums.push(replay(case, &truths[at], step_s, &mut driver, &mut yard)?);
                    Ok(())
                })?;
                rows.push(row(&bundle.name, count, step_ms, &sums));
            }
        }
        let text = format!(
            "`{}`, {}, {}. {}.\n\n{}\n",
            bundle.name,
            posed.said(),
            counted(options.most_threads() as usize, "thread"),
            posed.place(),
            Table::of(&[], &COLUMNS, &rows).markdown()
        );
        publisher.part(&format!("study report --step-ms {}", bundle.name), &text)?;
        all.extend(rows);
    }
    posed.notes.extend(notes);
    if all.is_empty() {
        bail!("nothing could be measured: {}", posed.notes.join("; "));
    }
    let mut report = posed.origin(options.most_threads());
    report["rows"] = json!(all);
    publisher.end(&report, &posed.notes)?;
    Ok(ExitCode::SUCCESS)
}

/// A case from rest to its end.
fn replay(
    case: &ToolCase,
    truth: &Truth,
    step_s: f64,
    driver: &mut Driver,
    yard: &mut Yard,
) -> Result<Sums> {
    driver.reset()?;
    driver.take(&case.tools)?;
    let nodes = case.trajectory.frame(0).len();
    let (mut state, mut true_field) = (vec![[0.0f32; 3]; nodes], vec![[0.0f32; 3]; nodes]);
    let mut sums = Sums::default();
    for step in 1.. {
        let at = step as f64 * step_s;
        if at > truth.seconds() + 1e-9 {
            break;
        }
        let poses = truth.poses(case, at);
        let made = driver.step(&poses, &mut state)?;
        if truth.slips(at) {
            continue;
        }
        truth.field(case, at, &mut true_field);
        let touches = case.touches(frame(truth, at).min(case.poses.len() - 1));
        let free = usize::from(!touches);
        sums.error[free].0 += metrics::mse_mm2(&true_field, &state);
        sums.error[free].1 += 1;
        sums.ms[free].push(made.ms);
        let inside = yard.penetration(&state, &case.bodies, &places(&poses));
        sums.penetration_mm = sums.penetration_mm.max(inside);
        for (tool, felt) in made.felt.iter().enumerate() {
            let force = true_force(case, truth, at, tool);
            for (own, force) in felt.force.iter().zip(force) {
                sums.force[0] += (own - force).powi(2);
                sums.force[1] += force.powi(2);
            }
        }
    }
    Ok(sums)
}

/// The recorded frame at a moment.
fn frame(truth: &Truth, seconds: f64) -> usize {
    (seconds / FRAME_S * truth.parts as f64).round() as usize
}

/// Mean force on a tool about a moment, mN.
fn true_force(case: &ToolCase, truth: &Truth, seconds: f64, tool: usize) -> [f64; 3] {
    let tracks = case.tracks();
    let half = (0.5 * FORCE_S / FRAME_S * truth.parts as f64).round() as usize;
    let middle = frame(truth, seconds);
    let last = (middle + half).min(case.poses.len() - 1);
    let frames = middle.saturating_sub(half).max(1)..=last;
    let count = frames.clone().count().max(1) as f64;
    let mut mean = [0.0; 3];
    for frame in frames {
        let wrench = &tracks.wrenches[frame * case.tools.len() + tool];
        for (sum, force) in mean.iter_mut().zip(wrench) {
            *sum += f64::from(*force) / count;
        }
    }
    mean
}

fn row(bundle: &str, corrections: Effort, step_ms: f64, sums: &[Sums]) -> Row {
    let force = |at: usize| sums.iter().map(|own| own.force[at]).sum::<f64>();
    let ms = |free: usize| median(sums.iter().flat_map(|own| own.ms[free].iter().copied()));
    let mse = |free: usize| median(sums.iter().filter_map(|own| own.mean(free)));
    Row {
        bundle: bundle.into(),
        corrections,
        step_ms,
        contact_mse_mm2: mse(0),
        free_mse_mm2: mse(1),
        worst_case_mm2: sums.iter().map(Sums::all).fold(0.0, f64::max),
        force_error: (force(0) / force(1).max(f64::MIN_POSITIVE)).sqrt(),
        penetration_mm: sums
            .iter()
            .map(|own| own.penetration_mm)
            .fold(0.0, f64::max),
        contact_ms: ms(0),
        free_ms: ms(1),
    }
}

const COLUMNS: [Column<Row>; 10] = [
    ("k", |row| row.corrections.to_string()),
    ("step, ms", |row| row.step_ms.to_string()),
    ("MSE in contact, mm²", |row| label(row.contact_mse_mm2)),
    ("MSE without, mm²", |row| label(row.free_mse_mm2)),
    ("worst case, mm²", |row| label(row.worst_case_mm2)),
    ("force error", |row| {
        format!("{:.1} %", 1e2 * row.force_error)
    }),
    ("deepest in a tool, mm", |row| label(row.penetration_mm)),
    ("ms a step in contact", |row| label(row.contact_ms)),
    ("ms a step without", |row| label(row.free_ms)),
    ("of real time, in contact", |row| {
        format!("{:.0} %", 1e2 * row.contact_ms / row.step_ms)
    }),
];
