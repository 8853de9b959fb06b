//! `upt rollout`: a bundle through one contact, autoregressively, through the C calls that a host makes.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Result, bail};
use clap::Args;
use host::Effort;
use serde_json::json;
use tissue::mesh::Mesh;
use tissue::trajectory::Trajectory;
use yardstick::bundle_folder::BundleFolder;
use yardstick::errors::{CaseErrors, step_errors};
use yardstick::setting::{Precision, Provider, Region};
use yardstick::surrogate::{self, Surrogate};

use crate::one_of::one_of;
use picture::render::{Image, Palette, contact_camera, deformed, lengths};

#[derive(Args)]
#[command(after_help = "Examples:
  upt rollout onnx/brain-reduced push.trajectory.safetensors
  upt rollout onnx/brain-fast push.trajectory.safetensors --png push.png --vtu frames/
  upt rollout onnx/brain-fast push.trajectory.safetensors --json > errors.json")]
pub struct Options {
    /// Bundle folder.
    bundle: PathBuf,
    /// A trajectory on the bundle's mesh (`upt simulate` writes one).
    trajectory: PathBuf,
    /// Threads of a step.
    #[arg(long, default_value_t = 1)]
    threads: u32,
    #[arg(long, default_value = "f32", value_parser = one_of(&Precision::ALL, Precision::name))]
    precision: Precision,
    #[arg(long, default_value = "cpu", value_parser = one_of(&Provider::ALL, Provider::name))]
    provider: Provider,
    /// Write a VTU file per frame, with prediction, truth and error, and a PVD file that lists them.
    #[arg(long, value_name = "FOLDER")]
    vtu: Option<PathBuf>,
    /// Write a picture of the deepest push: truth, prediction, error side by side.
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,
    /// Corrections per step, 0 to 64. Default: as many as the bundle recommends.
    #[arg(long)]
    corrections: Option<Effort>,
    /// Leave out the Hausdorff distance (the slowest of the metrics).
    #[arg(long)]
    no_hausdorff: bool,
    /// Machine-readable output with every step.
    #[arg(long)]
    json: bool,
}

pub fn run(options: &Options) -> Result<ExitCode> {
    let bundle = BundleFolder::read(&options.bundle)?;
    let trajectory = Trajectory::read(&options.trajectory)?;
    let mesh = Mesh::read(&bundle.mesh_file)?;
    if trajectory.header.mesh_sha256 != bundle.mesh_sha256 {
        bail!(
            "{}: simulated on a mesh ({}) other than the bundle's",
            options.trajectory.display(),
            trajectory.header.mesh_name
        );
    }
    if trajectory.header.boundary != bundle.boundary {
        eprintln!(
            "note: the trajectory has the boundary `{}`, the bundle was made for `{}`",
            trajectory.header.boundary, bundle.boundary
        );
    } else if let Some(reason) = bundle.misfit(&trajectory.header) {
        eprintln!("note: {reason}");
    }
    let corrections = match (options.corrections, bundle.corrections) {
        (Some(count), _) => count,
        (None, recommended) => recommended.unwrap_or(Effort::NONE),
    };
    let settings = surrogate::settings(
        options.threads,
        options.provider,
        options.precision,
        corrections,
        trajectory.header.material.damping_per_s,
    );
    let mut surrogate = Surrogate::new(&bundle, &settings, Region::All)?;
    let mut field = vec![[0.0f32; 3]; mesh.node_count()];
    let (mut steps, mut times, mut frames) = (Vec::new(), Vec::new(), Vec::new());
    let (mut estimates, mut forces) = (Vec::new(), Vec::new());
    for frame in 1..trajectory.frame_count() {
        let (nodes, vectors) = trajectory.contact(frame);
        times.push(surrogate.step(nodes, vectors, &mut field)?);
        estimates.push(surrogate.estimated_mm()?);
        let force = surrogate.contact_force(nodes.len())?;
        forces.push((!nodes.is_empty()).then(|| Forces {
            found: total(&force),
            wanted: total(trajectory.reaction(frame)),
        }));
        steps.push(step_errors(
            &mesh.positions,
            trajectory.frame(frame),
            &field,
            trajectory.header.site,
            !options.no_hausdorff,
        ));
        frames.push(field.clone());
    }
    let errors = CaseErrors::over(steps);
    if let Some(path) = &options.png {
        write_png(path, &mesh, &trajectory, &frames)?;
    }
    if let Some(folder) = &options.vtu {
        write_vtu(folder, &mesh, &trajectory, &frames)?;
    }
    print(options, &trajectory, &errors, &times, &estimates, &forces)?;
    Ok(ExitCode::SUCCESS)
}

/// Sums over the contact nodes of a step, mN.
#[derive(serde::Serialize)]
struct Forces {
    /// `upt_scene_read_contact_force`.
    found: [f64; 3],
    /// The trajectory's.
    wanted: [f64; 3],
}

fn total(forces: &[[f32; 3]]) -> [f64; 3] {
    [0, 1, 2].map(|k| forces.iter().map(|force| f64::from(force[k])).sum())
}

fn print(
    options: &Options,
    trajectory: &Trajectory,
    errors: &CaseErrors,
    times: &[f64],
    estimates: &[Option<f32>],
    forces: &[Option<Forces>],
) -> Result<()> {
    let median = gauge::median(times);
    if options.json {
        let report = json!({
            "trajectory": options.trajectory, "bundle": options.bundle, "scheme": trajectory.header.scheme,
            "overall": errors.overall, "ms_p50": median, "steps": errors.steps, "ms": times,
            "estimated_mm": estimates, "force_mn": forces,
        });
        println!("{}", serde_json::to_string_pretty(&report)?);
        return Ok(());
    }
    println!(
        "{:>6} {:>10} {:>9} {:>12} {:>8} {:>8}",
        "time s", "MSE mm²", "rel. L2", "Hausdorff mm", "max mm", "ms"
    );
    for (index, (step, ms)) in errors.steps.iter().zip(times).enumerate() {
        if (index + 1) % 10 == 0 {
            let time = (index + 1) as f64 * trajectory.header.dt_s;
            println!(
                "{time:>6.2} {:>10.5} {:>9.4} {:>12.3} {:>8.3} {ms:>8.3}",
                step.mse_mm2, step.relative_l2, step.hausdorff_mm, step.max_mm
            );
        }
    }
    let overall = errors.overall;
    println!(
        "overall (first step excluded): MSE {:.5} mm², relative L2 {:.4}, Hausdorff {:.3} mm, max {:.3} mm; {median:.3} ms a step (median), {} steps",
        overall.mse_mm2,
        overall.relative_l2,
        overall.hausdorff_mm,
        overall.max_mm,
        times.len()
    );
    Ok(())
}

/// Truth, prediction and error of the deepest push, from left to right.
fn write_png(
    path: &Path,
    mesh: &Mesh,
    trajectory: &Trajectory,
    frames: &[Vec<[f32; 3]>],
) -> Result<()> {
    let largest = |values: &[f32]| values.iter().copied().fold(0.0f32, f32::max);
    let deepest = (1..trajectory.frame_count())
        .max_by(|a, b| {
            largest(&lengths(trajectory.frame(*a)))
                .total_cmp(&largest(&lengths(trajectory.frame(*b))))
        })
        .unwrap_or(1);
    let (width, height) = (760, 560);
    let camera = contact_camera(&mesh.positions, trajectory.header.site, width, height);
    let truth = trajectory.frame(deepest);
    let predicted = &frames[deepest - 1];
    let error: Vec<[f32; 3]> = truth
        .iter()
        .zip(predicted)
        .map(|(a, b)| [0, 1, 2].map(|k| a[k] - b[k]))
        .collect();
    let scale = (0.75 * largest(&lengths(truth))).max(0.5);
    let error_lengths = lengths(&error);
    let panels = [
        (truth, lengths(truth), Palette::Displacement, scale),
        (
            predicted.as_slice(),
            lengths(predicted),
            Palette::Displacement,
            scale,
        ),
        (
            predicted.as_slice(),
            error_lengths.clone(),
            Palette::Error,
            largest(&error_lengths).max(0.1),
        ),
    ];
    let mut image = Image::filled(3 * width, height, [255, 255, 255, 255]);
    for (index, (field, values, palette, full_scale)) in panels.into_iter().enumerate() {
        let panel = deformed(mesh, field, &values, palette, full_scale, &camera);
        image.blend(&panel, index * width, 0);
    }
    std::fs::write(path, image.png()?)?;
    eprintln!(
        "{}: {:.2} s; truth, prediction (dark: {scale:.1} mm), error (dark: {:.2} mm)",
        path.display(),
        deepest as f64 * trajectory.header.dt_s,
        largest(&error_lengths).max(0.1)
    );
    Ok(())
}

fn write_vtu(
    folder: &Path,
    mesh: &Mesh,
    trajectory: &Trajectory,
    frames: &[Vec<[f32; 3]>],
) -> Result<()> {
    std::fs::create_dir_all(folder)?;
    let mut listed = String::new();
    for (index, predicted) in frames.iter().enumerate() {
        let truth = trajectory.frame(index + 1);
        let name = format!("frame-{:04}.vtu", index + 1);
        std::fs::write(folder.join(&name), vtu(mesh, predicted, truth))?;
        let time = (index + 1) as f64 * trajectory.header.dt_s;
        listed += &format!("<DataSet timestep=\"{time}\" file=\"{name}\"/>\n");
    }
    let pvd = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\"><Collection>\n{listed}</Collection></VTKFile>\n"
    );
    std::fs::write(folder.join("rollout.pvd"), pvd)?;
    Ok(())
}

/// A VTU file with appended binary data: tetrahedra at rest, with the fields `displacement`, `truth`, `error` (mm).
fn vtu(mesh: &Mesh, predicted: &[[f32; 3]], truth: &[[f32; 3]]) -> Vec<u8> {
    let mut data: Vec<u8> = Vec::new();
    let mut arrays = Vec::new();
    let mut append = |kind: &str, name: &str, components: usize, bytes: Vec<u8>| {
        arrays.push(format!("<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"appended\" offset=\"{}\"/>", data.len()));
        data.extend((bytes.len() as u64).to_le_bytes());
        data.extend(bytes);
    };
    let floats = |field: &[[f32; 3]]| {
        field
            .as_flattened()
            .iter()
            .flat_map(|value| value.to_le_bytes())
            .collect::<Vec<u8>>()
    };
    let error: Vec<[f32; 3]> = predicted
        .iter()
        .zip(truth)
        .map(|(a, b)| [0, 1, 2].map(|k| a[k] - b[k]))
        .collect();
    append("Float32", "points", 3, floats(&mesh.positions));
    append(
        "Int32",
        "connectivity",
        1,
        mesh.tets
            .as_flattened()
            .iter()
            .flat_map(|node| node.to_le_bytes())
            .collect(),
    );
    append(
        "Int32",
        "offsets",
        1,
        (1..=mesh.tets.len() as u32)
            .flat_map(|end| (4 * end).to_le_bytes())
            .collect(),
    );
    append("UInt8", "types", 1, vec![10; mesh.tets.len()]);
    append("Float32", "displacement", 3, floats(predicted));
    append("Float32", "truth", 3, floats(truth));
    append("Float32", "error", 3, floats(&error));
    let mut file = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\"><UnstructuredGrid><Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\"><Points>{}</Points><Cells>{}{}{}</Cells><PointData Vectors=\"displacement\">{}{}{}</PointData></Piece></UnstructuredGrid><AppendedData encoding=\"raw\">_",
        mesh.node_count(),
        mesh.tets.len(),
        arrays[0],
        arrays[1],
        arrays[2],
        arrays[3],
        arrays[4],
        arrays[5],
        arrays[6]
    )
    .into_bytes();
    file.extend(data);
    file.extend(b"</AppendedData></VTKFile>\n");
    file
}
