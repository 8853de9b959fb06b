//! `upt-study report --cut`: bodies that are cut, resected and hardened, through the library and the reference solver.
//!
//! Both get the same blades, aspirators and balls, step by step from their own last state. The solver runs here: a case is one or two seconds of tissue.

mod programmes;

use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use contact::{Shape, Vector};
use serde::Serialize;
use tissue::mesh::{Boundary, Mesh};
use tissue::schemes::FRAME_S;
use tissue::solver::{Solver, SolverOptions, Tool as Rigid, ToolPose};
use topology::Sweep;
use upt::{
    Blade, Contact, Corrections, Error, Mode, Model, ModelOptions, Scene, SceneOptions, Tool,
};

use crate::quantile::{median, quantile};
use crate::report::options::Options;
use crate::table::{Column, Table};
use programmes::{BALL_MM, Frame, Operation, PROGRAMMES, Site};
use upt_cli::bundle_folder::BundleFolder;
use upt_cli::effort::Effort;
use upt_cli::marks::replace_between;

/// What the blades of the programmes feel, J/m².
const FRACTURE_ENERGY: f64 = 10.0;
/// Near to the cut: this far from its place, mm.
const NEAR_MM: f32 = 25.0;

/// A programme with a bundle.
#[derive(Default, Serialize)]
struct Row {
    bundle: String,
    programme: &'static str,
    corrections: String,
    cases: usize,
    /// Nodes that cuts have added at the end, median of the cases.
    copies: f64,
    /// Mean of the squared distance over nodes, mm²: median over frames and cases, everywhere and near to the cut, and the worst frame.
    mse: f64,
    near_mse: f64,
    worst_mse: f64,
    /// Sums over frames and cases: what the force on the ball is off by, over what it is; the same of the blade.
    force_error: f64,
    blade_error: f64,
    /// Volume that has left, of the library over the solver's.
    removed_ratio: f64,
    smallest_det: f64,
    fell_back: usize,
    /// Steps that the guard refused: the last state stays.
    refused: usize,
    /// How far a node is from rest at the most, mm: by the library, and by the solver.
    farthest_mm: [f64; 2],
    /// ms: a change of the body, median and largest; a step, median and 99 %.
    change_ms: [f64; 2],
    step_ms: [f64; 2],
}

/// What both did in the cases of a programme so far.
#[derive(Default)]
struct Found {
    errors: Vec<[f64; 2]>,
    /// Off, and the solver's own.
    force: [f64; 2],
    blade: [f64; 2],
    /// What new area takes, J/m².
    energy: f64,
    removed: [f64; 2],
    copies: Vec<f64>,
    changes: Vec<f64>,
    steps: Vec<f64>,
    smallest_det: f64,
    fell_back: usize,
    refused: usize,
    farthest_mm: [f64; 2],
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
        let model = Model::open(path, &ModelOptions::default())
            .with_context(|| path.display().to_string())?;
        let recommended = bundle.corrections.unwrap_or(Effort::NONE);
        let efforts = match asked.corrections.as_slice() {
            [] => &[recommended],
            efforts => efforts,
        };
        for effort in efforts {
            for programme in &PROGRAMMES {
                let mut found = Found {
                    smallest_det: 1.0,
                    energy: if programme.feels {
                        FRACTURE_ENERGY
                    } else {
                        0.0
                    },
                    ..Found::default()
                };
                for seed in 1..=asked.cut as u64 {
                    eprintln!(
                        "{}: {} {seed} of {}",
                        bundle.name, programme.name, asked.cut
                    );
                    let scene = Scene::new(Arc::clone(&model), &scene_options(asked, *effort)?)?;
                    let site = Site::of(&scene, seed).context("the domain has no nodes")?;
                    let frames = (programme.frames)(&site);
                    case(
                        asked,
                        &scene,
                        (&mesh, boundary),
                        (&site, &frames),
                        &mut found,
                    )
                    .with_context(|| format!("{} of seed {seed}", programme.name))?;
                }
                let row = Row {
                    bundle: bundle.name.clone(),
                    programme: programme.name,
                    corrections: effort.to_string(),
                    cases: asked.cut,
                    ..found.row()
                };
                rows.push(row);
            }
        }
    }
    let table = Table::of(&[0, 1], &COLUMNS, &rows).markdown();
    match asked.json {
        true => println!("{}", serde_json::to_string_pretty(&rows)?),
        false => print!("{table}"),
    }
    for page in &asked.markdown {
        replace_between(page, "study report --cut", &format!("\n{table}"))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn scene_options(asked: &Options, effort: Effort) -> Result<SceneOptions> {
    Ok(SceneOptions {
        threads: asked.most_threads() as usize,
        corrections: match (effort.most, effort.target_mm) {
            (0, _) => {
                bail!("a scene without corrections cannot be cut; give --corrections at least 1")
            }
            (most, 0.0) => Corrections::Fixed(most),
            (most, target_mm) => Corrections::Auto {
                most,
                target_mm,
                budget_us: 0,
            },
        },
        substeps: effort.substeps,
        ..SceneOptions::default()
    })
}

/// Makes the frames of a case in both.
fn case(
    asked: &Options,
    scene: &Scene,
    (mesh, boundary): (&Mesh, Boundary),
    (site, frames): (&Site, &[Frame]),
    found: &mut Found,
) -> Result<()> {
    let options = SolverOptions {
        material: scene.model().manifest.material,
        threads: asked.most_threads() as usize,
        ..SolverOptions::default()
    };
    let mut truth = Solver::new(mesh, boundary, options)?;
    let rigid = Rigid {
        shape: Shape::Sphere { radius: BALL_MM },
        friction: 0.0,
        tear_off_mn: 0.0,
    };
    let mut ball = ball_at(BALL_MM, site.away())?;
    truth.set_tools(mesh.samples(boundary), &[rigid], &[ball.pose])?;
    let is_near: Vec<bool> = (mesh.positions.iter())
        .map(|place| site.distance(*place) < NEAR_MM)
        .collect();
    let near_count = is_near.iter().filter(|near| **near).count().max(1);
    for frame in frames {
        for operation in &frame.operations {
            operate(scene, &mut truth, mesh, operation, found)?;
        }
        ball.pose.translation = Vector::from(frame.ball.unwrap_or(site.away()));
        ball.mode = match frame.grasp {
            true => Mode::Grasp,
            false => Mode::Slide,
        };
        let pose = ToolPose {
            pose: ball.pose,
            grasp: frame.grasp,
        };
        let told = truth.step_tools(&[], &[pose], FRAME_S)?;
        let mut wanted = vec![[0.0; 3]; truth.node_count()];
        truth.displacement(&mut wanted);
        let mut u = vec![0.0; 3 * scene.node_count()];
        let start = Instant::now();
        let tools = Contact::Tools(std::slice::from_ref(&ball));
        match scene.step(tools, Some(&mut u)) {
            Err(Error::Guard(_)) => {
                found.refused += 1;
                scene.read(&mut u)?;
            }
            other => other?,
        }
        found.steps.push(1e3 * start.elapsed().as_secs_f64());
        let stats = scene.stats();
        // 0 where nothing was corrected.
        if stats.min_det != 0.0 {
            found.smallest_det = found.smallest_det.min(stats.min_det.into());
        }
        found.fell_back += usize::from(stats.flags & upt::flag::FELL_BACK != 0);
        // The mesh's own nodes: copies are made where a corner lies in either.
        let squares =
            (u.as_chunks::<3>().0.iter().zip(&wanted).zip(&is_near)).map(|((a, b), near)| {
                let square = (Vector::from(*a) - Vector::from(*b)).length_squared();
                (f64::from(square), *near)
            });
        let largest = |field: &[[f32; 3]]| {
            let sizes = field.iter().map(|u| Vector::from(*u).length());
            f64::from(sizes.fold(0.0, f32::max))
        };
        for (most, field) in (found.farthest_mm.iter_mut()).zip([u.as_chunks::<3>().0, &wanted]) {
            *most = most.max(largest(field));
        }
        let (mut sum, mut near_sum) = (0.0, 0.0);
        for (square, near) in squares {
            sum += square;
            near_sum += if near { square } else { 0.0 };
        }
        found
            .errors
            .push([sum / is_near.len() as f64, near_sum / near_count as f64]);
        let own = scene.with_contact_report(|report| report.readings[0].force);
        let wanted = Vector::from(told.tools[0].force);
        found.force[0] += f64::from((Vector::from(own) - wanted).length());
        found.force[1] += f64::from(wanted.length());
    }
    found
        .copies
        .push((scene.node_count() - mesh.node_count()) as f64);
    Ok(())
}

/// One operation on both bodies.
fn operate(
    scene: &Scene,
    truth: &mut Solver,
    mesh: &Mesh,
    operation: &Operation,
    found: &mut Found,
) -> Result<()> {
    let start;
    match operation {
        Operation::Blade { stroke, edges } => {
            let blade = Blade {
                energy: found.energy,
                ..Blade::default()
            };
            let wide = edges.map(|edge| edge.map(|place| place.map(f64::from)).to_vec());
            let wanted = truth.cut_with(&blade, &Sweep::new(&wide)?, *stroke)?;
            start = Instant::now();
            let made = scene.cut_with(&blade, *stroke, 2, edges.as_flattened())?;
            let wanted = Vector::from(wanted.force().map(|x| -x as f32));
            found.blade[0] += f64::from((Vector::from(made.force) - wanted).length());
            found.blade[1] += f64::from(wanted.length());
        }
        Operation::Aspirate {
            at,
            radius,
            most_mm3,
        } => {
            let ball = ball_at(*radius, *at)?;
            let depth = |at: [f64; 3]| {
                let at = Vector::from(at.map(|x| x as f32));
                f64::from(-ball.body.nearest_at(&ball.pose, at).distance)
            };
            found.removed[1] += truth.remove(depth, f64::from(*most_mm3))?.removed_mm3;
            start = Instant::now();
            found.removed[0] += f64::from(scene.remove(&ball, *most_mm3)?.removed_mm3);
        }
        Operation::Stiffen { at, radius, factor } => {
            let middle = |corners: &[u32]| {
                let places = corners
                    .iter()
                    .map(|node| Vector::from(mesh.positions[*node as usize]));
                places.sum::<Vector>() / corners.len() as f32
            };
            let near = |corners: &[u32]| (middle(corners) - Vector::from(*at)).length() < *radius;
            let elements: Vec<u32> = (0..)
                .zip(&mesh.tets)
                .filter(|(_, corners)| near(&corners[..]))
                .map(|(element, _)| element)
                .collect();
            truth.scale_stiffness(&elements, *factor)?;
            start = Instant::now();
            scene.scale_stiffness(&elements, *factor)?;
        }
        Operation::Drop => {
            let wanted = truth.drop_fragments()?;
            found.removed[1] += wanted.iter().map(|one| one.volume_mm3).sum::<f64>();
            start = Instant::now();
            let made = scene.drop_fragments()?;
            found.removed[0] += made.iter().map(|volume| f64::from(*volume)).sum::<f64>();
        }
    }
    found.changes.push(1e3 * start.elapsed().as_secs_f64());
    Ok(())
}

fn ball_at(radius: f32, at: [f32; 3]) -> Result<Tool> {
    Ok(Tool::new(
        &Shape::Sphere { radius },
        at,
        [0.0, 0.0, 0.0, 1.0],
    )?)
}

impl Found {
    fn row(mut self) -> Row {
        let all = |which: usize| self.errors.iter().map(move |error| error[which]);
        let ratio = |[off, own]: [f64; 2]| if own > 0.0 { off / own } else { f64::NAN };
        self.steps.sort_by(f64::total_cmp);
        Row {
            copies: median(self.copies.iter().copied()),
            mse: median(all(0)),
            near_mse: median(all(1)),
            worst_mse: all(0).fold(0.0, f64::max),
            force_error: ratio(self.force),
            blade_error: ratio(self.blade),
            removed_ratio: ratio(self.removed),
            smallest_det: self.smallest_det,
            fell_back: self.fell_back,
            refused: self.refused,
            farthest_mm: self.farthest_mm,
            change_ms: [
                median(self.changes.iter().copied()),
                self.changes.iter().copied().fold(0.0, f64::max),
            ],
            step_ms: [quantile(&self.steps, 0.5), quantile(&self.steps, 0.99)],
            ..Row::default()
        }
    }
}

fn percent(part: f64) -> String {
    match part.is_nan() {
        true => "-".into(),
        false => format!("{:.1} %", 100.0 * part),
    }
}

const COLUMNS: [Column<Row>; 14] = [
    ("bundle", |row| format!("`{}`", row.bundle)),
    ("programme", |row| format!("*{}*", row.programme)),
    ("k", |row| row.corrections.clone()),
    ("cases", |row| row.cases.to_string()),
    ("copies", |row| row.copies.to_string()),
    ("MSE, mm² (median; near)", |row| {
        format!("{:.1e}; {:.1e}", row.mse, row.near_mse)
    }),
    ("worst frame", |row| format!("{:.1e}", row.worst_mse)),
    ("force error: ball", |row| percent(row.force_error)),
    ("blade", |row| percent(row.blade_error)),
    ("left, of the solver's", |row| percent(row.removed_ratio)),
    ("largest displacement, mm (the solver's)", |row| {
        format!("{:.1} ({:.1})", row.farthest_mm[0], row.farthest_mm[1])
    }),
    ("smallest det F (fell back, refused)", |row| {
        format!(
            "{:.2} ({}, {})",
            row.smallest_det, row.fell_back, row.refused
        )
    }),
    ("ms a change (longest)", |row| {
        format!("{:.1} ({:.1})", row.change_ms[0], row.change_ms[1])
    }),
    ("ms a step (99 %)", |row| {
        format!("{:.1} ({:.1})", row.step_ms[0], row.step_ms[1])
    }),
];
