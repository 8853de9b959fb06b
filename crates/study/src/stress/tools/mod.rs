//! The same suite driven by tools: their contact is solved in the step. Expected: bounded states, no element inside out
//! without a flag, no tool that stays deep in the tissue without one, and tissue that comes back to rest.

mod cut_rows;
mod deep;
mod hand;
mod inputs;
mod met;
mod run;
mod sudden;
mod thrust;
mod truth;
mod way;

use std::path::Path;

use anyhow::Result;
use clap::ValueEnum as _;
use contact::Vector;
use tissue::programmes::{ToolCase, ToolProgramme};
use tissue::schemes::SplitMix;
use tissue::solver::Tool;

use upt_cli::progress;

use super::Row;
use crate::bench::Bench;
use hand::{any, at, between, central, moved, rod, sites};
use run::{Hands, Run};

/// All cases of the bundle at `path`.
pub fn rows(bench: &Bench, path: &Path) -> Result<Vec<Row>> {
    let mut hands = Hands::new(bench, path)?;
    let bar = progress::cases(6, &bench.subject);
    let mut rows = programmes(&mut hands)?;
    bar.inc(1);
    rows.extend(jumps(&mut hands)?);
    bar.inc(1);
    rows.extend(inside(&mut hands)?);
    bar.inc(1);
    rows.extend(sudden_rows(bench, path, &[])?);
    bar.inc(1);
    rows.push(random(&mut hands)?);
    bar.inc(1);
    rows.extend(inputs::rows(bench, path)?);
    bar.finish_and_clear();
    Ok(rows)
}

/// Kinds of tools that a step could lose, or whose step takes longest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Sudden {
    /// Quick balls, balls that leap, needles, points, and balls beneath the surface.
    Quick,
    /// Blades that press and leap on.
    Thrust,
    /// Three tools at random deep poses: the longest step.
    Deep,
    /// Blades and aspirators.
    Cut,
}

/// Rows of these kinds; none named: all.
pub fn sudden_rows(bench: &Bench, path: &Path, kinds: &[Sudden]) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for kind in Sudden::value_variants() {
        if !kinds.is_empty() && !kinds.contains(kind) {
            continue;
        }
        rows.extend(match kind {
            Sudden::Quick => sudden::rows(&mut Hands::for_frames(bench, path)?)?,
            Sudden::Thrust => thrust::rows(&mut Hands::for_frames(bench, path)?)?,
            Sudden::Deep => deep::rows(bench, path)?,
            Sudden::Cut => cut_rows::rows(bench, path)?,
        });
    }
    Ok(rows)
}

/// Every programme, with seeds that no dataset has.
fn programmes(hands: &mut Hands) -> Result<Vec<Row>> {
    let cases = if hands.bench.quick { 1 } else { 4 };
    let mut rows = Vec::new();
    for programme in ToolProgramme::every() {
        let name = format!("tools, {} x {}", cases, programme.name());
        let mut run = Run::new();
        let mut placed = 0;
        for seed in 0..cases {
            let Ok(case) = ToolCase::new(programme, &hands.bench.mesh, 90_000 + seed, None) else {
                continue;
            };
            placed += 1;
            hands.driver.reset()?;
            hands.drive(&mut run, &case.tools, case.frames.into_iter())?;
        }
        rows.push(match placed {
            0 => Row::left(
                &hands.bench.subject,
                &name,
                "no site of the domain lets it start clear of the tissue",
            ),
            _ => hands.judged(&name, &run, true)?,
        });
    }
    Ok(rows)
}

/// Motions that no hand makes.
fn jumps(hands: &mut Hands) -> Result<Vec<Row>> {
    let middle = central(hands.bench)?;
    let spread = sites(hands.bench, 8)?;
    let tools = [rod(5.0, 0.2)];
    let pose = |site, depth| at(&tools[0], site, depth);
    let teleports: Vec<_> = (0..80)
        .map(|step| Ok(vec![pose(&spread[step % spread.len()], 5.0)?]))
        .collect::<Result<_>>()?;
    let mut rows = vec![hands.row("a tool that teleports", &tools, teleports.into_iter())?];
    // 10 mm a step: in and out, then across.
    let across = contact::friction::frame(middle.inward).y_axis;
    let mut fast = Vec::new();
    for step in 0..60usize {
        let deep = [-5.0, 5.0, 10.0, 0.0][step % 4];
        fast.push(vec![pose(&middle, deep)?]);
    }
    let start = pose(&middle, 4.0)?;
    for step in 0..40 {
        let way = 10.0 * ((step % 6) as f32 - 3.0).abs() - 15.0;
        fast.push(vec![moved(&start, across * way)]);
    }
    rows.push(hands.row("a tool at 200 mm/s", &tools, fast.into_iter())?);
    let pair = [rod(5.0, 0.2), rod(4.0, 0.0)];
    let joined: Vec<_> = (0..60)
        .map(|step| {
            let depth = 8.0 * (step as f32 / 30.0).min(1.0) - 2.0;
            let first = at(&pair[0], &middle, depth)?;
            let second = at(&pair[1], &middle, depth)?;
            Ok(vec![first, moved(&second, across * (step as f32 * 0.05))])
        })
        .collect::<Result<_>>()?;
    rows.push(hands.row("two tools inside each other", &pair, joined.into_iter())?);
    Ok(rows)
}

/// A tool that is in the tissue from the first step on comes out of it, or says that it does not.
fn inside(hands: &mut Hands) -> Result<Vec<Row>> {
    let middle = central(hands.bench)?;
    let tool = rod(5.0, 0.0);
    let mut rows = Vec::new();
    for depth in [3.0, 8.0, 25.0] {
        let tools = [tool.clone()];
        let pose = at(&tool, &middle, depth)?;
        hands.driver.reset()?;
        let mut first = Run::new();
        hands.drive(&mut first, &tools, std::iter::repeat_n(vec![pose], 20))?;
        let mut later = Run::new();
        hands.drive(&mut later, &tools, std::iter::repeat_n(vec![pose], 20))?;
        let told = later.depth <= 0.5 || first.flags != 0;
        let run = Run {
            steps: first.steps + later.steps,
            flags: first.flags | later.flags,
            largest: first.largest.max(later.largest),
            det: first.det.min(later.det),
            inverted: first.inverted + later.inverted,
            silent: first.silent + later.silent,
            silent_depth: first.silent_depth + later.silent_depth,
            depth: later.depth,
            finite: first.finite && later.finite,
            other: first.other.or(later.other),
        };
        let name = format!("a tool that starts {depth} mm deep");
        rows.push(hands.judged(&name, &run, told)?);
    }
    Ok(rows)
}

/// Random tools on random ways, one set after another without a reset.
fn random(hands: &mut Hands) -> Result<Row> {
    let steps = hands.bench.steps(10_000);
    let spread = sites(hands.bench, 24)?;
    let mut random = SplitMix(2026);
    let mut run = Run::new();
    hands.driver.reset()?;
    while run.steps < steps && run.other.is_none() {
        let count = 1 + (random.unit() * 3.0) as usize;
        let tools: Vec<Tool> = (0..count).map(|_| any(&mut random)).collect();
        let mut poses = Vec::new();
        for tool in &tools {
            let site = spread[(random.unit() * spread.len() as f64) as usize];
            poses.push((at(tool, &site, -2.0)?, site));
        }
        let length = 20 + (random.unit() * 40.0) as usize;
        let mut frames = Vec::new();
        for step in 0..length.min(steps - run.steps) {
            for (pose, site) in &mut poses {
                let mut draw = || between(&mut random, -1.0, 1.0);
                let wander = Vector::new(draw(), draw(), draw()) * 3.0;
                // A way in for the first half, out for the second.
                let way = if 2 * step < length { 0.6 } else { -0.8 };
                *pose = moved(pose, wander + site.inward * way);
                pose.grasp = random.unit() < 0.2;
            }
            frames.push(poses.iter().map(|(pose, _)| *pose).collect());
        }
        hands.drive(&mut run, &tools, frames.into_iter())?;
    }
    let name = format!("{} random steps of random tools", run.steps);
    hands.judged(&name, &run, true)
}
