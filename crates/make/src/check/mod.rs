//! Held-out contacts through a bundle and the reference solver, and the certificate that results.
//!
//! Nothing is stored on the way: the solver and the bundle's scenes step side by side. One scene makes the steps that the bundle
//! recommends, another leaves its corrections out; for a bundle without a learned map the latter is linear elasticity, static in
//! contact and swinging freely after a release.

mod bundle;
mod case;
mod certificate;
mod page;
mod recording;
mod score;
mod tools;
mod verdict;

pub use certificate::Certificate;
pub use recording::Recording;
pub use score::{nearest, regions};

use std::time::{Duration, Instant};

use anyhow::Result;
use tissue::schemes::{FRAMES, Scheme};
use upt::Corrections;

use crate::parallel::{in_parallel, workers};
use bundle::Bundle;
pub use bundle::{Plan, ToolSizes};
use case::{Case, Replay};

/// Programmes in the order in which they are run: `probe` has five sites, the others are the paper's.
const ORDER: [Scheme; 8] = [
    Scheme::Probe,
    Scheme::Four,
    Scheme::Probe,
    Scheme::Three,
    Scheme::Probe,
    Scheme::One,
    Scheme::Probe,
    Scheme::Five,
];
/// Simulates and replays; the certificate lacks the bundle's identity until it is finished.
pub fn measure(plan: &Plan) -> Result<Certificate> {
    let started = Instant::now();
    // The tools have half of the time, and what the contacts leave of theirs.
    let seconds = match plan.tools.is_empty() {
        true => plan.seconds,
        false => 0.5 * plan.seconds,
    };
    let until = seconds
        .is_finite()
        .then(|| started + Duration::from_secs_f64(seconds.max(0.0)));
    let bundle = Bundle::open(&plan.bundle)?;
    let most = plan.cases.unwrap_or(ORDER.len());
    let workers = workers(plan.threads).min(most);
    let bar = plan.watch.bar((most * FRAMES) as u64, "held-out contacts");
    let late = |at: usize| {
        let spent = started.elapsed().as_secs_f64();
        // Another case takes about as long as those before it.
        let rounds = (at / workers) as f64;
        at >= workers && spent * (rounds + 1.0) / rounds > seconds
    };
    let scores = in_parallel(workers, &|at| at < most && !late(at), &|at| {
        let case = held_out(plan.seed, at);
        let body = bundle.body();
        let mut replay = Replay::new(case, &bundle.model, Corrections::Recommended, body)?;
        if at == 0 {
            replay = replay.filmed();
        }
        // The first frame is the body at rest.
        let frames = plan
            .frames
            .get(at)
            .copied()
            .flatten()
            .map(|count| count + 1);
        let most = frames.unwrap_or(FRAMES);
        let ended = case.simulate(&bundle.model, &body, most, until, &mut |frame| {
            bar.inc(1);
            replay.step(frame)
        })?;
        Ok(replay.finish(ended.or(frames.map(case::no_time))))
    })?;
    drop(bar);
    let mut certificate = bundle.certificate(plan.seed, scores)?;
    if !plan.tools.is_empty() {
        let sizes = plan.sizes.choose(&bundle);
        let left = plan.seconds - started.elapsed().as_secs_f64();
        let rows = tools::measure(plan, &bundle, sizes.scale, left)?;
        certificate.add_tools(rows, &sizes, &plan.tools);
    }
    certificate.judge();
    Ok(certificate)
}

/// The case at a place of a plan.
fn held_out(seed: u64, at: usize) -> Case {
    Case {
        scheme: ORDER[at % ORDER.len()],
        seed: seed.wrapping_mul(1000).wrapping_add(at as u64),
    }
}
