//! What simulated tools teach: probes at the sites where the validation found the largest errors. What they show in contact joins the coarse
//! space; how the tissue moves after they let go becomes a learned map of releases. Each is kept on its own account where it lessens
//! the error of simulated contacts that neither it nor the certificate has seen. The same contacts calibrate the estimated error.

mod observe;
mod release;

use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use gauge::median;
use serde_json::json;
use tissue::schemes::{FRAMES, SplitMix};
use upt::Corrections;

use super::options::Options;
use super::sizes::Sizes;
use super::stages::Stage;
use super::{bundle, refine};
use crate::check::{Certificate, Recording};
use crate::corrections::{self, Known, Pushes, Workbench, manifest, principal};
use host::Effort;

/// Part of `--minutes` that the calibration has whatever came before.
const LEAST_CALIBRATED: f64 = 0.05;
/// Simulated contacts that decide.
const VALIDATED: usize = 4;
/// Where there is no time for them: cases and frames that only calibrate.
const CALIBRATED: (usize, usize) = (2, 60);
/// Corrections after which the estimated error is calibrated.
const CALIBRATED_AFTER: u32 = 3;
/// Time to replay the contacts through the bundles that are compared, in that of simulating one.
const REPLAYS: f64 = 4.0;
/// Probes, each of so many sites: at least, at most.
const LEAST: usize = 6;
const MOST: usize = 40;
const SITES: usize = 5;
/// Modes of the coarse space in addition to the natural ones, at most.
const MOST_MODES: usize = 120;
/// Something is kept where the error falls below this part of what it was.
const BETTER: f64 = 0.97;
/// The map of releases, which later contacts begin with, must not raise the error in contact by more than the first factor in the median
/// contact, nor by more than the second in all of them together: of so few, one decides their mean.
const NO_WORSE: [f64; 2] = [1.05, 1.25];
const RELEASE: &str = "release.safetensors";
/// The bundle that this stage leaves, and one that may take its place.
const LEARNED: &str = "learned";
const CANDIDATE: &str = "candidate";

/// What there is to learn from.
pub struct Learning<'a> {
    pub options: &'a Options,
    pub sizes: &'a Sizes,
    /// The best bundle without simulations.
    pub refined: &'a Path,
    pub natural: usize,
    pub known: &'a Known<'a>,
    /// What the bundle will recommend.
    pub effort: Effort,
    /// Time for it, seconds.
    pub seconds: f64,
}

/// Leaves the best bundle in the folder `learned`, with as many corrections as it is made for and their estimated error calibrated.
pub fn run(learning: &Learning<'_>, stage: &mut Stage) -> Result<()> {
    let (folder, options) = (stage.folder.clone(), learning.options);
    let learned = folder.join(LEARNED);
    bundle::copy(learning.refined, &learned)?;
    let started = Instant::now();
    let (cases, frames) = match learning.seconds > 0.0 {
        true => (VALIDATED, FRAMES),
        false => CALIBRATED,
    };
    // The calibration has a little time in any case.
    let seconds = learning
        .seconds
        .max(LEAST_CALIBRATED * 60.0 * options.minutes);
    let until = started + Duration::from_secs_f64(seconds);
    let recording = Recording::make(
        learning.refined,
        cases,
        frames,
        until,
        options.seed ^ 0x5EEC,
        options.threads,
        &options.watch,
    )?;
    let each = started.elapsed().as_secs_f64() / cases as f64;
    let left = learning.seconds - started.elapsed().as_secs_f64() - REPLAYS * each;
    let count = ((left / each) as usize).min(MOST);
    if learning.seconds <= 0.0 {
        stage.decided("no time for tool trajectories; a larger --minutes has it");
    } else if count < LEAST {
        stage.decided(&format!(
            "no time for {LEAST} tool trajectories of {each:.1} s; give more --minutes"
        ));
    } else {
        let until = started + Duration::from_secs_f64((learning.seconds - REPLAYS * each).max(0.0));
        teach(learning, stage, &recording, count, until)?;
    }
    calibrate(learning.effort, &recording, &learned, stage)?;
    complete(learning, &learned, stage)?;
    bundle::publish(&learned, &options.out)
}

/// For steps under loads: the natural modes that contact in the domain shows nothing of (`docs/decisions/029-whole-modes.md`).
fn complete(learning: &Learning<'_>, learned: &Path, stage: &mut Stage) -> Result<()> {
    let bench = Workbench::open(
        learned,
        learning.natural,
        learning.known,
        learning.options.threads,
        &learning.options.watch,
    )?;
    let count = bench.write_whole(learned)?;
    if count > 0 {
        stage.decided(&format!(
            "{count} fields for loads: how the body swings where contact in the domain does not reach"
        ));
    }
    Ok(())
}

/// Simulates tools; the bundle in `learned` gets what lessens the recording's errors.
fn teach(
    learning: &Learning<'_>,
    stage: &mut Stage,
    recording: &Recording,
    count: usize,
    until: Instant,
) -> Result<()> {
    let (folder, options) = (stage.folder.clone(), learning.options);
    let started = Instant::now();
    let bench = Workbench::open(
        learning.refined,
        learning.natural,
        learning.known,
        options.threads,
        &options.watch,
    )?;
    let errors = refine::best_errors(&folder)?;
    let sites = choose(&bench.pushes(), &errors, count, options.seed);
    let observed = observe::observe(
        &bench,
        learning.sizes.push_mm,
        &sites,
        options.seed ^ 0x7001,
        until,
        options.threads,
        &options.watch,
    )?;
    stage.decided(&format!(
        "{count} tool trajectories at {} sites, {}: {} states in contact, {} releases ({:.0} s)",
        count * SITES,
        match errors.is_empty() {
            true => "all over the domain",
            false => "half of them where the validation found the largest errors",
        },
        observed.contact.len(),
        observed.releases.len(),
        started.elapsed().as_secs_f64()
    ));
    if observed.ended > 0 {
        stage.decided(&format!(
            "{} of them ended early at a load that inverts the mesh's elements; what came before counts",
            observed.ended
        ));
    }

    let (learned, candidate) = (folder.join(LEARNED), folder.join(CANDIDATE));
    bundle::copy(&learned, &candidate)?;
    let mut rows = refine::rows(&folder)?;
    rows.extend(observed.contact);
    let modes = bench.write_space(
        &candidate,
        principal(&rows, MOST_MODES).into_iter(),
        &corrections::entry(options.draft(), 1.0),
    )?;
    // Both with the same number of corrections: a target would hide what the space is worth.
    let [before, after] =
        [&learned, &candidate].map(|folder| recording.measure(folder, Corrections::Recommended));
    let (before, after) = (before?, after?);
    let coarse = better(&before, &after);
    stage.decided(&format!(
        "trajectories in the coarse space, {modes} modes: {:.2e} mm² in contact after {:.2e}, worst region {:.1} times the mean after {:.1}: {}",
        after.mse_in_contact(), before.mse_in_contact(), worst(&after), worst(&before), kept(coarse)
    ));
    if coarse {
        bundle::copy(&candidate, &learned)?;
    }
    if !observed.releases.is_empty() {
        teach_release(learning, stage, recording, &bench, &observed.releases)?;
    }
    Ok(())
}

/// The map of releases, with the corrections that the bundle will recommend: they are what a release starts from.
fn teach_release(
    learning: &Learning<'_>,
    stage: &mut Stage,
    recording: &Recording,
    bench: &Workbench,
    releases: &[Vec<Vec<f32>>],
) -> Result<()> {
    let (learned, candidate) = (stage.folder.join(LEARNED), stage.folder.join(CANDIDATE));
    calibrate(learning.effort, recording, &learned, stage)?;
    bundle::copy(&learned, &candidate)?;
    let modes = add_release(&candidate, bench, releases)?;
    let [without, with] =
        [&learned, &candidate].map(|folder| recording.measure(folder, Corrections::Recommended));
    let (without, with) = (without?, with?);
    let [free, free_with] = [&without, &with].map(|found| part(found, "free", "mse_mm2"));
    let [contact, contact_with] = [&without, &with].map(Certificate::mse_in_contact);
    let typical = median_ratio(&without, &with);
    let map = free_with < BETTER * free
        && typical <= NO_WORSE[0]
        && contact_with <= NO_WORSE[1] * contact;
    stage.decided(&format!(
        "a learned map of releases, {modes} modes: {free_with:.2e} mm² after a release, {free:.2e} without it; {contact_with:.2e} mm² in contact, {contact:.2e} without it, in the median contact {typical:.2} times as much: {}",
        kept(map)
    ));
    if map {
        bundle::copy(&candidate, &learned)?;
    }
    Ok(())
}

/// Sets what a bundle recommends, and what its estimated error is multiplied by: the median of the true error over the estimated one
/// after a few corrections, where a target mostly ends a step.
fn calibrate(
    effort: Effort,
    recording: &Recording,
    bundle: &Path,
    stage: &mut Stage,
) -> Result<()> {
    let few = effort.most.min(CALIBRATED_AFTER);
    let set = |factor: f32| {
        let change = corrections::Change {
            recommended: Some(effort),
            calibration: Some(factor),
            frame_step_s: None,
        };
        corrections::recommend(bundle, &change)
    };
    set(1.0)?;
    let factor = match few {
        0 => None,
        few => recording
            .measure(bundle, Corrections::Fixed(few))?
            .calibration(),
    };
    if let Some(factor) = factor {
        set(factor)?;
        stage.decided(&format!(
            "{effort} corrections a step; the true error is {factor:.2} times the estimated one after {few}"
        ));
    }
    Ok(())
}

/// Median over the cases of the error in contact with something over that without it.
fn median_ratio(without: &Certificate, with: &Certificate) -> f64 {
    let errors = |found: &Certificate| -> Vec<f64> {
        let programmes = found.json()["tested"]["programmes"].as_array();
        let cases = programmes.into_iter().flatten();
        cases
            .map(|case| case["contact"]["mse_mm2"].as_f64().unwrap_or(f64::NAN))
            .collect()
    };
    let pairs = errors(with).into_iter().zip(errors(without));
    median(pairs.map(|(with, without)| with / without))
}

fn kept(kept: bool) -> &'static str {
    if kept { "kept" } else { "left out" }
}

fn part(found: &Certificate, name: &str, value: &str) -> f64 {
    found.json()[name][value].as_f64().unwrap_or(f64::INFINITY)
}

fn worst(found: &Certificate) -> f64 {
    found.json()["worst_region_over_mean"]
        .as_f64()
        .unwrap_or(1.0)
}

/// Whether the error in contact fell, or that of the worst region without more error elsewhere.
fn better(before: &Certificate, after: &Certificate) -> bool {
    let (was, is) = (before.mse_in_contact(), after.mse_in_contact());
    is < BETTER * was || (is <= was && worst(after) < BETTER * worst(before))
}

fn add_release(bundle: &Path, bench: &Workbench, releases: &[Vec<Vec<f32>>]) -> Result<usize> {
    let damping = bench.material.damping_per_s;
    let file = bundle.join("vibration.safetensors");
    let swing = release::Swing::read(&file, damping, tissue::schemes::FRAME_S)?;
    let count = release::write(&bundle.join(RELEASE), &swing, releases)?;
    manifest::list(bundle, RELEASE, "release", |manifest| {
        let mut prior: serde_json::Value = manifest
            .get("prior")?
            .context("bundle.json has no `prior`")?;
        prior["release"] = json!(RELEASE);
        manifest.set("prior", &prior, "")
    })?;
    Ok(count)
}

/// Rows of the domain for each probe: half of the sites far from each other, half near the validation's in proportion to their errors.
fn choose(pushes: &Pushes<'_>, errors: &[f64], count: usize, seed: u64) -> Vec<Vec<usize>> {
    let mut random = SplitMix(seed ^ 0x517E);
    let all = count * SITES;
    let weighted = if errors.is_empty() { 0 } else { all / 2 };
    let mut sites = pushes.spread(all - weighted, &[], &mut random);
    sites.extend(refine::near_errors(
        pushes,
        errors,
        weighted,
        seed,
        &mut random,
    ));
    let corners = |row: &u32| pushes.mesh.surface[*row as usize];
    let row_of = |site: u32| {
        let faces = pushes.mesh.domain.iter();
        faces
            .map(corners)
            .position(|face| face.contains(&site))
            .unwrap_or(0)
    };
    // Dealt out, so that each probe has sites of both kinds.
    (0..count)
        .map(|probe| {
            (0..SITES)
                .map(|k| row_of(sites[k * count + probe]))
                .collect()
        })
        .collect()
}
