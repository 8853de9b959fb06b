//! The time of a present call, in contact.

use anyhow::Result;
use serde::Serialize;
use tissue::mesh::Mesh;
use tissue::schemes::FRAME_S;

use super::host::Clock;
use super::truth::Truth;
use gauge::Sorted;
use yardstick::cases::ToolCases;
use yardstick::drive::Driver;

/// Nodes of the small region.
const FEW: usize = 1000;
/// Cases that calls are timed in.
const CASES: usize = 4;

/// Times over the frames in contact, ms.
#[derive(Clone, Debug, Serialize)]
pub struct Time {
    pub region: &'static str,
    pub nodes: usize,
    pub calls: usize,
    pub median_ms: f64,
    pub p99_ms: f64,
}

/// All nodes, those of the surface, and a thousand of them.
pub fn measure(
    driver: &mut Driver,
    mesh: &Mesh,
    cases: &ToolCases,
    truths: &[Truth],
    clock: &Clock,
) -> Result<Vec<Time>> {
    let mut surface: Vec<u32> = mesh.surface.as_flattened().to_vec();
    surface.sort_unstable();
    surface.dedup();
    let some = surface.len().div_ceil(FEW);
    let few: Vec<u32> = surface.iter().copied().step_by(some.max(1)).collect();
    let mut times = Vec::new();
    for (region, nodes) in [
        ("all nodes", Vec::new()),
        ("surface", surface),
        ("a part of the surface", few),
    ] {
        driver.set_region(&nodes)?;
        let count = if nodes.is_empty() {
            mesh.node_count()
        } else {
            nodes.len()
        };
        let mut out = vec![[0.0f32; 3]; count];
        let mut spent = Vec::new();
        for (case, truth) in cases.list.iter().zip(truths).take(CASES) {
            driver.reset()?;
            driver.take(&case.tools)?;
            let mut step = 0;
            for index in 1.. {
                let seconds = index as f64 * clock.frame_s;
                if seconds > truth.seconds() {
                    break;
                }
                while step < clock.arrived(seconds) {
                    step += 1;
                    driver.step(&truth.poses(case, step as f64 * clock.step_s), &mut out)?;
                }
                let moment = step as f64 * clock.step_s;
                let since = seconds - moment;
                let ms = driver.present(since, &truth.poses(case, seconds), &mut out)?;
                if step > 0
                    && case.touches((moment / FRAME_S * truth.parts as f64).round() as usize)
                {
                    spent.push(ms);
                }
            }
        }
        let calls = spent.len();
        let spent = Sorted::of(spent);
        times.push(Time {
            region,
            nodes: count,
            calls,
            median_ms: spent.median(),
            p99_ms: spent.quantile(0.99),
        });
    }
    driver.set_region(&[])?;
    Ok(times)
}
