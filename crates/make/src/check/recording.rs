//! Held-out contacts that are simulated once and replayed through several bundles of the same body, to choose between them.

use std::path::Path;
use std::time::Instant;

use anyhow::Result;
use upt::Corrections;

use super::case::{Case, Frame, Replay};
use super::score::Touch;
use super::{Bundle, Certificate, held_out};
use crate::Watch;
use crate::parallel::{in_parallel, workers};

/// A frame that was kept: 12 bytes a node.
struct Kept {
    touch: Touch,
    truth: Vec<[f32; 3]>,
    reaction: Vec<[f32; 3]>,
}

/// Frames of some cases.
pub struct Recording {
    seed: u64,
    threads: usize,
    cases: Vec<(Case, Vec<Kept>)>,
}

impl Recording {
    /// Simulates the first frames of `count` cases of a seed, within the bundle's envelope and as long as there is time.
    pub fn make(
        folder: &Path,
        count: usize,
        frames: usize,
        until: Instant,
        seed: u64,
        threads: usize,
        watch: &Watch,
    ) -> Result<Self> {
        let bundle = Bundle::open(folder)?;
        let bar = watch.bar((count * frames) as u64, "contacts to choose by");
        let cases = in_parallel(workers(threads).min(count), &|at| at < count, &|at| {
            let case = held_out(seed, at);
            let mut kept = Vec::with_capacity(frames);
            let body = bundle.body();
            case.simulate(&bundle.model, &body, frames, Some(until), &mut |frame| {
                bar.inc(1);
                kept.push(Kept {
                    touch: frame.touch.clone(),
                    truth: frame.truth.to_vec(),
                    reaction: frame.reaction.to_vec(),
                });
                Ok(())
            })?;
            Ok((case, kept))
        })?;
        drop(bar);
        Ok(Self {
            seed,
            threads,
            cases,
        })
    }

    /// What a bundle makes of them with so many corrections.
    pub fn measure(&self, folder: &Path, corrections: Corrections) -> Result<Certificate> {
        let bundle = Bundle::open(folder)?;
        let count = self.cases.len();
        let scores = in_parallel(workers(self.threads).min(count), &|at| at < count, &|at| {
            let (case, frames) = &self.cases[at];
            let mut replay = Replay::new(*case, &bundle.model, corrections, bundle.body())?;
            for kept in frames {
                replay.step(&Frame {
                    touch: &kept.touch,
                    truth: &kept.truth,
                    reaction: &kept.reaction,
                })?;
            }
            Ok(replay.finish(None))
        })?;
        bundle.certificate(self.seed, scores)
    }
}
