//! Programmes of rigid tools, driven by their poses alone, through a bundle and the reference solver: the part `tools` of a certificate.

use std::path::Path;

use anyhow::{Context, Result};
use serde_json::{Value, json};
use tissue::programmes::ToolScale;
use tissue::simulate::{ToolOrder, simulate_tools};
use tissue::solver::SolverOptions;

use super::certificate::short;
use super::{Bundle, Plan};
use crate::parallel::{in_parallel, workers};
use crate::progress;
use crate::report::method::BundleFolder;
use crate::tools::cases::{ToolCase, ToolCases};
use crate::tools::solved;

/// Cases of a programme.
const CASES: usize = 2;

/// Simulates and replays the plan's programmes, at a scale.
pub fn measure(plan: &Plan, bundle: &Bundle, scale: ToolScale) -> Result<Value> {
    let count = CASES * plan.tools.len();
    let settings = SolverOptions {
        material: bundle.model.manifest.material,
        ..SolverOptions::default()
    };
    let bar = progress::bar(plan.quiet, count as u64, "tools");
    let list = in_parallel(workers(plan.threads).min(count), &|at| at < count, &|at| {
        let programme = plan.tools[at / CASES];
        let seed = plan.seed.wrapping_mul(1000).wrapping_add(at as u64);
        let order = ToolOrder {
            scale,
            ..ToolOrder::new(programme, seed)
        };
        let simulated = simulate_tools(&bundle.mesh, bundle.boundary, order, &settings, |_, _| ());
        bar.inc(1);
        let trajectory = simulated.with_context(|| format!("--tools {}", programme.name()))?;
        let name = format!("{}, seed {seed}", programme.name());
        ToolCase::of(trajectory, &name, Path::new(&name))
    })?;
    bar.finish_and_clear();
    let folder = BundleFolder::read(&plan.bundle)?;
    let corrections = folder.corrections.unwrap_or_default();
    let cases = ToolCases::of(list)?;
    let figures = solved(&folder, corrections, &cases, &bundle.mesh, 1)?;
    let rows = plan.tools.iter().zip(figures.chunks(CASES));
    let rows = rows.map(|(programme, own)| {
        let most = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
        let mut forces: Vec<f64> = own
            .iter()
            .flat_map(|case| case.force_error.clone())
            .collect();
        forces.sort_by(f64::total_cmp);
        let mean = own.iter().map(|case| case.mse_mm2).sum::<f64>() / own.len() as f64;
        json!({
            "programme": programme.name(),
            "cases": own.len(),
            "steps": own.iter().map(|case| case.steps).sum::<usize>(),
            "mse_mm2": short(mean),
            "worst_mse_mm2": short(most(&mut own.iter().map(|case| case.mse_mm2))),
            "max_mm": short(most(&mut own.iter().map(|case| case.max_error_mm))),
            "force_error": forces.get(forces.len() / 2).map(|error| short(*error)),
            "inverted_steps": own.iter().map(|case| case.inverted_steps).sum::<usize>(),
            "deepest_in_a_tool_mm": short(most(&mut own.iter().map(|case| case.penetration_mm))),
        })
    });
    Ok(rows.collect())
}
