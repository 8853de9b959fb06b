//! Times of bundles on one execution provider, for `xtask/gpu/run.sh`; and the report of all of them.
//!
//! `gpu-measure rows --provider P --out FILE [--steps N] [--scenes 1,2,4,8] BUNDLE...` writes rows: p50, p95 and p99 of a
//! step, the copies to the card and back, the deviation of a rollout from the CPU's float32 path, FLOP and bytes. A
//! variant that the provider refuses is a line under `not_measured`, with its reason.
//! `gpu-measure report FOLDER` joins FOLDER's `rows-*.json` into `report.json`.

#[path = "../../../benches/step/cost.rs"]
mod cost;
mod report;
mod rows;
#[path = "../../../benches/step/split.rs"]
mod split;

use std::path::PathBuf;

use serde_json::json;
use upt::Provider;

/// What to measure.
pub struct Wanted {
    pub provider: Provider,
    pub steps: usize,
    pub scenes: Vec<usize>,
    pub bundles: Vec<PathBuf>,
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let done = match arguments.split_first() {
        Some((what, rest)) if what == "rows" => rows(rest),
        Some((what, [folder])) if what == "report" => report::write(folder.as_ref()),
        _ => Err(
            "usage: gpu-measure rows --provider P --out FILE BUNDLE... | gpu-measure report FOLDER"
                .into(),
        ),
    };
    if let Err(error) = done {
        eprintln!("gpu-measure: {error}");
        std::process::exit(2);
    }
}

fn rows(arguments: &[String]) -> Result<(), String> {
    let mut wanted = Wanted {
        provider: Provider::Cpu,
        steps: 1000,
        scenes: vec![1, 2, 4, 8],
        bundles: Vec::new(),
    };
    let mut out = None;
    let mut rest = arguments.iter();
    while let Some(argument) = rest.next() {
        let mut value = || rest.next().ok_or(format!("{argument} needs a value"));
        match argument.as_str() {
            "--provider" => wanted.provider = provider(value()?)?,
            "--steps" => wanted.steps = number(value()?)?,
            "--scenes" => {
                wanted.scenes = value()?.split(',').map(number).collect::<Result<_, _>>()?
            }
            "--out" => out = Some(PathBuf::from(value()?)),
            name if name.starts_with("--") => return Err(format!("{name} is not an option")),
            bundle => wanted.bundles.push(bundle.into()),
        }
    }
    let out = out.ok_or("--out is missing")?;
    let (mut measured, mut missing) = (Vec::new(), Vec::new());
    for bundle in &wanted.bundles {
        if let Err(error) = rows::measure(&wanted, bundle, &mut measured, &mut missing) {
            missing.push(json!({"what": format!("{} on {}", bundle.display(), wanted.provider.name()), "why": error.to_string()}));
        }
    }
    let text = json!({"rows": measured, "not_measured": missing}).to_string();
    std::fs::write(&out, text + "\n").map_err(|error| format!("{}: {error}", out.display()))
}

fn provider(name: &String) -> Result<Provider, String> {
    [
        Provider::Cpu,
        Provider::Cuda,
        Provider::TensorRt,
        Provider::TensorRtRtx,
    ]
    .into_iter()
    .find(|provider| provider.name() == name)
    .ok_or(format!(
        "--provider {name}: must be cpu, cuda, tensorrt or tensorrt-rtx"
    ))
}

fn number(text: impl AsRef<str>) -> Result<usize, String> {
    let text = text.as_ref();
    text.parse()
        .ok()
        .filter(|&n| n > 0)
        .ok_or(format!("{text} is not a number above 0"))
}
