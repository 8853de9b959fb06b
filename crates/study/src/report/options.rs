//! What `upt-study report` is asked for.

use std::path::PathBuf;

use clap::Args;
use tissue::hang::HangSizes;
use tissue::load_programmes::LoadProgramme;
use tissue::programmes::ToolProgramme;

use crate::publish::Publisher;
use host::Effort;
use upt_cli::one_of::one_of;
use upt_cli::simulate::LoadArguments;
use yardstick::cases::Split;
use yardstick::setting::{Precision, Provider, Region};

#[derive(Args)]
#[command(after_help = "Examples:
  upt-study report --data data/brain-fixed --cases 2 --out target/report
  upt-study report --trajectory push.trajectory.safetensors --bundle onnx/brain-reduced --plain zero,linear
  upt-study report --data data/brain-fixed --threads 1,2 --region all,surface --precision f32,bf16 --json
  upt-study report --tools data/brain-tools --bundle onnx/brain-reduced --corrections 0,3,5 --out target/tools
  upt-study report --shown 90 --tools data/brain-frames --split all --bundle onnx/brain-reduced --out target/shown
  upt-study report --load tilt,pulse,sag --bundle onnx/brain-coarse-reduced
  upt-study report --load pulse --tool press --bundle onnx/brain-coarse-reduced
  upt-study report --hang 10 --bundle onnx/brain-coarse-reduced
  upt-study report --cut 3 --bundle onnx/liver-coarse
  upt-study report --step-ms 10,20,25,50 --tools data/brain-frames --split all --bundle onnx/brain-reduced

The command writes report.json, report.html and report.md (the table for a document of yours) to --out (with --tools: tools.json and tools.html), and prints the table.")]
pub struct Options {
    /// Bundles. Default: all below onnx/ that fit the cases' mesh and boundary condition.
    #[arg(long = "bundle", value_name = "FOLDER")]
    pub bundles: Vec<PathBuf>,
    /// A trajectory to replay (repeat for several).
    #[arg(long = "trajectory", value_name = "FILE")]
    pub trajectories: Vec<PathBuf>,
    /// A dataset folder whose test split is replayed (repeat for several).
    #[arg(long = "data", value_name = "FOLDER")]
    pub data: Vec<PathBuf>,
    /// A dataset folder or a trajectory with rigid tools (`upt dataset --tools`, repeat for several): the tools' poses alone drive the library. Of the options below, only --split, --cases, --corrections, --threads (the largest), --out,
    /// --title, --markdown and --json apply.
    #[arg(long = "tools", value_name = "PATH", conflicts_with_all = ["trajectories", "data"])]
    pub tools: Vec<PathBuf>,
    /// Cases of the datasets of --tools: held-out ones, those that bundles may learn from, or both.
    #[arg(long, default_value = "test", requires = "tools", value_parser = one_of(&Split::ALL, Split::name))]
    pub split: Split,
    /// Measure what a host shows between steps, at this many frames a second; --tools names datasets with frames shorter than a step
    /// (`upt dataset --tools all --frame-ms 5`). Writes shown.json and pictures; --markdown replaces the part between the markers
    /// `study report --shown BUNDLE`.
    #[arg(long, value_name = "HZ", requires = "tools")]
    pub shown: Option<f64>,
    /// With --shown: time from a step's moment to the arrival of its state, ms.
    #[arg(long, default_value_t = 10.0, requires = "shown")]
    pub arrival_ms: f64,
    /// Lengths of a step, ms, 10 to 50. With --shown: also measure frames between such steps. Without: measure the error of the steps by their
    /// length, against frames shorter than a step; --markdown replaces the part between the markers
    /// `study report --step-ms BUNDLE`.
    #[arg(long, value_name = "MS", value_delimiter = ',', requires = "tools")]
    pub step_ms: Vec<f64>,
    /// Page whose part between the markers `study report --tools MESH` (with `--boundary NAME` behind where it is not `fixed`) is replaced by the tables of --tools, or by a narrow table if the markers end in `summary` (repeat for several).
    #[arg(long, value_name = "FILE")]
    pub markdown: Vec<PathBuf>,
    /// Measure programmes of loads (tilt, pulse, sag, breathe) in the bundles of --bundle against the reference solver, which runs here. --markdown replaces the
    /// part between the markers `study report --load`, with `--tool NAME` behind where a tool touches and `--gravity X,Y,Z --pressure PA` behind that where they
    /// are not the defaults.
    #[arg(long, value_delimiter = ',', conflicts_with_all = ["trajectories", "data", "tools"])]
    pub load: Vec<LoadProgramme>,
    /// Measure so many cases of a bed of ties that a thread tears node by node, in the bundles of --bundle against the reference solver, which runs here. --markdown
    /// replaces the part between the markers `study report --hang`.
    #[arg(long, value_name = "CASES", default_value_t = 0, hide_default_value = true, conflicts_with_all = ["trajectories", "data", "tools", "load"])]
    pub hang: usize,
    /// Measure so many cases of each programme of cuts (incise, again, flap, resect, biopsy, divide, wall, part, coagulate), in the bundles of --bundle against the reference solver,
    /// which runs here. --markdown replaces the part between the markers `study report --cut`.
    #[arg(long, value_name = "CASES", default_value_t = 0, hide_default_value = true, conflicts_with_all = ["trajectories", "data", "tools", "load", "hang"])]
    pub cut: usize,
    /// With --cut: only these programmes. A table of some does not go into pages.
    #[arg(
        long,
        value_name = "NAME",
        value_delimiter = ',',
        requires = "cut",
        conflicts_with = "markdown"
    )]
    pub programme: Vec<String>,
    /// Measure how a part of what holds the organ is led, let go under the gravity of --gravity and held again (*mobilise*), in the bundles of --bundle against the reference
    /// solver, which runs here; without a tool and with a ball. --markdown replaces the part between the markers `study report --mobilise`.
    #[arg(long, conflicts_with_all = ["trajectories", "data", "tools", "load", "hang", "cut"])]
    pub mobilise: bool,
    /// With --hang: stiffness of the bed's ties together, N/m.
    #[arg(long, default_value_t = HangSizes::default().stiffness)]
    pub bed_stiffness: f32,
    /// With --hang: what the bed's ties bear together, mN.
    #[arg(long, default_value_t = HangSizes::default().break_mn)]
    pub bed_break: f32,
    /// With --load: a tool that touches the body meanwhile.
    #[arg(long, value_parser = upt_cli::loads::programme(), requires = "load")]
    pub tool: Option<ToolProgramme>,
    /// With --tool: seed of its first case.
    #[arg(long, default_value_t = 1, requires = "load")]
    pub seed: u64,
    /// With --tool: so many cases, each at another site; a row of the table is their median.
    #[arg(long, default_value_t = 1, requires = "tool", value_parser = clap::value_parser!(u64).range(1..))]
    pub seeds: u64,
    #[command(flatten)]
    pub load_sizes: LoadArguments,
    /// The most cases of each scheme or programme.
    #[arg(long, default_value_t = 2)]
    pub cases: usize,
    /// Folder for report.json, report.html, report.md and the finished rows.
    #[arg(long, default_value = "target/report")]
    pub out: PathBuf,
    /// Threads of the library. Default: 1, and all of this machine's.
    #[arg(long, value_delimiter = ',', default_values_t = default_threads(), hide_default_value = true)]
    pub threads: Vec<u32>,
    /// Nodes that a step computes: all, those of the surface, or those of the domain.
    #[arg(long, value_delimiter = ',', default_value = "all,surface", value_parser = one_of(&Region::ALL, Region::name))]
    pub region: Vec<Region>,
    /// Default: float32, and whatever else the bundle and this CPU support.
    #[arg(long, value_delimiter = ',', value_parser = one_of(&Precision::ALL, Precision::name))]
    pub precision: Vec<Precision>,
    #[arg(long, value_delimiter = ',', default_value = "cpu", value_parser = one_of(&Provider::ALL, Provider::name))]
    pub provider: Vec<Provider>,
    /// Corrections per step in contact: counts, or COUNT@MM for at most COUNT and fewer once the estimated error is below MM. Default: none and
    /// as many as the bundle recommends; with all nodes and the most threads also 0, 1, 3, 5 and 10.
    #[arg(long, value_delimiter = ',')]
    pub corrections: Vec<Effort>,
    /// Plain methods to compare with: zero, linear, prior (the bundles' linear response alone), coarse, tled, paper; or none.
    #[arg(
        long,
        value_delimiter = ',',
        default_value = DEFAULT_PLAIN
    )]
    pub plain: Vec<String>,
    /// The mesh of `coarse`.
    #[arg(long, default_value = "onnx/meshes/brain-coarse.mesh.safetensors")]
    pub coarse_mesh: PathBuf,
    /// Frames of the first case on which TLED itself is timed.
    #[arg(long, default_value_t = 40)]
    pub tled_frames: usize,
    /// Leave out the Hausdorff distance (the slowest of the metrics).
    #[arg(long)]
    pub no_hausdorff: bool,
    /// Measure again what is already stored.
    #[arg(long)]
    pub fresh: bool,
    /// The page's title.
    #[arg(long)]
    pub title: Option<String>,
    /// Print report.json instead of the table.
    #[arg(long)]
    pub json: bool,
}

impl Options {
    /// Where one number of threads is measured.
    pub fn most_threads(&self) -> u32 {
        self.threads.iter().copied().max().unwrap_or(1)
    }

    /// Where the report goes.
    pub fn publisher(&self) -> Publisher<'_> {
        Publisher {
            json: self.json,
            pages: &self.markdown,
        }
    }

    pub fn bed_sizes(&self) -> HangSizes {
        HangSizes {
            stiffness: self.bed_stiffness,
            break_mn: self.bed_break,
            ..HangSizes::default()
        }
    }
}

/// All that this build has.
const DEFAULT_PLAIN: &str = if cfg!(feature = "linear") {
    "zero,linear,prior,coarse,tled,paper"
} else {
    "zero,prior,coarse,tled,paper"
};

/// One thread, and all of them.
fn default_threads() -> Vec<u32> {
    let all = std::thread::available_parallelism().map_or(1, usize::from) as u32;
    if all > 1 { vec![1, all] } else { vec![1] }
}
