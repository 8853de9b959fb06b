//! `upt simulate`: one case of a scheme, of tools or of loads on a mesh, as a trajectory file.

use crate::{loads, materials, tool_size};
use anyhow::Context;
use std::path::PathBuf;
use std::process::ExitCode;
use tissue::load_programmes::{LoadProgramme, LoadSizes};
use tissue::mesh::{Boundary, Mesh};
use tissue::programmes::ToolProgramme;
use tissue::schemes::{FRAMES, Scheme};
use tissue::simulate::{ToolOrder, simulate_loads, simulate_tools};
use tissue::solver::{Pressure, SolverOptions};
use yardstick::tool_scale::Chosen;

#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  upt simulate --mesh onnx/meshes/brain-coarse.mesh.safetensors --scheme 5 --seed 7 --threads 2 --out push.trajectory.safetensors\n  upt simulate --mesh onnx/meshes/brain-coarse.mesh.safetensors --tool stroke --seed 3 --out stroke.trajectory.safetensors\n  upt simulate --mesh onnx/meshes/brain-coarse.mesh.safetensors --load tilt --out tilt.trajectory.safetensors"
)]
pub struct Options {
    /// Mesh file (*.mesh.safetensors).
    #[arg(long)]
    mesh: PathBuf,
    /// Scheme of prescribed contact.
    #[arg(long, value_parser = loads::scheme(), required_unless_present_any = ["tool", "load"])]
    scheme: Option<Scheme>,
    /// Programme of rigid tools.
    #[arg(long, value_parser = loads::programme(), conflicts_with = "scheme")]
    tool: Option<ToolProgramme>,
    /// Programme of loads, nothing in contact: tilt (gravity turns by 90 degrees in 2 s), pulse (pressure on the domain, 1.2 a second), sag (a
    /// pressure on the domain is lost) or breathe (the support goes up by 15 mm, turns by 15 degrees, and comes back).
    #[arg(long, conflicts_with_all = ["scheme", "tool"])]
    load: Option<LoadProgramme>,
    #[command(flatten)]
    load_sizes: LoadArguments,
    /// STL, OBJ or PLY file whose convex hull replaces the programme's tool (mm; y up the shaft, the lowest end touches).
    #[cfg(feature = "linear")]
    #[arg(long, requires = "tool")]
    tool_shape: Option<PathBuf>,
    #[command(flatten)]
    sizes: tool_size::Arguments,
    /// Seed of the contact site.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Held nodes: `fixed`, or `supported` (also the surface outside the craniotomy window).
    #[arg(long, default_value = "fixed")]
    boundary: Boundary,
    /// Trajectory to write (*.trajectory.safetensors).
    #[arg(long)]
    out: PathBuf,
    /// Threads inside the simulation; the result has the same bits for any number.
    #[arg(long, default_value_t = 1)]
    threads: usize,
    /// Store displacements as f16.
    #[arg(long)]
    half: bool,
    #[command(flatten)]
    solver: SolverArguments,
}

impl Options {
    /// A tool of the user's own.
    #[cfg(feature = "linear")]
    fn own_shape(&self) -> anyhow::Result<Option<contact::Shape>> {
        let file = self.tool_shape.as_deref();
        Ok(file
            .map(|path| tissue::mesh_import::tool_shape(path, 1.0))
            .transpose()?)
    }

    /// Reading one takes the feature `linear`.
    #[cfg(not(feature = "linear"))]
    fn own_shape(&self) -> anyhow::Result<Option<contact::Shape>> {
        Ok(None)
    }
}

/// How strong loads are.
#[derive(clap::Args, Clone, Copy)]
pub struct LoadArguments {
    /// Gravity under which the mesh is in equilibrium, m/s²: what a tilt turns. A thirtieth of 9.81 is what the weight of a brain in its fluid comes to.
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true, default_value = "0,-0.3,0")]
    gravity: [f64; 3],
    /// Largest pressure of pulse and sag, Pa.
    #[arg(long, value_name = "PA", default_value_t = LoadSizes::default().pascal)]
    pressure: f64,
}

impl LoadArguments {
    pub fn sizes(self) -> LoadSizes {
        LoadSizes {
            gravity_m_s2: self.gravity,
            pascal: self.pressure,
        }
    }
}

fn vector(text: &str) -> Result<[f64; 3], String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    let numbers = numbers
        .ok()
        .and_then(|list| <[f64; 3]>::try_from(list).ok());
    numbers
        .filter(|list| list.iter().all(|v| v.is_finite()))
        .ok_or_else(|| format!("`{text}` is not three numbers X,Y,Z"))
}

/// Settings of the solver that `simulate` and `dataset` share.
#[derive(clap::Args)]
pub struct SolverArguments {
    /// Young's modulus, Pa. Default: 3000, or that of the law where it has one of its own.
    #[arg(long)]
    young: Option<f64>,
    /// Law of the tissue: neo-hookean, mooney-rivlin:SHARE with the share of C01 in C10 + C01 (default: 0.526, brain), yeoh:C2/C1[,C3/C1] as
    /// numbers, veronda-westmann:BETA, ogden:MU,ALPHA[,MU,ALPHA...] with MU in Pa or with kPa behind it, or a tissue that `upt materials` lists. Behind any of
    /// them +fibres:K1/MU,K2 adds fibres, whose directions are in the mesh file; fibres:K1/MU,K2 alone has them in neo-hookean.
    #[arg(long, default_value = "neo-hookean", value_parser = materials::law)]
    law: elements::Law,
    /// Relaxation of the stress without change of volume: SHARE,TAU_S[,SHARE,TAU_S...], each share lost with its time constant, s, or a tissue that
    /// `upt materials` lists with one. Default: none.
    #[arg(long, default_value = "", hide_default_value = true, value_parser = materials::relaxation)]
    relaxation: elements::Relaxation,
    /// Poisson's ratio.
    #[arg(long, default_value_t = 0.49)]
    poisson: f64,
    /// Density, kg/m³.
    #[arg(long, default_value_t = 1000.0)]
    density: f64,
    /// Mass-proportional damping, 1/s.
    #[arg(long, default_value_t = 20.0)]
    damping: f64,
    /// Inner step, ms; shortened automatically if the mesh needs a shorter one.
    #[arg(long, default_value_t = 0.1)]
    inner_step_ms: f64,
    /// Selective mass scaling, ms: elements whose own critical step is shorter than this get mass until it is this long; 0: none.
    #[arg(long, default_value_t = 0.0)]
    mass_scaling_ms: f64,
    /// Average nodal pressure instead of one pressure per element (less locking, slower).
    #[arg(long)]
    average_pressure: bool,
}

impl SolverArguments {
    pub fn options(&self, threads: usize) -> SolverOptions {
        let mut options = SolverOptions {
            inner_step_s: self.inner_step_ms * 1e-3,
            mass_scaling_s: self.mass_scaling_ms * 1e-3,
            threads,
            ..SolverOptions::default()
        };
        options.material.poisson = self.poisson;
        options.material = options.material.with_law(self.law);
        options.material.young_pa = self.young.unwrap_or(options.material.young_pa);
        options.material.relaxation = self.relaxation;
        options.material.density_kg_m3 = self.density;
        options.material.damping_per_s = self.damping;
        if self.average_pressure {
            options.pressure = Pressure::AverageNodal;
        }
        options
    }
}

pub fn run(options: &Options) -> anyhow::Result<ExitCode> {
    let mesh = Mesh::read(&options.mesh)?;
    let bar = indicatif::ProgressBar::new(FRAMES as u64 - 1).with_style(
        indicatif::ProgressStyle::with_template("{bar:40} frame {pos}/{len}, {eta} left")?,
    );
    let start = std::time::Instant::now();
    let settings = options.solver.options(options.threads);
    let (boundary, seed) = (options.boundary, options.seed);
    let advance = |frame, count| {
        bar.set_length(count as u64);
        bar.set_position(frame as u64);
    };
    let (load, outcome) = match (options.load, options.tool, options.scheme) {
        (Some(load), _, _) => {
            let order = (load, options.load_sizes.sizes());
            let case = simulate_loads(&mesh, boundary, order, &settings, advance);
            (format!("load {}", load.name()), case)
        }
        (None, Some(tool), _) => {
            let own = options.own_shape()?;
            let sizes = Chosen::of(options.sizes.tool_scale, &mesh, None);
            bar.suspend(|| eprintln!("{}", sizes.words()));
            let order = ToolOrder {
                own: own.as_ref(),
                scale: sizes.scale,
                ..ToolOrder::new(tool, seed)
            };
            let case = simulate_tools(&mesh, boundary, order, &settings, advance);
            (format!("tool {}", tool.name()), case)
        }
        (None, None, Some(scheme)) => {
            let advance = |frame| bar.set_position(frame as u64);
            let case =
                tissue::simulate::simulate(&mesh, boundary, scheme, seed, &settings, advance);
            (format!("scheme {}", scheme.name()), case)
        }
        (None, None, None) => anyhow::bail!("give --scheme, --tool or --load"),
    };
    let trajectory = outcome.with_context(|| format!("{load}, seed {seed}"))?;
    bar.finish_and_clear();
    let seconds = start.elapsed().as_secs_f64();
    trajectory.write(&options.out, options.half)?;
    let largest = trajectory
        .displacement
        .iter()
        .map(|u| u.iter().map(|v| v * v).sum::<f32>())
        .fold(0.0, f32::max)
        .sqrt();
    let smallest = trajectory.min_det_f.iter().copied().fold(1.0, f32::min);
    println!(
        "{}: {} nodes, {load}, seed {}, site [{:.1}, {:.1}, {:.1}] mm, largest displacement {largest:.2} mm, min det F {smallest:.3}, {seconds:.1} s ({:.1} ms a frame)",
        options.out.display(),
        mesh.node_count(),
        options.seed,
        trajectory.header.site[0],
        trajectory.header.site[1],
        trajectory.header.site[2],
        seconds * 1e3 / (trajectory.frame_count() - 1) as f64,
    );
    if let Some(tracks) = &trajectory.tools {
        let force = |w: &[f32; 6]| (w[0] * w[0] + w[1] * w[1] + w[2] * w[2]).sqrt();
        println!(
            "tools: {}, {} frames, largest force {:.1} mN, worst penetration {:.4} mm",
            tracks.tools.len(),
            trajectory.frame_count(),
            tracks.wrenches.iter().map(force).fold(0.0, f32::max),
            tracks.penetration.iter().copied().fold(0.0, f32::max),
        );
    }
    Ok(ExitCode::SUCCESS)
}
