//! `upt export`: a trajectory for ParaView (PVD and a VTU a frame), or one frame's surface as PLY
//! or glTF.

use anyhow::{Context, bail};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use std::path::PathBuf;
use std::process::ExitCode;
use tissue::export::{Cells, Collection, SurfaceFormat, write_frame, write_surface};
use tissue::mesh::Mesh;
use tissue::trajectory::Trajectory;

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  upt export case.trajectory.safetensors --mesh brain.mesh.safetensors --out paraview\n  upt export case.trajectory.safetensors --mesh brain.mesh.safetensors --surface brain.gltf --frame 80"
)]
pub struct Options {
    /// Trajectory file (*.trajectory.safetensors).
    trajectory: PathBuf,
    /// Mesh of the trajectory (*.mesh.safetensors).
    #[arg(long)]
    mesh: PathBuf,
    /// Folder for `trajectory.pvd` and its frames.
    #[arg(long, required_unless_present = "surface")]
    out: Option<PathBuf>,
    /// Write every n-th frame.
    #[arg(long, default_value_t = 1)]
    every: usize,
    /// Write only the triangles of the surface, for smaller files.
    #[arg(long)]
    skin: bool,
    /// Keep the rest positions as points (warp by `displacement` in ParaView).
    #[arg(long)]
    rest: bool,
    /// Surface file of one frame: .ply (mm, RAS) or .gltf (m, y up).
    #[arg(long, requires = "frame")]
    surface: Option<PathBuf>,
    /// Frame of --surface; 0 is rest.
    #[arg(long)]
    frame: Option<usize>,
}

/// Runs the command.
pub fn run(options: &Options) -> anyhow::Result<ExitCode> {
    let mesh = Mesh::read(&options.mesh)?;
    let trajectory = Trajectory::read(&options.trajectory)?;
    if trajectory.header.mesh_sha256 != mesh.hash() {
        bail!(
            "{} was made on the mesh `{}` ({}), not on {} ({}); give that mesh with --mesh",
            options.trajectory.display(),
            trajectory.header.mesh_name,
            trajectory.header.mesh_sha256,
            options.mesh.display(),
            mesh.hash()
        );
    }
    if let (Some(path), Some(frame)) = (&options.surface, options.frame) {
        let Some(format) = SurfaceFormat::of(path) else {
            bail!("{}: the extension must be .ply or .gltf", path.display());
        };
        if frame >= trajectory.frame_count() {
            bail!(
                "--frame {frame} does not exist; the trajectory has frames 0 to {}",
                trajectory.frame_count() - 1
            );
        }
        write_surface(path, format, &mesh, trajectory.frame(frame))
            .with_context(|| path.display().to_string())?;
        println!("{}: surface at frame {frame}", path.display());
    }
    if options.out.is_some() {
        export_frames(options, &mesh, &trajectory)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Nodes that are written, and the cells over them.
enum Body {
    Whole,
    Skin {
        nodes: Vec<u32>,
        faces: Vec<[u32; 3]>,
    },
}

impl Body {
    fn new(mesh: &Mesh, skin: bool) -> Self {
        if !skin {
            return Self::Whole;
        }
        let mut nodes: Vec<u32> = mesh.surface.iter().flatten().copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        let row = |node: u32| nodes.partition_point(|&other| other < node) as u32;
        let faces = mesh.surface.iter().map(|face| face.map(row)).collect();
        Self::Skin { nodes, faces }
    }

    fn rows<T: Copy>(&self, all: &[T]) -> Vec<T> {
        match self {
            Self::Whole => all.to_vec(),
            Self::Skin { nodes, .. } => nodes.iter().map(|&node| all[node as usize]).collect(),
        }
    }
}

fn export_frames(options: &Options, mesh: &Mesh, trajectory: &Trajectory) -> anyhow::Result<()> {
    let Some(folder) = &options.out else {
        return Ok(());
    };
    if options.every == 0 {
        bail!("--every must be 1 or more");
    }
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let body = Body::new(mesh, options.skin);
    let frames: Vec<usize> = (0..trajectory.frame_count())
        .step_by(options.every)
        .collect();
    let bar = ProgressBar::new(frames.len() as u64).with_style(ProgressStyle::with_template(
        "{bar:40} {pos}/{len} frames, {eta} left",
    )?);
    let mut collection = Collection::default();
    for &frame in &frames {
        let displacement = trajectory.frame(frame);
        let mut points = mesh.positions.clone();
        if !options.rest {
            for (point, u) in points.iter_mut().zip(displacement) {
                for k in 0..3 {
                    point[k] += u[k];
                }
            }
        }
        let mut contact = vec![0u8; mesh.node_count()];
        for &node in trajectory.contact(frame).0 {
            contact[node as usize] = 1;
        }
        let name = format!("frame-{frame:05}.vtu");
        let path = folder.join(&name);
        let cells = match &body {
            Body::Whole => Cells::Tets(&mesh.tets),
            Body::Skin { faces, .. } => Cells::Triangles(faces),
        };
        write_frame(
            &path,
            &body.rows(&points),
            cells,
            &body.rows(displacement),
            &body.rows(&contact),
        )
        .with_context(|| path.display().to_string())?;
        collection.push(frame as f64 * trajectory.header.dt_s, name);
        bar.inc(1);
    }
    bar.finish_and_clear();
    let path = folder.join("trajectory.pvd");
    collection
        .write(&path)
        .with_context(|| path.display().to_string())?;
    println!("{}: {} frames", path.display(), frames.len());
    Ok(())
}
