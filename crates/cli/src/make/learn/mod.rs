//! What simulated tools teach: probes at the sites where the validation found the largest errors. What they show in contact joins the coarse
//! space; how the tissue moves after they let go becomes a learned map of releases. Each is kept where it lessens the error of
//! simulated contacts that neither it nor the certificate has seen.

mod observe;
mod release;

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result};
use serde_json::json;
use tissue::mesh::Mesh;
use tissue::schemes::SplitMix;

use super::options::{Options, Sizes};
use super::stages::Stage;
use super::{bundle, refine, vibration};
use crate::check::{self, Certificate};
use crate::corrections::{Pushes, Workbench, manifest, principal};
use crate::effort::Effort;

/// Simulated contacts that decide.
const VALIDATED: usize = 4;
/// Probes, each of so many sites: at least, at most.
const LEAST: usize = 6;
const MOST: usize = 40;
const SITES: usize = 5;
/// Modes of the coarse space beside the natural ones, at most.
const MOST_MODES: usize = 120;
/// Something is kept where the error falls below this part of what it was.
const BETTER: f64 = 0.97;
const RELEASE: &str = "release.safetensors";
/// The bundle with all that was learned.
const CANDIDATE: &str = "candidate";

/// What there is to learn from.
pub struct Learning<'a> {
    pub options: &'a Options,
    pub mesh: &'a Mesh,
    pub sizes: &'a Sizes,
    /// The best bundle without simulations.
    pub refined: &'a Path,
    /// Time for it, seconds.
    pub seconds: f64,
}

/// Leaves the better of both in the folder `learned`.
pub fn run(learning: &Learning<'_>, stage: &mut Stage) -> Result<()> {
    let (folder, options) = (stage.folder.clone(), learning.options);
    let learned = folder.join("learned");
    bundle::copy(learning.refined, &learned)?;
    let started = Instant::now();
    if learning.seconds <= 0.0 {
        stage.decided("no time for tool trajectories; a larger --minutes has it");
        return Ok(());
    }
    let before = validate(options, learning.refined)?;
    let each = started.elapsed().as_secs_f64() / VALIDATED as f64;
    let left = learning.seconds - 2.3 * each * VALIDATED as f64;
    let count = ((left / each) as usize).min(MOST);
    if count < LEAST {
        stage.decided(&format!(
            "no time for {LEAST} tool trajectories of {each:.1} s; a larger --minutes has it"
        ));
        return Ok(());
    }
    let natural = vibration::count(learning.mesh, options.natural);
    let bench = Workbench::open(learning.refined, natural, options.threads, options.json)?;
    let errors = refine::best_errors(&folder)?;
    let sites = choose(&bench.pushes(), &errors, count, options.seed);
    let observed = observe::observe(
        &bench,
        learning.sizes.push_mm,
        &sites,
        options.seed ^ 0x7001,
        options.threads,
        options.json,
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

    let candidate = folder.join(CANDIDATE);
    bundle::copy(learning.refined, &candidate)?;
    let mut rows = refine::rows(&folder)?;
    rows.extend(observed.contact);
    let modes = bench.write_space(
        &candidate,
        principal(&rows, MOST_MODES).into_iter(),
        Effort::fixed(options.recommended),
        1.0,
    )?;
    let fitted = match observed.releases.is_empty() {
        true => None,
        false => Some(add_release(&candidate, &bench, &observed.releases)?),
    };
    let after = validate(options, &candidate)?;
    let coarse = better(&before, &after);
    let [free, free_after] = [&before, &after].map(|found| part(found, "free", "mse_mm2"));
    let map = fitted.is_some() && free_after < BETTER * free;
    let kept = |kept: bool| if kept { "kept" } else { "left out" };
    stage.decided(&format!(
        "trajectories in the coarse space, {modes} modes: {:.2e} mm² in contact after {:.2e}, worst region {:.1} times the mean after {:.1}: {}",
        after.mse_in_contact(), before.mse_in_contact(), worst(&after), worst(&before), kept(coarse)
    ));
    if let Some(count) = fitted {
        stage.decided(&format!(
            "a learned map of releases, {count} modes: {free_after:.2e} mm² after a release, {free:.2e} without it: {}",
            kept(map)
        ));
    }
    if coarse {
        bundle::copy(&candidate, &learned)?;
        if !map && fitted.is_some() {
            manifest::remove_release(&learned, RELEASE)?;
        }
    } else if map {
        add_release(&learned, &bench, &observed.releases)?;
    }
    if coarse || map {
        bundle::publish(&learned, &options.out)?;
    }
    Ok(())
}

/// Contacts of seeds of their own, through a bundle and the reference solver.
fn validate(options: &Options, bundle: &Path) -> Result<Certificate> {
    check::measure(&check::Plan {
        bundle: bundle.into(),
        cases: Some(VALIDATED),
        seconds: f64::INFINITY,
        seed: options.seed ^ 0x5EEC,
        threads: options.threads,
        quiet: options.json,
    })
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
