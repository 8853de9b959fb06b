//! Tools at random deep poses, with much friction, three at once and one alone: the time of the worst step, without a budget and with one.

use std::path::Path;

use anyhow::Result;
use contact::{Pose, Rotation, Vector};
use tissue::schemes::SplitMix;
use tissue::solver::Tool;

use super::hand::{any, at, between, sites};
use super::run::Hands;
use crate::bench::Bench;
use crate::stress::Row;
use gauge::{ProcessorTime, Sorted};

const STEPS: usize = 1000;
/// Steps at new poses with the same tools.
const POSES: usize = 10;
/// The budget, as a part of the step's length: 9 of 20 ms.
const PART: f64 = 0.45;

/// The bundle's steps for frames, without a budget and with one.
pub(super) fn rows(bench: &Bench, path: &Path) -> Result<Vec<Row>> {
    let settings = host::ModelSettings::default();
    let open = || Ok::<_, anyhow::Error>(host::Model::open(path, &settings)?.for_frames());
    let (free, bounded) = (open()?, open()?.in_real_time(PART));
    let budget = format!("a budget of {:.0} ms", 1e3 * PART * bounded.step_s());
    let mut rows = Vec::new();
    for (model, budget) in [(free, "no budget"), (bounded, budget.as_str())] {
        // Three mostly fall back; what one alone does is iterated.
        for (count, tools) in [(3, "three tools"), (1, "one tool")] {
            let name = format!("{tools} at random deep poses, friction 0.6 to 1.2, {budget}");
            rows.push(row(&mut Hands::of(bench, &model)?, count, &name)?);
        }
    }
    Ok(rows)
}

fn row(hands: &mut Hands, count: usize, name: &str) -> Result<Row> {
    let mut random = SplitMix(44);
    let spread = sites(hands.bench, 24)?;
    let steps = hands.bench.steps(STEPS);
    hands.driver.reset()?;
    let (mut walls, mut times, mut contact, mut refused) = (vec![], vec![], 0.0f64, 0usize);
    while walls.len() + refused < steps {
        let tools: Vec<Tool> = (0..count)
            .map(|_| Tool {
                friction: between(&mut random, 0.6, 1.2),
                tear_off_mn: 0.0,
                ..any(&mut random)
            })
            .collect();
        hands.driver.take(&tools)?;
        for _ in 0..POSES {
            let mut poses = Vec::new();
            for tool in &tools {
                let site = spread[(random.unit() * spread.len() as f64) as usize];
                let mut pose = at(tool, &site, between(&mut random, 2.0, 20.0))?;
                let mut draw = || between(&mut random, -0.5, 0.5);
                let turn = Rotation::from_scaled_axis(Vector::new(draw(), draw(), draw()));
                pose.pose = Pose::from_parts(pose.pose.translation, turn * pose.pose.rotation);
                poses.push(pose);
            }
            let started = ProcessorTime::of_this_thread();
            match hands.driver.step(&poses, &mut hands.field) {
                Ok(step) => {
                    walls.push(step.ms);
                    times.push(started.ms());
                    contact = contact.max(step.contact_ms);
                }
                Err(_) => refused += 1,
            }
        }
    }
    let times = Sorted::of(times);
    let text = format!(
        "{steps} steps, {refused} refused by the guard; processor time of a step: {:.1} ms in the median, {:.1} ms at p99, {:.1} ms at most; wall: {:.1} ms at most; contact: {contact:.1} ms at most",
        times.median(),
        times.quantile(0.99),
        times.largest(),
        Sorted::of(walls).largest(),
    );
    let finite = hands.field.as_flattened().iter().all(|u| u.is_finite());
    Ok(Row::new(&hands.bench.subject, name, text, finite))
}
