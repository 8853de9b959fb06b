//! Contacts outside of what a bundle was trained on, as far as the reference solver follows.

use anyhow::Result;
use tissue::contact::Patch;

use super::observer::Moment;
use super::pair::{Pair, contact};
use crate::bench::{Bench, Touch, push, ramp};

const STEPS: usize = 30;

/// Moments of all cases; a case ends where the solver says that the mesh cannot carry the load.
pub fn moments(bench: &Bench) -> Result<Vec<Moment>> {
    let depth = f64::from(bench.max_push);
    let centre = bench.central()?;
    let count = bench.domain.face_count();
    let small = bench.patch(count / 3, 0.2 * bench.area)?;
    let large = bench
        .patch(count / 2, 2.5 * bench.area)
        .unwrap_or_else(|_| centre.clone());
    let far = bench.patch(count / 5, bench.area)?;
    let along = |patch: &Patch, direction: [f64; 3], depth: f64| {
        let patch = patch.clone();
        move |step: usize| push(&patch, direction, ramp(step, depth))
    };
    let teleport = {
        let sites = [centre.clone(), far.clone()];
        move |step: usize| {
            let site = &sites[step / 3 % 2];
            push(site, site.inward, 0.7 * depth)
        }
    };
    let cases: Vec<Box<dyn Fn(usize) -> Touch>> = vec![
        Box::new(along(&centre, centre.inward, 1.5 * depth)),
        Box::new(along(&centre, centre.inward, 2.0 * depth)),
        Box::new(along(&far, far.inward, 1.5 * depth)),
        Box::new(along(&centre, centre.inward.map(|v| -v), 0.7 * depth)),
        Box::new(along(&centre, centre.tangents[0], 0.7 * depth)),
        Box::new(along(&far, far.tangents[1], 1.3 * depth)),
        Box::new(along(&small, small.inward, 0.8 * depth)),
        Box::new(along(&large, large.inward, 0.8 * depth)),
        Box::new(teleport),
    ];
    let mut all = Vec::new();
    for touch in cases {
        let mut pair = Pair::new(bench)?;
        for step in 1..=STEPS {
            match pair.step(&contact(&touch(step))) {
                Ok(moment) => all.push(moment),
                Err(error) if error.is::<tissue::solver::SolverError>() => break,
                Err(error) => return Err(error),
            }
        }
    }
    Ok(all)
}
