//! A strain that is held: the Prony terms of a force that falls with time.
//!
//! The strain rises at a constant rate until `ramp_s` and stays. With the force of a law without relaxation as linear in the strain until then, branch `i` carries
//! `A_i k_i(t)`, `k_i = (tau / ramp) (exp(-(t - ramp) / tau) - exp(-t / tau))` (of a step `exp(-t / tau)`), beside what lasts, `A_inf`: a sum of what each
//! branch of [`elements::Relaxation`] does. Terms are fitted to the hold alone, where how the force rose matters little. The method is that of
//! [`super::least_squares`]; unknown are the `A` (at least 0) and the logarithms of the time constants.

use std::path::Path;

use anyhow::{Context, Result, bail};
use elements::{Branch, MOST_BRANCHES, Relaxation};
use rmpfit::{MPFitter, MPPar, MPResult, MPSide};

use super::data::Table;

/// Names of the column of what falls, with their unit as printed.
const LOADS: [(&str, &str); 7] = [
    ("force_mn", "mN"),
    ("force_n", "N"),
    ("torque_mn_mm", "mN mm"),
    ("nominal_stress_pa", "Pa"),
    ("nominal_stress_kpa", "kPa"),
    ("stress_pa", "Pa"),
    ("stress_kpa", "kPa"),
];
/// Time constants that starts are chosen from.
const STARTS: usize = 7;
/// Branches that lose less of the force are left out.
const NOTHING: f64 = 1e-4;
/// Points of a hold at least, beside two a branch.
const LEAST: usize = 3;

/// A measured hold.
#[derive(Clone, Debug)]
pub struct Hold {
    /// `[time in s since the strain began to rise, force or stress]`.
    pub points: Vec<[f64; 2]>,
    /// How long the strain rose, s.
    pub ramp_s: f64,
    /// Unit of the force or stress.
    pub unit: &'static str,
}

/// The terms of a hold.
#[derive(Clone, Debug)]
pub struct Terms {
    pub relaxation: Relaxation,
    /// Force or stress of a strain that comes at once.
    pub at_once: f64,
}

/// `k` of a branch.
fn left(tau: f64, ramp: f64, t: f64) -> f64 {
    let x = ramp / tau;
    let after = (t - ramp).max(0.0);
    // Until the ramp ends its part that has been, then the whole of it.
    let rise = t.min(ramp) / tau;
    if x > 0.0 {
        -(-rise).exp_m1() / x * (-after / tau).exp()
    } else {
        (-t / tau).exp()
    }
}

impl Hold {
    /// Reads a file with the columns `time_s` and one of the loads.
    pub fn read(path: &Path, ramp_s: f64) -> Result<Self> {
        let table = Table::read(path)?;
        let time = table.needed(&["time_s"])?;
        let load = table.needed(&LOADS.map(|(name, _)| name))?;
        let unit = table.unit(load, &LOADS).unwrap_or_default();
        let mut points: Vec<[f64; 2]> = Vec::new();
        for row in table.rows() {
            let [t, y] = [table.number(row, time)?, table.number(row, load)?];
            if t < 0.0 || points.last().is_some_and(|[before, _]| t <= *before) {
                bail!(
                    "{}: time_s is {t}; times are 0 when the strain begins to rise, and ascend",
                    path.display()
                );
            }
            points.push([t, y]);
        }
        let own = Self {
            points,
            ramp_s,
            unit,
        };
        own.check(&path.display().to_string())?;
        Ok(own)
    }

    fn check(&self, whose: &str) -> Result<()> {
        if !(self.ramp_s >= 0.0 && self.ramp_s.is_finite()) {
            bail!("--ramp is {}: it is 0 or more seconds", self.ramp_s);
        }
        let held: Vec<f64> = self.held().map(|[_, y]| *y).collect();
        if held.len() < LEAST {
            bail!(
                "{whose}: {} points from the end of the ramp ({} s) on; at least {LEAST}",
                held.len(),
                self.ramp_s
            );
        }
        let whole: f64 = held.iter().sum();
        if whole == 0.0 || held.iter().any(|y| y * whole < 0.0) {
            bail!("{whose}: a force that is held has one sign; take off the offset of the sensor");
        }
        let [first, last] = [held[0], held[held.len() - 1]];
        if last.abs() >= first.abs() {
            bail!(
                "{whose}: the force does not fall: {first} at the end of the ramp, {last} at the end; does --ramp say when the strain stops?"
            );
        }
        Ok(())
    }

    /// The points of the hold.
    pub fn held(&self) -> impl Iterator<Item = &[f64; 2]> {
        (self.points.iter()).filter(|[t, _]| *t >= self.ramp_s)
    }

    /// Force or stress by some terms at a time.
    pub fn at(&self, terms: &Terms, t: f64) -> f64 {
        let rise = if self.ramp_s > 0.0 {
            (t / self.ramp_s).min(1.0)
        } else {
            1.0
        };
        let branches = terms.relaxation.iter();
        let parts = branches.map(|branch| branch.share * left(branch.tau_s, self.ramp_s, t));
        terms.at_once * (terms.relaxation.lasting() * rise + parts.sum::<f64>())
    }

    /// `1 - sum (y - f)² / sum (y - mean)²` over the hold.
    pub fn r2(&self, terms: &Terms) -> f64 {
        let count = self.held().count() as f64;
        let mean = self.held().map(|[_, y]| y).sum::<f64>() / count;
        let off = self.held().map(|[t, y]| (y - self.at(terms, *t)).powi(2));
        let whole: f64 = self.held().map(|[_, y]| (y - mean).powi(2)).sum();
        1.0 - off.sum::<f64>() / whole
    }
}

struct Problem<'a> {
    hold: &'a Hold,
    /// Largest force of the hold, with its sign.
    unit: f64,
    /// Of `A_inf`, then of `[A, ln tau]` of each branch.
    bounds: Vec<MPPar>,
}

impl MPFitter for Problem<'_> {
    fn eval(&mut self, unknown: &[f64], errors: &mut [f64]) -> MPResult<()> {
        let (lasting, branches) = (unknown[0], unknown[1..].as_chunks::<2>().0);
        for (error, [t, y]) in errors.iter_mut().zip(self.hold.held()) {
            let parts = branches.iter();
            let parts = parts.map(|[a, log]| a * left(log.exp(), self.hold.ramp_s, *t));
            *error = lasting + parts.sum::<f64>() - y / self.unit;
        }
        Ok(())
    }

    fn number_of_points(&self) -> usize {
        self.hold.held().count()
    }

    fn parameters(&self) -> &[MPPar] {
        &self.bounds
    }
}

fn bounds(branches: usize, [low, high]: [f64; 2]) -> Vec<MPPar> {
    let part = || MPPar {
        limited_low: true,
        side: MPSide::Both,
        ..MPPar::new()
    };
    let log = || MPPar {
        limited_low: true,
        limited_up: true,
        limit_low: low,
        limit_up: high,
        side: MPSide::Both,
        ..MPPar::new()
    };
    let pairs = (0..branches).flat_map(|_| [part(), log()]);
    std::iter::once(part()).chain(pairs).collect()
}

/// The best terms of so many branches; fewer where one loses nothing.
pub fn best(hold: &Hold, branches: usize) -> Result<Terms> {
    if !(1..=MOST_BRANCHES).contains(&branches) {
        bail!("--relaxation is {branches}: fit 1 to {MOST_BRANCHES} branches");
    }
    let count = hold.held().count();
    if count < LEAST + 2 * branches {
        bail!(
            "{count} points of the hold; {branches} branches need at least {}",
            LEAST + 2 * branches
        );
    }
    let unit = hold.held().map(|[_, y]| *y);
    let unit = unit.fold(0.0f64, |m, y| if y.abs() > m.abs() { y } else { m });
    let times: Vec<f64> = hold.held().map(|[t, _]| t - hold.ramp_s).collect();
    let last = times[count - 1];
    let soon = times.iter().copied().find(|t| *t > 0.0).unwrap_or(last);
    // What is faster than the first point, or slower than ten holds, no point tells from what comes before or lasts.
    let range = [(0.3 * soon).ln(), (10.0 * last).ln()];
    let step = (range[1] - range[0]) / STARTS as f64;
    let starts: Vec<f64> = (0..STARTS)
        .map(|k| range[0] + (k as f64 + 0.5) * step)
        .collect();
    let chosen = (0..1u32 << STARTS).filter(|bits| bits.count_ones() as usize == branches);
    let mut best: Option<(f64, Vec<f64>)> = None;
    for bits in chosen {
        let logs = (0..STARTS).filter(|at| bits >> at & 1 == 1);
        let share = 0.6 / branches as f64;
        let pairs = logs.flat_map(|at| [share, starts[at]]);
        let mut unknown: Vec<f64> = std::iter::once(0.4).chain(pairs).collect();
        let mut problem = Problem {
            hold,
            unit,
            bounds: bounds(branches, range),
        };
        let Ok(status) = problem.mpfit(&mut unknown) else {
            continue;
        };
        let cost = status.best_norm;
        if cost.is_finite() && best.as_ref().is_none_or(|(least, _)| cost < *least) {
            best = Some((cost, unknown));
        }
    }
    let (_, unknown) = best.context("no terms fit: residuals that are not finite")?;
    let mut pairs = unknown[1..].as_chunks::<2>().0.to_vec();
    let whole = unknown[0] + pairs.iter().map(|[a, _]| a).sum::<f64>();
    pairs.retain(|[a, _]| *a > NOTHING * whole);
    pairs.sort_by(|a, b| a[1].total_cmp(&b[1]));
    let found = pairs.iter().map(|[a, log]| Branch {
        share: a / whole,
        tau_s: log.exp(),
    });
    let relaxation = Relaxation::new(found).context("more branches than a material has")?;
    // What solvers would refuse is said here.
    if let Err(error) = Relaxation::parse(&relaxation.to_string()) {
        bail!(
            "the fitted terms are none that solvers take: {error}; the hold is too short for what lasts, or --relaxation asks for too many branches"
        );
    }
    Ok(Terms {
        relaxation,
        at_once: whole * unit,
    })
}

#[cfg(test)]
mod tests {
    use super::{Hold, Terms, best, left};
    use elements::Relaxation;

    fn of(terms: &Terms, ramp_s: f64) -> Hold {
        let mut hold = Hold {
            points: Vec::new(),
            ramp_s,
            unit: "mN",
        };
        // Even steps of the logarithm, from the ramp to a minute.
        hold.points = (0..=120)
            .map(|k| ramp_s + 0.01 * 6000f64.powf(f64::from(k) / 120.0))
            .map(|t| [t, hold.at(terms, t)])
            .collect();
        hold
    }

    #[test]
    fn terms_are_found_again_from_their_own_hold() {
        for (ramp_s, at_once) in [(0.0, -120.0), (0.3, 45.0)] {
            let terms = Terms {
                relaxation: Relaxation::parse("0.45,0.5,0.365,50").unwrap(),
                at_once,
            };
            let hold = of(&terms, ramp_s);
            hold.check("own").unwrap();
            let found = best(&hold, 2).unwrap();
            assert!((found.at_once / at_once - 1.0).abs() < 1e-3, "{found:?}");
            for (own, want) in found.relaxation.iter().zip(terms.relaxation.iter()) {
                assert!((own.share / want.share - 1.0).abs() < 1e-2, "{found:?}");
                assert!((own.tau_s / want.tau_s - 1.0).abs() < 1e-2, "{found:?}");
            }
            assert!(hold.r2(&found) > 0.999_99);
        }
    }

    /// A branch's force is what the recursion of the elements gives for a stress that rises at a constant rate.
    #[test]
    fn a_ramp_is_that_of_the_elements() {
        let relaxation = Relaxation::parse("0.7,0.4").unwrap();
        let branch = relaxation.iter().next().unwrap();
        let (ramp, h) = (0.3, 0.02);
        let mut q = 0.0;
        for k in 1..=60 {
            let t = f64::from(k) * h;
            let rise = ((t.min(ramp) - (t - h).min(ramp)) / ramp).max(0.0);
            q = branch.decay(h) * q + branch.gain(h) * rise;
            assert!((q - branch.share * left(0.4, ramp, t)).abs() < 1e-12, "{t}");
        }
    }

    #[test]
    fn what_is_wrong_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("hold.csv");
        let falls = "time_s,force_mn\n0,5\n1,4\n2,3\n3,2.5\n4,2.2\n";
        for (text, ramp, words) in [
            ("time_s,length\n0,1\n".to_owned(), 0.0, "no column force_mn"),
            ("time_s,force_n\n0,1\n0,2\n1,1\n".to_owned(), 0.0, "ascend"),
            (falls.to_owned(), 3.5, "1 points from the end"),
            (falls.to_owned(), f64::NAN, "--ramp is NaN"),
            (falls.replace("0,5", "0,0.1"), 0.0, "does not fall"),
            (falls.replace("2.2", "-2.2"), 0.0, "one sign"),
        ] {
            std::fs::write(&path, text).unwrap();
            let error = format!("{:#}", Hold::read(&path, ramp).unwrap_err());
            assert!(error.contains(words), "{error}");
        }
        std::fs::write(&path, falls).unwrap();
        let hold = Hold::read(&path, 0.0).unwrap();
        assert!(
            best(&hold, 2)
                .unwrap_err()
                .to_string()
                .contains("at least 7")
        );
        assert!(best(&hold, 9).unwrap_err().to_string().contains("1 to 6"));
    }
}
