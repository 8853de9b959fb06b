//! `upt-study report --cut`: bodies that are cut, resected and hardened, through the library and the reference solver.
//!
//! Both get the same blades, aspirators and balls, step by step from their own last state. The solver runs here: a case is one or two seconds of tissue.

mod programmes;
mod site;

use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use contact::{Shape, Vector};
use serde::Serialize;
use tissue::schemes::FRAME_S;
use tissue::solver::{Solver, Tool as Rigid, ToolPose};
use topology::Sweep;
use upt::{Blade, Contact, Mode, Scene, Tool};

use crate::beside::{self, Relative, Steps, Subject, largest, percent, square};
use crate::report::options::Options;
use crate::table::Column;
use gauge::{Sorted, median};
use programmes::{BALL_MM, Frame, Operation, PROGRAMMES, Programme};
use site::Site;

/// What the blades of the programmes feel, J/m².
const FRACTURE_ENERGY: f64 = 10.0;
/// Near to the cut: this far from its place, mm.
const NEAR_MM: f32 = 25.0;
/// A ball this far aside is the same press, mm: what its force changes by is no error of anybody.
const HARMLESS_MM: f32 = 0.05;
/// A frame in which neither has moved a node farther from rest than this says nothing of the error, mm.
const STILL_MM: f64 = 0.1;

/// A programme with a bundle.
#[derive(Default, Serialize)]
struct Row {
    bundle: String,
    programme: &'static str,
    corrections: String,
    cases: usize,
    /// Nodes that cuts have added at the end, median of the cases.
    copies: f64,
    /// Mean of the squared distance over nodes, mm²: median over the frames of all cases in which anything has moved, everywhere and near to the cut, and the worst frame.
    mse: f64,
    near_mse: f64,
    worst_mse: f64,
    /// Sums over frames and cases: what the force on the ball is off by, over what it is; and that of the blade.
    force_error: Option<f64>,
    /// What the solver's own force changes by where the ball is [`HARMLESS_MM`] aside.
    force_spread: Option<f64>,
    blade_error: Option<f64>,
    /// Volume that has left, of the library over the solver's.
    removed_ratio: Option<f64>,
    smallest_det: f64,
    fell_back: usize,
    refused: usize,
    /// How far a node is from rest at the most, mm: by the library, and by the solver.
    farthest_mm: [f64; 2],
    /// What a node goes at the most in a frame that changes the body, mm, the same.
    jump_mm: [f64; 2],
    /// ms: a change of the body, median and largest; a step, median and 99 %.
    change_ms: [f64; 2],
    step_ms: [f64; 2],
}

/// What both did in the cases of a programme so far.
#[derive(Default)]
struct Found {
    errors: Vec<[f64; 2]>,
    force: Relative,
    /// Between the solver and the solver with the ball [`HARMLESS_MM`] aside.
    twin: Relative,
    blade: Relative,
    /// What new area takes, J/m².
    energy: f64,
    removed: [f64; 2],
    copies: Vec<f64>,
    changes: Vec<f64>,
    steps: Steps,
    farthest_mm: [f64; 2],
    jump_mm: [f64; 2],
}

/// Measures and prints the table.
pub fn report(asked: &Options) -> Result<ExitCode> {
    let names = PROGRAMMES.map(|programme| programme.name);
    if let Some(other) = (asked.programme.iter()).find(|name| !names.contains(&name.as_str())) {
        bail!("--programme: `{other}` is none of {}", names.join(", "));
    }
    beside::report(
        asked,
        "study report --cut",
        (&[0, 1], &COLUMNS),
        |subject| {
            let mut rows = Vec::new();
            for effort in &subject.efforts {
                let is_asked = |programme: &&Programme| {
                    let names = &asked.programme;
                    match names.is_empty() {
                        true => !programme.is_long,
                        false => names.iter().any(|name| name == programme.name),
                    }
                };
                for programme in PROGRAMMES.iter().filter(is_asked) {
                    let mut found = Found {
                        energy: if programme.feels {
                            FRACTURE_ENERGY
                        } else {
                            0.0
                        },
                        ..Found::default()
                    };
                    for seed in 1..=asked.cut as u64 {
                        let Programme { name, .. } = programme;
                        eprintln!("{}: {name} {seed} of {}", subject.name, asked.cut);
                        let scene = subject.scene(*effort)?;
                        let site = Site::of(&scene, seed).context("the domain has no nodes")?;
                        let mut frames = match programme.elsewhere {
                            Some(before) => {
                                before(&site.another(&scene).context("no second site")?)
                            }
                            None => Vec::new(),
                        };
                        frames.extend((programme.frames)(&site));
                        case(&subject, &scene, (&site, &frames), &mut found)
                            .with_context(|| format!("{name} of seed {seed}"))?;
                    }
                    rows.push(Row {
                        bundle: subject.name.clone(),
                        programme: programme.name,
                        corrections: effort.to_string(),
                        cases: asked.cut,
                        ..found.row()
                    });
                }
            }
            Ok(rows)
        },
    )
}

/// Makes the frames of a case in both.
fn case(
    subject: &Subject,
    scene: &Scene,
    (site, frames): (&Site, &[Frame]),
    found: &mut Found,
) -> Result<()> {
    let (mesh, boundary) = (&subject.mesh, subject.boundary);
    let mut truth = Solver::new(mesh, boundary, subject.solver())?;
    let rigid = Rigid {
        shape: Shape::Sphere { radius: BALL_MM },
        friction: 0.0,
        tear_off_mn: 0.0,
    };
    let mut ball = ball_at(BALL_MM, site.away())?;
    truth.set_tools(
        mesh.samples(boundary),
        std::slice::from_ref(&rigid),
        &[ball.pose],
    )?;
    let near: Vec<usize> = (0..mesh.node_count())
        .filter(|node| site.distance(mesh.positions[*node]) < NEAR_MM)
        .collect();
    let mut twin = Solver::new(mesh, boundary, subject.solver())?;
    twin.set_tools(mesh.samples(boundary), &[rigid], &[ball.pose])?;
    // Where the mesh's nodes were in the frame before: by the library, and by the solver.
    let mut before = [(); 2].map(|()| vec![[0.0; 3]; mesh.node_count()]);
    for frame in frames {
        for operation in &frame.operations {
            operate((subject, scene), (&mut truth, &mut twin), operation, found)?;
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
        let mut aside = pose;
        aside.pose.translation += Vector::splat(HARMLESS_MM / 3.0_f32.sqrt());
        let other = twin.step_tools(&[], &[aside], FRAME_S)?;
        let force = Vector::from(other.tools[0].force);
        (found.twin).add(force.to_array(), Vector::from(told.tools[0].force));
        let mut wanted = vec![[0.0; 3]; truth.node_count()];
        truth.displacement(&mut wanted);
        let mut u = vec![0.0; 3 * scene.node_count()];
        let tools = Contact::Tools(std::slice::from_ref(&ball));
        found.steps.step(scene, tools.into(), &mut u)?;
        let u = u.as_chunks::<3>().0;
        let farthest = [u, &wanted].map(|field| {
            let sizes = field.iter().map(|u| Vector::from(*u).length().into());
            largest(sizes)
        });
        for (most, own) in found.farthest_mm.iter_mut().zip(farthest) {
            *most = most.max(own);
        }
        for ((most, before), now) in found.jump_mm.iter_mut().zip(&mut before).zip([u, &wanted]) {
            let now = &now[..before.len()];
            let went = before.iter().zip(now).map(|(a, b)| square(*a, *b).sqrt());
            if !frame.operations.is_empty() {
                *most = most.max(largest(went));
            }
            before.copy_from_slice(now);
        }
        // The mesh's own nodes: copies are made where a corner lies in either.
        let at = |node: usize| square(u[node], wanted[node]);
        let all = (0..mesh.node_count()).map(at).sum::<f64>() / mesh.node_count() as f64;
        let close = near.iter().map(|node| at(*node)).sum::<f64>() / near.len().max(1) as f64;
        if farthest[0].max(farthest[1]) > STILL_MM {
            found.errors.push([all, close]);
        }
        let own = scene.with_contact_report(|report| report.readings[0].force);
        found.force.add(own, Vector::from(told.tools[0].force));
    }
    let [own, told] = found.jump_mm;
    eprintln!(
        "changes of the body move a node by {own:.3} mm a frame at the most, by {told:.3} in the solver"
    );
    let copies = scene.node_count() - mesh.node_count();
    found.copies.push(copies as f64);
    Ok(())
}

/// One operation on both bodies.
fn operate(
    (subject, scene): (&Subject, &Scene),
    (truth, twin): (&mut Solver, &mut Solver),
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
            twin.cut_with(&blade, &Sweep::new(&wide)?, *stroke)?;
            start = Instant::now();
            let made = scene.cut_with(&blade, *stroke, 2, edges.as_flattened())?;
            let wanted = Vector::from(wanted.force().map(|x| -x as f32));
            found.blade.add(made.force, wanted);
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
            twin.remove(depth, f64::from(*most_mm3))?;
            start = Instant::now();
            found.removed[0] += f64::from(scene.remove(&ball, *most_mm3)?.removed_mm3);
        }
        Operation::Stiffen { at, radius, factor } => {
            let mesh = &subject.mesh;
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
            twin.scale_stiffness(&elements, *factor)?;
            start = Instant::now();
            scene.scale_stiffness(&elements, *factor)?;
        }
        Operation::Drop => {
            let wanted = truth.drop_fragments()?;
            twin.drop_fragments()?;
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
    fn row(self) -> Row {
        let all = |which: usize| self.errors.iter().map(move |error| error[which]);
        let [removed, wanted] = self.removed;
        let ms = Sorted::of(self.steps.ms);
        Row {
            copies: median(self.copies.iter().copied()),
            mse: median(all(0)),
            near_mse: median(all(1)),
            worst_mse: largest(all(0)),
            force_error: self.force.ratio(),
            force_spread: self.twin.ratio(),
            blade_error: self.blade.ratio(),
            removed_ratio: (wanted > 0.0).then(|| removed / wanted),
            smallest_det: self.steps.smallest_det,
            fell_back: self.steps.fell_back,
            refused: self.steps.refused,
            farthest_mm: self.farthest_mm,
            jump_mm: self.jump_mm,
            change_ms: [
                median(self.changes.iter().copied()),
                largest(self.changes.iter().copied()),
            ],
            step_ms: [ms.median(), ms.quantile(0.99)],
            ..Row::default()
        }
    }
}

const COLUMNS: [Column<Row>; 15] = [
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
    ("the solver's own", |row| percent(row.force_spread)),
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
