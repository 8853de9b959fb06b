//! Writes tables of contact with tools in docs/results/solver.md:
//! `python tests/docs/results.py run solver -- cargo run --release -p tissue --example tool_tables`, which makes the page that it looks for.
//!
//! The text between `<!-- tools -->`, `<!-- penetration -->` or `<!-- hertz -->` and the next `<!-- end -->` is replaced.

use contact::{Body, Pose, Rotation, Samples, Shape, Vector};
use std::error::Error;
use std::path::Path;
use tissue::material::Material;
use tissue::mesh::{Boundary, Mesh, boundary_faces, box_phantom, regular_box};
use tissue::programmes::{TABLE, ToolCase};
use tissue::schemes::FRAME_S;
use tissue::solver::{Solver, SolverOptions, Tool, ToolPose};

type Outcome<T> = Result<T, Box<dyn Error>>;

fn main() -> Outcome<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let page = root.join("target/results/solver.md");
    let brain = Mesh::read(&root.join("onnx/meshes/brain-coarse.mesh.safetensors"))?;
    for (marker, table) in [
        ("penetration", over_time(&brain)?),
        ("tools", properties(&brain)?),
        ("hertz", half_space()?),
    ] {
        print!("{table}");
        let text = std::fs::read_to_string(&page)?;
        std::fs::write(&page, replace(&text, marker, &table)?)?;
    }
    Ok(())
}

fn replace(text: &str, marker: &str, table: &str) -> Outcome<String> {
    let start = format!("<!-- {marker} -->\n");
    let from = text.find(&start).ok_or(format!("no {start:?}"))? + start.len();
    let to = from + text[from..].find("<!-- end -->").ok_or("no end marker")?;
    Ok(format!("{}{table}{}", &text[..from], &text[to..]))
}

fn level(at: Vector) -> Pose {
    Pose::from_parts(at, Rotation::IDENTITY)
}

fn tool(shape: Shape, friction: f32) -> Tool {
    Tool {
        shape,
        friction,
        tear_off_mn: 0.0,
    }
}

/// A block that stands for a half-space: cells of `cell` mm under the tool (within `inner` mm), growing by a quarter outwards to
/// `reach` mm on all sides, its base held. The middle of its top is the origin.
fn graded_block(cell: f32, inner: f32, reach: f32) -> Outcome<Mesh> {
    let mut ticks = vec![0.0f32];
    let mut step = cell;
    while ticks[ticks.len() - 1] < reach {
        let last = ticks[ticks.len() - 1];
        if last >= inner - 1e-3 {
            step *= 1.25;
        }
        ticks.push(last + step);
    }
    let half = ticks.len() - 1;
    let mut mesh = regular_box([1.0; 3], [2 * half, 2 * half, half])?;
    let (sides, depth) = (2.0 * half as f32, half as f32);
    for p in &mut mesh.positions {
        let across = |v: f32| {
            let i = (v * sides).round() as i32 - half as i32;
            ticks[i.unsigned_abs() as usize] * i.signum() as f32
        };
        let down = half - (p[2] * depth).round() as usize;
        *p = [across(p[0]), across(p[1]), -ticks[down]];
    }
    let lowest = -ticks[half];
    mesh.surface = boundary_faces(&mesh.tets)?;
    mesh.fixed = (0..mesh.positions.len() as u32)
        .filter(|n| mesh.positions[*n as usize][2] <= lowest + 1e-3)
        .collect();
    let near = |node: u32| {
        let [x, y, z] = mesh.positions[node as usize];
        z > -1e-3 && x.hypot(y) < inner + 1.0
    };
    mesh.domain = (0..mesh.surface.len() as u32)
        .filter(|row| mesh.surface[*row as usize].iter().all(|n| near(*n)))
        .collect();
    Ok(mesh)
}

/// Presses a tool, its lowest point 0.02 mm above the middle of the top, `depth` in, and gives the force, mN.
fn indent(mesh: &Mesh, shape: Shape, bottom: f32, depth: f32, spacing: f32) -> Outcome<f32> {
    let material = Material {
        poisson: 0.3,
        damping_per_s: 60.0,
        ..Material::default()
    };
    let options = SolverOptions {
        material,
        threads: 2,
        ..SolverOptions::default()
    };
    let mut solver = Solver::new(mesh, Boundary::Fixed, options)?;
    let samples = Samples::of_domain(
        &mesh.positions,
        &mesh.surface,
        &mesh.domain,
        &mesh.fixed,
        spacing,
    );
    let above = Vector::Z * (bottom + 0.02);
    solver.set_tools(samples, &[tool(shape, 0.0)], &[level(above)])?;
    let mut force = 0.0;
    for frame in 1..=16 {
        let part = (frame as f32 / 6.0).min(1.0);
        let to = ToolPose {
            pose: level(above - Vector::Z * (0.02 + depth) * part),
            grasp: false,
        };
        force = solver.step_tools(&[], &[to], FRAME_S)?.tools[0].force[2];
    }
    Ok(force)
}

/// Hertz's sphere and a flat punch on a block of growing fineness.
fn half_space() -> Outcome<String> {
    let material = Material::default();
    // Pa mm² = µN, in mN.
    let modulus = (material.young_pa / (1.0 - 0.3f64.powi(2)) * 1e-3) as f32;
    let (radius, depth) = (40.0f32, 0.4f32);
    let sphere = 4.0 / 3.0 * modulus * radius.sqrt() * depth.powf(1.5);
    let (punch_radius, sunk) = (4.0f32, 0.2f32);
    let punch = 2.0 * punch_radius * modulus * sunk;
    let ring = (0..64).flat_map(|i| {
        let (s, c) = (std::f32::consts::TAU * i as f32 / 64.0).sin_cos();
        [0.0, 8.0].map(|z| [punch_radius * c, punch_radius * s, z])
    });
    let ring: Vec<[f32; 3]> = ring.collect();
    let mut table = String::from(
        "| cells under the tool, mm | nodes | sphere: force, mN | against Hertz | flat punch: force, mN | against 2 a E* d |\n|---|---|---|---|---|---|\n",
    );
    for cell in [2.0f32, 1.0, 0.5] {
        let mesh = graded_block(cell, 6.0, 160.0)?;
        let ball = Shape::Sphere { radius };
        let hertz = indent(&mesh, ball, radius, depth, cell.min(1.7))?;
        let hull = Shape::Hull {
            points: ring.clone(),
            margin: 0.0,
        };
        let flat = indent(&mesh, hull, 0.0, sunk, cell.min(1.7))?;
        let row = format!(
            "| {cell} | {} | {hertz:.3} | {:+.1} % | {flat:.3} | {:+.1} % |\n",
            mesh.node_count(),
            100.0 * (hertz / sphere - 1.0),
            100.0 * (flat / punch - 1.0),
        );
        eprint!("{row}");
        table += &row;
    }
    table += &format!("| closed form | | {sphere:.3} | | {punch:.3} | |\n");
    Ok(table)
}

fn properties(brain: &Mesh) -> Outcome<String> {
    let mut table = String::from("| property | measured |\n|---|---|\n");
    for friction in [0.1f32, 0.3, 0.5] {
        table += &format!(
            "| sphere sliding 12 mm on a block, mu = {friction}: tangential over normal force of its samples | {:.4} |\n",
            sliding(friction)?
        );
    }
    table += &format!(
        "| undamped block, frictionless press of 3 mm and release: energy above the tool's work | {:+.3} % of the largest energy at most |\n",
        100.0 * energy_gain()?
    );
    for name in ["press", "stroke", "two"] {
        let case = ToolCase::new(name.parse()?, brain, 1, None)?;
        let [coarse, usual, fine] = spacing(brain, &case)?;
        table += &format!(
            "| coarse brain, `{name}`, seed 1: MSE of samples 2.8, 1.7 and 0.85 mm apart against 0.42 mm | {coarse:.1e}, {usual:.1e}, {fine:.1e} mm² |\n"
        );
    }
    Ok(table)
}

fn run(
    mesh: &Mesh,
    samples: Samples,
    case: &ToolCase,
    mut each: impl FnMut(&[[f32; 3]], &[ToolPose]),
) -> Outcome<()> {
    let mut solver = Solver::new(mesh, Boundary::Fixed, SolverOptions::default())?;
    solver.set_tools(samples, &case.tools, &case.start)?;
    let mut u = vec![[0.0; 3]; mesh.node_count()];
    for poses in &case.frames {
        solver.step_tools(&[], poses, FRAME_S)?;
        solver.displacement(&mut u);
        each(&u, poses);
    }
    Ok(())
}

fn apart(mesh: &Mesh, spacing: f32) -> Samples {
    let (positions, surface) = (&mesh.positions, &mesh.surface);
    Samples::of_domain(positions, surface, &mesh.domain, &mesh.fixed, spacing)
}

/// Penetration over time: a row a programme, a column a half second.
fn over_time(brain: &Mesh) -> Outcome<String> {
    const HALF_SECOND: usize = (0.5 / FRAME_S + 0.5) as usize;
    let mut rows = Vec::new();
    for programme in TABLE.iter().map(|row| row.name) {
        let case = ToolCase::new(programme.parse()?, brain, 1, None)?;
        let series = penetration(brain, &case)?;
        let deepest = series
            .chunks(HALF_SECOND)
            .map(|part| part.iter().copied().fold(0.0, f32::max));
        rows.push((programme, deepest.collect::<Vec<f32>>()));
    }
    let columns = rows.iter().map(|(_, row)| row.len()).max().unwrap_or(0);
    let mut table = String::from("| programme |");
    for column in 1..=columns {
        table += &format!(" to {} s |", 0.5 * column as f64);
    }
    table += &format!("\n|---|{}\n", "---|".repeat(columns));
    for (programme, row) in rows {
        table += &format!("| `{programme}` |");
        for column in 0..columns {
            let cell = row.get(column);
            table += &cell.map_or(" |".into(), |deepest| format!(" {deepest:.3} |"));
        }
        table += "\n";
    }
    Ok(table)
}

/// Deepest point, mm, of samples 1 mm apart at each frame's end.
fn penetration(mesh: &Mesh, case: &ToolCase) -> Outcome<Vec<f32>> {
    let dense = apart(mesh, 1.0);
    let bodies = case.tools.iter().map(|t| Body::new(&t.shape));
    let bodies: Vec<Body> = bodies.collect::<Result<_, _>>()?;
    let mut series = Vec::new();
    run(mesh, mesh.samples(Boundary::Fixed), case, |u, poses| {
        let position =
            |n: u32| Vector::from(mesh.positions[n as usize]) + Vector::from(u[n as usize]);
        let mut deepest = 0.0f32;
        for sample in dense.rows() {
            let point = sample.gather(position);
            for (body, to) in bodies.iter().zip(poses) {
                deepest = deepest.max(-body.nearest_at(&to.pose, point).distance);
            }
        }
        series.push(deepest);
    })?;
    Ok(series)
}

/// Mean squared difference, mm², of spacings from the finest.
fn spacing(mesh: &Mesh, case: &ToolCase) -> Outcome<[f64; 3]> {
    let mut reference: Vec<Vec<[f32; 3]>> = Vec::new();
    run(mesh, apart(mesh, 0.42), case, |u, _| {
        reference.push(u.to_vec())
    })?;
    let mut errors = [0.0; 3];
    for (error, spacing) in errors.iter_mut().zip([2.8, 1.7, 0.85]) {
        let mut frame = 0;
        run(mesh, apart(mesh, spacing), case, |u, _| {
            let pairs = u.as_flattened().iter().zip(reference[frame].as_flattened());
            let sum: f64 = pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum();
            *error += sum / (u.len() * reference.len()) as f64;
            frame += 1;
        })?;
    }
    Ok(errors)
}

fn bench(damping_per_s: f64, friction: f32, start: Vector) -> Outcome<(Mesh, Solver)> {
    let mesh = box_phantom([40.0, 40.0, 20.0], [10, 10, 5])?;
    let material = Material {
        poisson: 0.45,
        damping_per_s,
        ..Material::default()
    };
    let options = SolverOptions {
        material,
        ..SolverOptions::default()
    };
    let mut solver = Solver::new(&mesh, Boundary::Fixed, options)?;
    let ball = Shape::Sphere { radius: 6.0 };
    let samples = mesh.samples(Boundary::Fixed);
    solver.set_tools(samples, &[tool(ball, friction)], &[level(start)])?;
    Ok((mesh, solver))
}

fn sliding(friction: f32) -> Outcome<f32> {
    let start = Vector::new(14.0, 20.0, 26.2);
    let (mesh, mut solver) = bench(20.0, friction, start)?;
    let samples = mesh.samples(Boundary::Fixed);
    let mut u = vec![[0.0; 3]; mesh.node_count()];
    let (mut across, mut along) = (0.0, 0.0);
    for frame in 1..=30 {
        let down = 1.7 * (frame as f32 / 6.0).min(1.0);
        let slid = 0.5 * (frame as f32 - 6.0).max(0.0);
        let at = start + Vector::new(slid, 0.0, -down);
        let to = ToolPose {
            pose: level(at),
            grasp: false,
        };
        let report = solver.step_tools(&[], &[to], FRAME_S)?;
        if frame <= 15 {
            continue;
        }
        solver.displacement(&mut u);
        let position =
            |n: u32| Vector::from(mesh.positions[n as usize]) + Vector::from(u[n as usize]);
        // Reported forces are means over 2 ms: in their middle the tool was 0.01 mm back.
        let centre = at - Vector::X * 0.01;
        for entry in &report.sample_forces {
            let point = samples.at(entry.sample).gather(position);
            let normal = (point - centre).normalize();
            let force = Vector::from(entry.force);
            let push = force.dot(normal);
            along += push;
            across += (force - normal * push).length();
        }
    }
    Ok(across / along)
}

fn energy_gain() -> Outcome<f64> {
    let start = Vector::new(20.0, 20.0, 26.2);
    let (_, mut solver) = bench(0.0, 0.0, start)?;
    let (mut most, mut gain) = (0.0f64, f64::NEG_INFINITY);
    for frame in 1..=24 {
        let part = match frame {
            1..=8 => (frame as f32 / 6.0).min(1.0),
            9..=14 => (14 - frame) as f32 / 6.0,
            _ => -1.0,
        };
        let to = ToolPose {
            pose: level(start - Vector::Z * 3.2 * part),
            grasp: false,
        };
        let report = solver.step_tools(&[], &[to], FRAME_S)?;
        let energy = report.strain_energy + report.kinetic_energy;
        most = most.max(energy);
        gain = gain.max(energy - report.tools[0].work);
    }
    Ok(gain / most)
}
