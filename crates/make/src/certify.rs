//! The check at the end of a run: held-out contacts of the bundle, with more corrections a step while `--target-error` is missed.

use std::path::{Path, PathBuf};

use anyhow::Result;

use super::bundle;
use super::clock::{Clock, LEAST_CHECKED};
use super::options::Options;
use super::stages::{Work, key_of};
use crate::check::{self, Certificate};
use crate::corrections;
use host::Effort;

/// Part of what is left that simulates the check's cases.
const SIMULATED: f64 = 0.8;
/// Where `--target-error` is missed, so many corrections are added and a target is halved, at most up to so many corrections.
const MORE_CORRECTIONS: u32 = 3;
const MOST_CORRECTIONS: u32 = 16;

/// A bundle that was checked.
pub struct Certified {
    pub certificate: Certificate,
    pub folder: PathBuf,
    /// What it recommends.
    pub corrections: Effort,
}

/// Checks the bundle in `draft`, of a key, in a copy of its own for each number of corrections.
pub fn run(
    options: &Options,
    work: &mut Work,
    key: &str,
    draft: &Path,
    effort: Effort,
    clock: &Clock,
) -> Result<Certified> {
    let mut corrections = effort;
    loop {
        let certificate = certify(options, work, key, draft, corrections, clock)?;
        let error = certificate.worst_mse();
        let missed = options.target_error.is_some_and(|target| error > target);
        if !missed || corrections.most >= MOST_CORRECTIONS || clock.left(1.0) < 0.0 {
            let folder = work.file(&name_of(corrections));
            return Ok(Certified {
                certificate,
                folder,
                corrections,
            });
        }
        corrections.most = (corrections.most + MORE_CORRECTIONS).min(MOST_CORRECTIONS);
        corrections.target_mm *= 0.5;
        work.tell(&format!(
            "{error:.2e} mm² is above --target-error: {corrections} corrections a step"
        ));
    }
}

/// The name of a stage is that of its files.
fn name_of(corrections: Effort) -> String {
    format!("check-{corrections}").replace('/', "-")
}

/// Held-out contacts of the bundle with so many corrections a step.
fn certify(
    options: &Options,
    work: &mut Work,
    key: &str,
    draft: &Path,
    corrections: Effort,
    clock: &Clock,
) -> Result<Certificate> {
    let name = name_of(corrections);
    let key = key_of(&[
        key.as_bytes(),
        format!(
            "{corrections} {} {:?} {:?} {:?}",
            options.seed, options.cases, options.tools, options.tool_scale
        )
        .as_bytes(),
    ]);
    let left = clock.left(1.0).max(LEAST_CHECKED * clock.budget());
    let copy = work.file(&name);
    bundle::copy(draft, &copy)?;
    let change = corrections::Change {
        recommended: Some(corrections),
        ..corrections::Change::default()
    };
    corrections::recommend(&copy, &change)?;
    let files = ["json", "errors", "film"].map(|end| format!("{name}.{end}"));
    let paths = files.each_ref().map(|file| work.file(file));
    work.stage(
        &name,
        &key,
        &files.each_ref().map(String::as_str),
        |stage| {
            let found = check::measure(&check::Plan {
                bundle: copy,
                cases: options.cases,
                frames: Vec::new(),
                seconds: SIMULATED * left,
                seed: options.seed ^ 0xCE27,
                tools: options.tools.clone(),
                sizes: check::ToolSizes::Asked(options.tool_scale),
                threads: options.threads,
                watch: options.watch.clone(),
            })?;
            stage.decided(&found.words());
            for line in found.left_out(options.cases) {
                stage.decided(&line);
            }
            std::fs::write(&paths[0], serde_json::to_vec_pretty(&found.json())?)?;
            std::fs::write(&paths[1], found.node_errors_bytes())?;
            std::fs::write(&paths[2], serde_json::to_vec(found.film())?)?;
            Ok(())
        },
    )?;
    Certificate::read(&paths)
}
