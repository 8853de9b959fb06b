//! `upt-study report --mobilise`: a part of what holds an organ is led against the rest, let go under gravity, and held again where the organ is then; through the library
//! and the reference solver, without a tool and with a ball that is pressed in meanwhile.
//!
//! The bundle's held nodes become two groups here, the third of them that is farthest along x and the rest. Both sides hold the group again where they have it then.

use std::cmp::Ordering;
use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result, ensure};
use contact::{Rotation, Shape, Vector};
use gauge::median;
use host::Effort;
use serde::Serialize;
use serde_json::json;
use tissue::mesh::Mesh;
use tissue::schemes::FRAME_S;
use tissue::solver::{ContactNode, Loads as TrueLoads, Solver, Tool as Rigid, ToolPose};
use upt::{Contact, GroupMotion, Loads, StepInput, SupportPose, Tool};
use yardstick::manifest::Manifest;

use crate::beside::{self, Relative, Steps, Subject, largest, percent, square};
use crate::report::options::Options;
use crate::table::Column;

/// Led, let go, held again, led back: a second each.
const STEPS: u32 = 80;
const LED_MM: f32 = 2.0;
const TURNED_RAD: f32 = 0.01;
/// Of the ball, and how deep it goes, mm.
const RADIUS_MM: f32 = 8.0;
const DEPTH_MM: f32 = 6.0;
/// The one that moves.
const GROUP: u32 = 1;

/// A bundle, without the ball or with it.
#[derive(Serialize)]
struct Row {
    bundle: String,
    nodes: usize,
    tool: &'static str,
    corrections: String,
    /// Nodes of the group, and how far the solver's go, mm.
    group: usize,
    farthest_mm: f64,
    /// Over the steps, and of those in which the group is led or held; mm².
    mse: f64,
    led_mse: f64,
    worst_mse: f64,
    force_error: Option<f64>,
    smallest_det: f64,
    step_ms: f64,
}

/// Measures and prints the table.
pub fn report(asked: &Options) -> Result<ExitCode> {
    let mark = "study report --mobilise";
    beside::report(asked, mark, (&[0, 2], &COLUMNS), |subject| {
        let folder = asked.out.join(format!("mobilise-{}", subject.name));
        let held = subject.mesh.held_nodes(subject.boundary);
        let group = in_groups(&subject.path, &held, &subject.mesh, &folder)?;
        let subject = subject.in_copy(&folder)?;
        let mut rows = Vec::new();
        for with_ball in [false, true] {
            for effort in &subject.efforts {
                eprintln!("{}: {effort}, ball: {with_ball}", subject.name);
                rows.push(compare(asked, &subject, &group, (*effort, with_ball))?);
            }
        }
        Ok(rows)
    })
}

/// A copy of a bundle, its body's files with it, whose held nodes are two groups; the nodes of the second.
fn in_groups(path: &Path, held: &[u32], mesh: &Mesh, to: &Path) -> Result<Vec<u32>> {
    let manifest = Manifest::read(path)?;
    let body: Option<String> = manifest.get("body")?;
    let own = body.map(|name| path.join("..").join(name));
    std::fs::create_dir_all(to).with_context(|| to.display().to_string())?;
    for folder in own.iter().map(|own| own.as_path()).chain([path]) {
        let entries = std::fs::read_dir(folder);
        for entry in entries.with_context(|| folder.display().to_string())? {
            let entry = entry?;
            if entry.file_type()?.is_file() {
                std::fs::copy(entry.path(), to.join(entry.file_name()))?;
            }
        }
    }
    // Of nodes in one plane, as a brain's are that is held at its middle, the coordinates that follow decide.
    let place = |node: &u32| mesh.positions[*node as usize];
    let mut rest = held.to_vec();
    rest.sort_by(|a, b| {
        let pairs = place(a).into_iter().zip(place(b));
        let ordered = pairs.map(|(a, b)| a.total_cmp(&b));
        ordered.fold(Ordering::Equal, Ordering::then)
    });
    let mut group = rest.split_off(2 * held.len() / 3);
    rest.sort_unstable();
    group.sort_unstable();
    let mut manifest = Manifest::read(to)?;
    let groups = json!([{"name": "bed", "nodes": rest}, {"name": "ligament", "nodes": group}]);
    manifest.set("supports", &groups, "prior")?;
    manifest.write()?;
    Ok(group)
}

/// What the group does in a step.
fn motion(step: u32) -> GroupMotion<'static> {
    let eased = |s: f32| s * s * (3.0 - 2.0 * s);
    let led = |z: f32, angle: f32| GroupMotion {
        group: GROUP,
        pose: Some(SupportPose {
            position: [0.0, 0.0, z],
            rotation: [0.0, (0.5 * angle).sin(), 0.0, (0.5 * angle).cos()],
        }),
        ..GroupMotion::default()
    };
    match step {
        0..20 => {
            let part = eased((step + 1) as f32 / 20.0);
            led(LED_MM * part, TURNED_RAD * part)
        }
        20..40 => GroupMotion {
            group: GROUP,
            let_go: true,
            ..GroupMotion::default()
        },
        40..60 => led(0.0, 0.0),
        _ => led(-LED_MM * eased((step - 59) as f32 / 20.0), 0.0),
    }
}

/// Where the ball presses.
struct Site {
    /// Its middle when it begins, a millimetre above the tissue.
    start: Vector,
    outward: Vector,
}

/// Above the node in the middle of the domain, clear of folds beside it.
fn site(mesh: &Mesh) -> Result<Site> {
    let place = |node: u32| Vector::from(mesh.positions[node as usize]);
    let faces = mesh.domain.iter().map(|face| mesh.surface[*face as usize]);
    let mut corners: Vec<u32> = faces.clone().flatten().collect();
    corners.sort_unstable();
    corners.dedup();
    let sum = (corners.iter()).fold(Vector::ZERO, |sum, node| sum + place(*node));
    let middle = sum / corners.len() as f32;
    let far = |node: &&u32| (place(**node) - middle).length();
    let nearest = |a: &&u32, b: &&u32| far(a).total_cmp(&far(b));
    let node = *corners.iter().min_by(nearest).context("no domain")?;
    let own = faces.filter(|face| face.contains(&node));
    let normal = own.fold(Vector::ZERO, |sum, [a, b, c]| {
        sum + (place(b) - place(a)).cross(place(c) - place(a))
    });
    let outward = normal.normalize();
    let mut start = place(node) + outward * (RADIUS_MM + 1.0);
    let surface = || mesh.surface.as_flattened().iter();
    while surface().any(|node| (place(*node) - start).length() < RADIUS_MM + 0.5) {
        start += outward * 0.5;
    }
    Ok(Site { start, outward })
}

fn ball(site: &Site, step: u32) -> Result<Tool> {
    let way = (DEPTH_MM + 1.0) * (step as f32 / 25.0).min(1.0);
    let shape = Shape::Sphere { radius: RADIUS_MM };
    let at = site.start - site.outward * way;
    Ok(Tool::new(&shape, at.to_array(), [0.0, 0.0, 0.0, 1.0])?)
}

fn compare(
    asked: &Options,
    subject: &Subject,
    group: &[u32],
    (effort, with_ball): (Effort, bool),
) -> Result<Row> {
    let (mesh, boundary) = (&subject.mesh, subject.boundary);
    let scene = subject.scene(effort)?;
    let mut truth = Solver::new(mesh, boundary, subject.solver())?;
    truth.let_go(group)?;
    let gravity = asked.load_sizes.sizes().gravity_m_s2;
    let site = site(mesh)?;
    if with_ball {
        let rigid = Rigid {
            shape: Shape::Sphere { radius: RADIUS_MM },
            friction: 0.0,
            tear_off_mn: 0.0,
        };
        truth.set_tools(mesh.samples(boundary), &[rigid], &[ball(&site, 0)?.pose])?;
    }
    let mut u = vec![0.0; 3 * scene.node_count()];
    let mut wanted = vec![[0.0f32; 3]; mesh.node_count()];
    let mut grip = Vec::new();
    let (mut errors, mut led, mut steps) = (Vec::new(), Vec::new(), Steps::default());
    let (mut force, mut farthest) = (Relative::default(), 0.0f64);
    for step in 0..STEPS {
        let motion = motion(step);
        let part = (2.0 * f64::from(step + 1) / f64::from(STEPS)).min(1.0);
        let pulls = gravity.map(|g| part * g);
        let pressing = [ball(&site, step)?];
        let supports = [motion];
        let input = StepInput {
            contact: match with_ball {
                true => Contact::Tools(&pressing),
                false => Contact::None,
            },
            loads: Loads {
                gravity: pulls.map(|g| g as f32),
                supports: &supports,
                ..Loads::default()
            },
            ..StepInput::default()
        };
        steps.step(&scene, input, &mut u)?;
        ensure!(steps.refused == 0, "the guard refused a step");
        truth.set_loads(&TrueLoads {
            gravity: pulls.map(|g| 1e3 * g),
            ..TrueLoads::default()
        })?;
        if step == 40 {
            grip = group.iter().map(|node| wanted[*node as usize]).collect();
        }
        let held = held_at(mesh, group, &grip, &motion);
        let poses = [ToolPose {
            pose: pressing[0].pose,
            grasp: false,
        }];
        let tools = if with_ball { &poses[..] } else { &[] };
        let report = truth.step_tools(&held, tools, FRAME_S)?;
        truth.displacement(&mut wanted);
        let rows = u.as_chunks::<3>().0.iter().zip(&wanted);
        let error = rows.map(|(a, b)| square(*a, *b)).sum::<f64>() / wanted.len() as f64;
        errors.push(error);
        if !motion.let_go {
            led.push(error);
        }
        let far = group
            .iter()
            .map(|node| square(wanted[*node as usize], [0.0; 3]));
        farthest = far.fold(farthest, f64::max);
        if with_ball && step > 2 {
            let own = scene.with_contact_report(|report| report.readings[0].force);
            force.add(own, Vector::from(report.tools[0].force));
        }
    }
    Ok(Row {
        bundle: subject.name.clone(),
        nodes: mesh.node_count(),
        tool: if with_ball { "ball" } else { "none" },
        corrections: effort.to_string(),
        group: group.len(),
        farthest_mm: farthest.sqrt(),
        mse: median(errors.iter().copied()),
        led_mse: median(led),
        worst_mse: largest(errors),
        force_error: force.ratio(),
        smallest_det: steps.smallest_det,
        step_ms: median(steps.ms),
    })
}

/// Where the solver's nodes of the group end in a step; none where it is let go.
fn held_at(
    mesh: &Mesh,
    group: &[u32],
    grip: &[[f32; 3]],
    motion: &GroupMotion<'_>,
) -> Vec<ContactNode> {
    let (false, Some(pose)) = (motion.let_go, motion.pose) else {
        return Vec::new();
    };
    let [x, y, z, w] = pose.rotation;
    let turn = Rotation::from_xyzw(x, y, z, w);
    let nodes = group.iter().enumerate().map(|(index, &node)| {
        let rest = Vector::from(mesh.positions[node as usize]);
        let held = rest + grip.get(index).map_or(Vector::ZERO, |g| Vector::from(*g));
        let there = turn * held + Vector::from(pose.position);
        ContactNode {
            node,
            displacement: (there - rest).to_array(),
        }
    });
    nodes.collect()
}

const COLUMNS: [Column<Row>; 12] = [
    ("bundle", |row| format!("`{}`", row.bundle)),
    ("nodes", |row| row.nodes.to_string()),
    ("tool", |row| row.tool.into()),
    ("k", |row| row.corrections.clone()),
    ("group, nodes", |row| row.group.to_string()),
    ("farthest, mm", |row| format!("{:.2}", row.farthest_mm)),
    ("MSE, mm² (median)", |row| format!("{:.2e}", row.mse)),
    ("held or led", |row| format!("{:.2e}", row.led_mse)),
    ("worst", |row| format!("{:.2e}", row.worst_mse)),
    ("force error", |row| percent(row.force_error)),
    ("smallest det F", |row| format!("{:.2}", row.smallest_det)),
    ("ms a step", |row| format!("{:.1}", row.step_ms)),
];
