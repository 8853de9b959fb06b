//! Programmes of rigid tools, driven by their poses alone, through a bundle and the reference solver: the part `tools` of a certificate.

use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use gauge::median;
use serde_json::{Value, json};
use tissue::programmes::ToolScale;
use tissue::simulate::{ToolOrder, simulate_tools};
use tissue::solver::SolverOptions;

use super::certificate::short;
use super::{Bundle, Plan};
use crate::parallel::{in_parallel, workers};
use yardstick::bundle_folder::BundleFolder;
use yardstick::cases::{ToolCase, ToolCases};
use yardstick::{CaseFigures, solved};

/// Cases of a programme.
const CASES: usize = 2;

/// Part of the time that simulates; the rest is for the replays.
const SIMULATED: f64 = 0.7;

/// Simulates and replays the plan's programmes, at a scale, within so many seconds. Of a programme for which there is no time there is no row.
pub fn measure(plan: &Plan, bundle: &Bundle, scale: ToolScale, seconds: f64) -> Result<Value> {
    let started = Instant::now();
    let until = seconds
        .is_finite()
        .then(|| started + Duration::from_secs_f64(SIMULATED * seconds.max(0.0)));
    let count = CASES * plan.tools.len();
    // The first case of each programme, then the second: a place in the table of programmes and cases.
    let place = |turn: usize| (turn % plan.tools.len()) * CASES + turn / plan.tools.len();
    let settings = SolverOptions {
        material: bundle.model.manifest.material,
        ..SolverOptions::default()
    };
    let bar = plan.watch.bar(count as u64, "tools");
    let workers = workers(plan.threads).min(count);
    let in_time = |turn: usize| turn < workers || until.is_none_or(|until| Instant::now() < until);
    let go_on = |turn: usize| turn < count && in_time(turn);
    let mut list = in_parallel(workers, &go_on, &|turn| {
        let at = place(turn);
        let programme = plan.tools[at / CASES];
        let seed = plan.seed.wrapping_mul(1000).wrapping_add(at as u64);
        let order = ToolOrder {
            scale,
            until,
            ..ToolOrder::new(programme, seed)
        };
        let simulated = simulate_tools(&bundle.mesh, bundle.boundary, order, &settings, |_, _| ());
        bar.inc(1);
        let trajectory = simulated.with_context(|| format!("--tools {}", programme.name()))?;
        let name = format!("{}, seed {seed}", programme.name());
        Ok((at, ToolCase::of(trajectory, &name, Path::new(&name))?))
    })?;
    list.sort_by_key(|(at, _)| *at);
    drop(bar);
    let folder = BundleFolder::read(&plan.bundle)?;
    let corrections = folder.corrections.unwrap_or_default();
    let places: Vec<usize> = list.iter().map(|(at, _)| *at).collect();
    let cases = ToolCases::of(list.into_iter().map(|(_, case)| case).collect())?;
    let figures = solved(&folder, corrections, &cases, &bundle.mesh, 1, &plan.watch)?;
    let rows = plan.tools.iter().enumerate().filter_map(|(index, programme)| {
        let own = figures.iter().zip(&places);
        let own: Vec<&CaseFigures> = own
            .filter(|(_, place)| *place / CASES == index)
            .map(|(figures, _)| figures)
            .collect();
        if own.is_empty() {
            return None;
        }
        let most = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
        let forces = own.iter().flat_map(|case| case.force_error.clone());
        let force = median(forces);
        let mean = own.iter().map(|case| case.mse_mm2).sum::<f64>() / own.len() as f64;
        Some(json!({
            "programme": programme.name(),
            "cases": own.len(),
            "steps": own.iter().map(|case| case.steps).sum::<usize>(),
            "mse_mm2": short(mean),
            "worst_mse_mm2": short(most(&mut own.iter().map(|case| case.mse_mm2))),
            "max_mm": short(most(&mut own.iter().map(|case| case.max_error_mm))),
            "force_error": (!force.is_nan()).then(|| short(force)),
            "inverted_steps": own.iter().map(|case| case.inverted_steps).sum::<usize>(),
            "deepest_in_a_tool_mm": short(most(&mut own.iter().map(|case| case.penetration_mm))),
        }))
    });
    Ok(rows.collect())
}
