//! `upt-study report --load`: gravity that turns, a pulse, a lost pressure, a support that breathes, through the library and the reference solver, with a tool and without.
//!
//! Both get the same loads, step by step from their own last state. A moving support is compared in its own frame, in which the library has all. The solver runs here: a case of loads is seconds of tissue.

use std::process::ExitCode;

use anyhow::{Context, Result, ensure};
use contact::{Body, Pose, Vector, pose};
use gauge::median;
use serde::Serialize;
use tissue::load_programmes::{LoadProgramme, LoadSizes};
use tissue::simulate::{ToolOrder, simulate_loads, simulate_tools};
use tissue::solver::SupportMotion;
use tissue::trajectory::Trajectory;
use upt::{Contact, Loads, Pressure, StepInput, SupportPose, Tool};

use crate::beside::{self, Relative, Steps, Subject, largest, percent, square};
use crate::report::options::Options;
use crate::table::Column;
use host::Effort;
use yardstick::tool_scale;

/// A programme by a bundle: of several cases the medians, the worst, and how far any of them goes.
#[derive(Clone, Serialize)]
struct Row {
    bundle: String,
    load: &'static str,
    tool: &'static str,
    cases: usize,
    corrections: String,
    /// How far the solver's tissue goes in the support's frame, mm.
    farthest_mm: f64,
    /// Over the frames, mm².
    mse: f64,
    worst_mse: f64,
    /// What forces on the tools are off by, over what they are; none without a tool.
    force_error: Option<f64>,
    worst_force_error: Option<f64>,
    smallest_det: f64,
    /// Median, ms.
    step_ms: f64,
}

/// Measures and prints the table.
pub fn report(asked: &Options) -> Result<ExitCode> {
    let mut mark = "study report --load".to_owned();
    if let Some(tool) = asked.tool {
        mark += &format!(" --tool {}", tool.name());
    }
    let sizes = asked.load_sizes.sizes();
    if sizes != LoadSizes::default() {
        let ([x, y, z], pascal) = (sizes.gravity_m_s2, sizes.pascal);
        mark += &format!(" --gravity {x},{y},{z} --pressure {pascal}");
    }
    beside::report(asked, &mark, (&[0, 1, 2], &COLUMNS), |subject| {
        let mut rows = Vec::new();
        for programme in &asked.load {
            eprintln!("{}: {}", subject.name, programme.name());
            let seeds = asked.seed..asked.seed + if asked.tool.is_some() { asked.seeds } else { 1 };
            let truths: Vec<Trajectory> = seeds
                .map(|seed| truth(asked, (*programme, seed), &subject))
                .collect::<Result<_>>()?;
            for effort in &subject.efforts {
                let case = |truth| measure(asked, (*programme, *effort), &subject, truth);
                let cases: Vec<Row> = truths.iter().map(case).collect::<Result<_>>()?;
                rows.push(joined(&cases)?);
            }
        }
        Ok(rows)
    })
}

/// One row of several cases.
fn joined(cases: &[Row]) -> Result<Row> {
    let first = cases.first().context("no case")?;
    let medians = |value: fn(&Row) -> f64| median(cases.iter().map(value));
    let most = |value: fn(&Row) -> f64| largest(cases.iter().map(value));
    let force = |row: &Row| row.force_error.unwrap_or(0.0);
    let has_force = cases.iter().any(|row| row.force_error.is_some());
    Ok(Row {
        cases: cases.len(),
        farthest_mm: most(|row| row.farthest_mm),
        mse: medians(|row| row.mse),
        worst_mse: most(|row| row.worst_mse),
        force_error: has_force.then(|| medians(force)),
        worst_force_error: has_force.then(|| most(force)),
        smallest_det: cases.iter().map(|row| row.smallest_det).fold(1.0, f64::min),
        step_ms: medians(|row| row.step_ms),
        ..first.clone()
    })
}

/// The reference solver's answer.
fn truth(
    asked: &Options,
    (programme, seed): (LoadProgramme, u64),
    subject: &Subject,
) -> Result<Trajectory> {
    let (mesh, boundary) = (&subject.mesh, subject.boundary);
    let options = subject.solver();
    let load = (programme, asked.load_sizes.sizes());
    let case = match asked.tool {
        None => simulate_loads(mesh, boundary, load, &options, |_, _| {}),
        Some(tool) => {
            let order = ToolOrder {
                load: Some(load),
                scale: tool_scale::Chosen::of(None, mesh, None).scale,
                ..ToolOrder::new(tool, seed)
            };
            simulate_tools(mesh, boundary, order, &options, |_, _| {})
        }
    };
    Ok(case?)
}

fn measure(
    asked: &Options,
    (programme, effort): (LoadProgramme, Effort),
    subject: &Subject,
    truth: &Trajectory,
) -> Result<Row> {
    let scene = subject.scene(effort)?;
    let (nodes, mut u) = (scene.node_count(), vec![0.0; 3 * scene.node_count()]);
    let mut tools = tools(truth)?;
    let (mut errors, mut steps) = (Vec::new(), Steps::default());
    let (mut force, mut farthest) = (Relative::default(), 0.0f64);
    if let Some(start) = programme.support_at(0.0) {
        // From here on the scene knows how fast it goes.
        let loads = Loads {
            support: Some(support_pose(start)),
            ..Loads::default()
        };
        let input = StepInput {
            loads,
            ..StepInput::default()
        };
        scene.step(input, None)?;
    }
    for step in 1..truth.frame_count() {
        let time_s = step as f64 * truth.header.dt_s;
        let (gravity, pascal) = programme.at(asked.load_sizes.sizes(), time_s);
        let support = programme.support_at(time_s).map(support_pose);
        let frame = (support.as_ref())
            .map(|support| pose::checked(support.position, support.rotation))
            .transpose()?;
        if let Some(tracks) = &truth.tools {
            for (tool, at) in tools.iter_mut().zip(tracks.frame(step)) {
                tool.pose = frame.map_or(at.pose, |frame| frame.inverse() * at.pose);
            }
        }
        let pressures = [Pressure {
            nodes: &[],
            pascal: pascal as f32,
        }];
        let input = StepInput {
            contact: match tools.is_empty() {
                true => Contact::None,
                false => Contact::Tools(&tools),
            },
            loads: Loads {
                gravity: gravity.map(|g| g as f32),
                pressures: &pressures,
                support,
                ..Loads::default()
            },
            ..StepInput::default()
        };
        steps.step(&scene, input, &mut u)?;
        ensure!(steps.refused == 0, "the guard refused a step");
        let mut squares = 0.0;
        let rows = subject.model.positions().as_chunks::<3>().0.iter();
        for ((rest, u), wanted) in rows.zip(u.as_chunks::<3>().0).zip(truth.frame(step)) {
            let wanted = in_frame(frame.as_ref(), *rest, *wanted);
            squares += square(*u, wanted);
            farthest = farthest.max(square(wanted, [0.0; 3]));
        }
        errors.push(squares / nodes as f64);
        if let Some(tracks) = &truth.tools {
            let readings = scene.with_contact_report(|report| {
                let forces = report.readings.iter().map(|reading| reading.force);
                forces.collect::<Vec<_>>()
            });
            let wrenches = &tracks.wrenches[step * tools.len()..];
            for (own, wanted) in readings.iter().zip(wrenches) {
                let wanted = Vector::new(wanted[0], wanted[1], wanted[2]);
                let turned = |frame: &Pose| frame.rotation.inverse() * wanted;
                force.add(*own, frame.as_ref().map_or(wanted, turned));
            }
        }
    }
    Ok(Row {
        bundle: subject.name.clone(),
        load: programme.name(),
        tool: asked.tool.map_or("none", |tool| tool.name()),
        cases: 1,
        corrections: effort.to_string(),
        farthest_mm: farthest.sqrt(),
        mse: median(errors.iter().copied()),
        worst_mse: largest(errors.iter().copied()),
        force_error: force.ratio(),
        worst_force_error: None,
        smallest_det: steps.smallest_det,
        step_ms: median(steps.ms),
    })
}

/// The pose of a support from its rotation vector.
fn support_pose(motion: SupportMotion) -> SupportPose {
    let angle = motion.turn.iter().map(|v| v * v).sum::<f64>().sqrt();
    let (sine, cosine) = (0.5 * angle).sin_cos();
    let part = if angle > 0.0 { sine / angle } else { 0.5 };
    let [x, y, z] = motion.turn.map(|v| (part * v) as f32);
    SupportPose {
        position: motion.position.map(|v| v as f32),
        rotation: [x, y, z, cosine as f32],
    }
}

/// A displacement of the world in the support's frame.
fn in_frame(frame: Option<&Pose>, rest: [f32; 3], u: [f32; 3]) -> [f32; 3] {
    let Some(frame) = frame else {
        return u;
    };
    let (rest, u) = (Vector::from(rest), Vector::from(u));
    (frame.rotation.inverse() * (rest + u - frame.translation) - rest).to_array()
}

fn tools(truth: &Trajectory) -> Result<Vec<Tool>> {
    let Some(tracks) = &truth.tools else {
        return Ok(Vec::new());
    };
    let poses = tracks.frame(0);
    let made = tracks.tools.iter().zip(poses).map(|(tool, at)| {
        let body = Body::new(&tool.shape)?;
        let position = at.pose.translation.to_array();
        let mut made = Tool::of_body(body, position, at.pose.rotation.to_array())?;
        made.friction = tool.friction;
        anyhow::Ok(made)
    });
    made.collect()
}

const COLUMNS: [Column<Row>; 12] = [
    ("bundle", |row| format!("`{}`", row.bundle)),
    ("load", |row| row.load.into()),
    ("tool", |row| row.tool.into()),
    ("cases", |row| row.cases.to_string()),
    ("k", |row| row.corrections.clone()),
    ("farthest, mm", |row| format!("{:.2}", row.farthest_mm)),
    ("MSE, mm² (median)", |row| format!("{:.2e}", row.mse)),
    ("worst", |row| format!("{:.2e}", row.worst_mse)),
    ("force error (median)", |row| percent(row.force_error)),
    ("worst force error", |row| percent(row.worst_force_error)),
    ("smallest det F", |row| format!("{:.2}", row.smallest_det)),
    ("ms a step", |row| format!("{:.1}", row.step_ms)),
];
