//! Rounds that make the coarse space better while there is time: static equilibria at new sites, half of them where the
//! validation found the largest errors, and a bundle after each round that helped.

mod equilibria;
mod validate;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use tissue::schemes::SplitMix;
use tissue::tensors::{Dtype, Tensor, f32_values, write_file, write_whole};

use super::bundle;
use super::options::Options;
use super::stages::{Stage, key_of};
use crate::check;
use crate::corrections::{self, Known, Push, Pushes, Workbench, principal};

/// Equilibria of a round.
const EQUILIBRIA: usize = 24;
/// Sites of the validation; no equilibrium is computed for its pushes.
const VALIDATED: usize = 32;
/// Modes in addition to the natural ones, at most: each costs time in every step.
const MOST_MODES: usize = 90;
const MOST_ROUNDS: usize = 12;
/// A round is taken where the error, or the worst region's, falls below this part of what it was.
const BETTER: f64 = 0.97;
/// Rounds in a row that do not help before no more are made.
const MOST_IDLE_ROUNDS: usize = 2;

/// What the coarse stage's pushes added to the linear response, in the work folder.
pub const PATCHES: &str = "patches.safetensors";
/// The best round and its errors, in the work folder.
pub const ERRORS: &str = "errors.json";
/// The bundle of the round in work.
const CANDIDATE: &str = "candidate";
/// What a round changes in a bundle.
const PARTS: [&str; 2] = ["bundle.json", "corrections.safetensors"];

/// What there is to refine.
pub struct Rounds<'a> {
    pub options: &'a Options,
    /// The bundle that the coarse stage left; it stays as it is.
    pub draft: &'a Path,
    pub columns: &'a Path,
    pub natural: usize,
    pub known: &'a Known<'a>,
    /// Key of all that the draft was made from.
    pub key: String,
    /// Time for the rounds, seconds.
    pub seconds: f64,
}

/// What a round found, kept next to its files.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Round {
    key: String,
    /// Mean over the validation's sites, and of the worst region, mm².
    error: f64,
    worst: f64,
    /// Of each site.
    errors: Vec<f64>,
    modes: usize,
    /// Whether its coarse space is the best so far.
    taken: bool,
    seconds: f64,
}

/// The best round, kept for what comes after.
#[derive(Serialize, Deserialize)]
struct Best {
    round: usize,
    errors: Vec<f64>,
}

/// Path of a file of a round.
fn file(folder: &Path, round: usize, end: &str) -> PathBuf {
    folder.join(format!("round-{round}.{end}"))
}

/// Keeps rows of block coordinates.
pub fn write_differences(path: &Path, rows: &[Vec<f32>]) -> Result<()> {
    let bytes = rows.iter().flatten().flat_map(|v| v.to_le_bytes());
    let shape = vec![rows.len(), rows.first().map_or(0, Vec::len)];
    let tensor = Tensor::new("differences", Dtype::F32, shape, bytes.collect());
    write_file(path, &BTreeMap::new(), &[tensor])
        .with_context(|| format!("{}: cannot be written", path.display()))
}

fn read_differences(path: &Path) -> Result<Vec<Vec<f32>>> {
    let read = || -> Result<Vec<Vec<f32>>> {
        let bytes = std::fs::read(path)?;
        let file = safetensors::SafeTensors::deserialize(&bytes)?;
        let tensor = file.tensor("differences")?;
        let values: Vec<f32> = f32_values(tensor.data()).collect();
        let width = tensor.shape().get(1).copied().unwrap_or(0).max(1);
        Ok(values.chunks_exact(width).map(<[f32]>::to_vec).collect())
    };
    read().with_context(|| format!("{}: cannot be read", path.display()))
}

/// Runs rounds until the time is up or they no longer help; leaves the best bundle in the folder `refined`.
pub fn run(rounds: &Rounds<'_>, stage: &mut Stage) -> Result<()> {
    let folder = stage.folder.clone();
    let options = rounds.options;
    let until = Instant::now() + Duration::from_secs_f64(rounds.seconds.max(0.0));
    let mut bench: Option<Workbench> = None;
    let mut best: Option<(usize, Round)> = None;
    let mut key = rounds.key.clone();
    let (mut spent, mut last, mut idle) = (0.0, 0.0, 0);
    for number in 0..=MOST_ROUNDS {
        key = key_of(&[key.as_bytes(), &number.to_le_bytes()]);
        let round = match kept(&folder, number, &key) {
            Some(round) => round,
            None => {
                if spent + last > rounds.seconds {
                    stage.decided("no time for another round; a larger --minutes has it");
                    break;
                }
                let started = Instant::now();
                let bench = match bench {
                    Some(ref bench) => bench,
                    None => &*bench.insert(Workbench::open(
                        rounds.draft,
                        rounds.natural,
                        rounds.known,
                        options.threads,
                        &options.watch,
                    )?),
                };
                // Its files may be of another run, and are written over before the record is.
                let _ = std::fs::remove_file(file(&folder, number, "json"));
                let found = make(rounds, bench, &folder, number, best.as_ref(), until)?;
                let Some(mut round) = found else {
                    stage.decided("no time to end this round; a larger --minutes has it");
                    break;
                };
                round.key.clone_from(&key);
                round.seconds = started.elapsed().as_secs_f64();
                let text = serde_json::to_vec_pretty(&round)?;
                let path = file(&folder, number, "json");
                write_whole(&path, |file| std::io::Write::write_all(file, &text))
                    .with_context(|| format!("{}: cannot be written", path.display()))?;
                if round.taken && number > 0 {
                    bundle::publish(&folder.join(CANDIDATE), &options.out)?;
                }
                round
            }
        };
        (spent, last) = (spent + round.seconds, round.seconds);
        stage.decided(&words(number, &round));
        if round.taken {
            (best, idle) = (Some((number, round)), 0);
        } else {
            idle += 1;
        }
        if idle == MOST_IDLE_ROUNDS {
            stage.decided("more equilibria no longer help");
            break;
        }
    }
    let (round, errors) = (best.as_ref()).map_or((0, Vec::new()), |(number, round)| {
        (*number, round.errors.clone())
    });
    let found = Best { round, errors };
    let path = folder.join(ERRORS);
    std::fs::write(&path, serde_json::to_vec_pretty(&found)?)
        .with_context(|| format!("{}: cannot be written", path.display()))?;
    let refined = folder.join("refined");
    bundle::copy(rounds.draft, &refined)?;
    match best {
        Some((number, _)) if number > 0 => PARTS.iter().try_for_each(|part| {
            let (from, to) = (file(&folder, number, part), refined.join(part));
            std::fs::copy(&from, &to)
                .map(drop)
                .with_context(|| format!("{}: cannot be written", to.display()))
        }),
        _ => Ok(()),
    }
}

fn words(number: usize, round: &Round) -> String {
    let found = format!(
        "{:.2e} mm² of estimated error at {} sites, worst region {:.1} times the mean",
        round.error,
        round.errors.iter().filter(|&&error| error > 0.0).count(),
        round.worst / round.error
    );
    match (number, round.taken) {
        (0, _) => format!("before: {found}"),
        (_, taken) => format!(
            "round {number}, {EQUILIBRIA} equilibria, {} modes: {found}: {} ({:.0} s)",
            round.modes,
            if taken { "taken" } else { "left out" },
            round.seconds
        ),
    }
}

/// A round that an earlier run finished, with its files.
fn kept(folder: &Path, number: usize, key: &str) -> Option<Round> {
    let text = std::fs::read(file(folder, number, "json")).ok()?;
    let round: Round = serde_json::from_slice(&text).ok()?;
    let whole = number == 0
        || PARTS
            .iter()
            .chain(&["safetensors"])
            .all(|part| file(folder, number, part).is_file());
    (round.key == key && whole).then_some(round)
}

fn make(
    rounds: &Rounds<'_>,
    bench: &Workbench,
    folder: &Path,
    number: usize,
    best: Option<&(usize, Round)>,
    until: Instant,
) -> Result<Option<Round>> {
    let options = rounds.options;
    let pushes = bench.pushes();
    let (sites, mut random) = validated(&pushes, options.seed);
    let validation: Vec<Push> = sites
        .iter()
        .map(|&site| pushes.at(site, &mut random))
        .collect();
    let candidate = folder.join(CANDIDATE);
    let mut modes = 0;
    let bundle = if let Some((_, best)) = best {
        let chosen = choose(
            &pushes,
            &sites,
            &best.errors,
            options.seed,
            options.seed ^ (number as u64) << 32,
        );
        let found = equilibria::differences(
            bench,
            rounds.columns,
            &chosen,
            until,
            options.threads,
            &options.watch,
        )?;
        if Instant::now() > until {
            return Ok(None);
        }
        write_differences(&file(folder, number, "safetensors"), &found)?;
        let mut all = read_differences(&folder.join(PATCHES))?;
        for earlier in 1..=number {
            all.extend(read_differences(&file(folder, earlier, "safetensors"))?);
        }
        let count = (all.len() / 2).min(MOST_MODES);
        bundle::copy(rounds.draft, &candidate)?;
        let space = principal(&all, count).into_iter();
        modes = bench.write_space(&candidate, space, &corrections::entry(options.draft(), 1.0))?;
        for part in PARTS {
            let to = file(folder, number, part);
            std::fs::copy(candidate.join(part), &to)
                .with_context(|| format!("{}: cannot be written", to.display()))?;
        }
        candidate.as_path()
    } else {
        rounds.draft
    };
    let errors = validate::errors(
        bench,
        bundle,
        options.draft().most,
        &validation,
        until,
        &options.watch,
    )?;
    let Some(errors) = errors else {
        return Ok(None);
    };
    let carried = errors.iter().filter(|&&error| error > 0.0).count();
    let error = errors.iter().sum::<f64>() / carried.max(1) as f64;
    let worst = worst_region(bench, &sites, &errors);
    let taken = best.is_none_or(|(_, best)| {
        error < BETTER * best.error || (worst < BETTER * best.worst && error <= best.error)
    });
    Ok(Some(Round {
        key: String::new(),
        error,
        worst,
        errors,
        modes,
        taken,
        seconds: 0.0,
    }))
}

/// Errors of the validation's sites with the best bundle; empty where there was no time for them.
pub fn best_errors(folder: &Path) -> Result<Vec<f64>> {
    let path = folder.join(ERRORS);
    let text =
        std::fs::read(&path).with_context(|| format!("{}: cannot be read", path.display()))?;
    Ok(serde_json::from_slice::<Best>(&text)
        .with_context(|| format!("{}", path.display()))?
        .errors)
}

/// All that the best coarse space was made from.
pub fn rows(folder: &Path) -> Result<Vec<Vec<f32>>> {
    let path = folder.join(ERRORS);
    let text =
        std::fs::read(&path).with_context(|| format!("{}: cannot be read", path.display()))?;
    let best: Best =
        serde_json::from_slice(&text).with_context(|| format!("{}", path.display()))?;
    let mut all = read_differences(&folder.join(PATCHES))?;
    for round in 1..=best.round {
        all.extend(read_differences(&file(folder, round, "safetensors"))?);
    }
    Ok(all)
}

/// Sites of the validation.
fn validated(pushes: &Pushes<'_>, seed: u64) -> (Vec<u32>, SplitMix) {
    let mut random = SplitMix(seed ^ 0x7A11);
    (pushes.spread(VALIDATED, &[], &mut random), random)
}

/// Sites near the validation's, in proportion to their errors.
pub fn near_errors(
    pushes: &Pushes<'_>,
    errors: &[f64],
    count: usize,
    seed: u64,
    random: &mut SplitMix,
) -> Vec<u32> {
    let (centres, _) = validated(pushes, seed);
    let total: f64 = errors.iter().sum();
    let mut sites = Vec::with_capacity(count);
    while sites.len() < count {
        let mut left = random.unit() * total;
        let at = errors.iter().position(|error| {
            left -= error;
            left <= 0.0
        });
        let centre = centres[at.unwrap_or(0)];
        // The nearest of a few random ones: near, and another one each time.
        let near = (0..pushes.nodes.len().div_ceil(VALIDATED).max(4))
            .map(|_| pushes.nodes[random.below(pushes.nodes.len())])
            .min_by(|&a, &b| {
                pushes
                    .distance(a, centre)
                    .total_cmp(&pushes.distance(b, centre))
            });
        sites.push(near.unwrap_or(centre));
    }
    sites
}

/// Pushes of a round: half at sites far from the validation's and from each other, half near the validation's sites in
/// proportion to their errors.
fn choose(
    pushes: &Pushes<'_>,
    validated: &[u32],
    errors: &[f64],
    seed_of_sites: u64,
    seed: u64,
) -> Vec<Push> {
    let mut random = SplitMix(seed);
    let mut sites = pushes.spread(EQUILIBRIA / 2, validated, &mut random);
    let more = EQUILIBRIA - sites.len();
    sites.extend(near_errors(
        pushes,
        errors,
        more,
        seed_of_sites,
        &mut random,
    ));
    sites
        .into_iter()
        .map(|site| pushes.at(site, &mut random))
        .collect()
}

/// Largest mean error of a region's sites, mm².
fn worst_region(bench: &Workbench, sites: &[u32], errors: &[f64]) -> f64 {
    let regions = check::regions(&bench.mesh);
    let mut sums = vec![(0.0, 0.0); regions.len()];
    let carried = sites.iter().zip(errors).filter(|(_, error)| **error > 0.0);
    for (&site, error) in carried {
        let place = bench.mesh.positions[site as usize].map(f64::from);
        if let Some(region) = check::nearest(&regions, place) {
            sums[region].0 += error;
            sums[region].1 += 1.0;
        }
    }
    sums.iter()
        .filter(|(_, count)| *count > 0.0)
        .map(|(sum, count)| sum / count)
        .fold(0.0, f64::max)
}
