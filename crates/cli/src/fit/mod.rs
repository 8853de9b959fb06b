//! `upt fit`: a law's constants from measured curves of tension, compression and shear, and Prony terms from a strain that is held.

pub mod curve;
pub mod data;
mod hold;
pub mod least_squares;
pub mod plot;

use std::path::PathBuf;
use std::process::ExitCode;
use std::str::FromStr;

use anyhow::{Context, Result, bail};
use clap::Args;
use elements::{Law, MOST_TERMS, MooneyRivlin, Ogden};
use serde_json::json;

use data::Sample;
use hold::Hold;
use least_squares::Exponents;

#[derive(Args)]
#[command(after_help = "Examples:
  upt fit kidney.csv --law ogden:2 --plot kidney.svg
  upt fit brain.csv --law ogden:1 --sample cortex
  upt fit brain.csv --law ogden:1 --exponents -18 --sample cortex --json
  upt fit held.csv --relaxation 2 --ramp 0.3 --plot held.svg")]
pub struct Options {
    /// CSV file with the columns mode (tension, compression, shear), stretch (shear: amount of shear), nominal_stress_pa or
    /// nominal_stress_kpa, and sample where it holds several. With --relaxation the columns are time_s and force_mn, force_n, torque_mn_mm or a stress.
    data: PathBuf,
    /// Fit so many branches of relaxation (1 to 6) to a strain that is held, instead of a law.
    #[arg(long, value_name = "BRANCHES", conflicts_with_all = ["law", "exponents", "sample"])]
    relaxation: Option<usize>,
    /// How long the strain rises, at a constant rate from time 0 on, before it is held, s.
    #[arg(
        long,
        value_name = "SECONDS",
        default_value_t = 0.0,
        requires = "relaxation"
    )]
    ramp: f64,
    /// Law to fit: ogden:TERMS, neo-hookean or mooney-rivlin.
    #[arg(long, default_value = "ogden:1")]
    law: Wanted,
    /// Exponents of an Ogden law, instead of finding them; even ones make the fastest steps.
    #[arg(
        long,
        value_name = "ALPHA",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    exponents: Vec<f64>,
    /// Specimen to fit, where the file holds several.
    #[arg(long)]
    sample: Option<String>,
    /// Write a plot (SVG).
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Poisson's ratio of Young's modulus in the options that are printed: the default of `upt simulate` and `upt make`.
const POISSON: f64 = 0.49;

/// A law whose constants are not known yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    NeoHookean,
    MooneyRivlin,
    Ogden(usize),
}

impl FromStr for Wanted {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once(':') {
            None if text == "neo-hookean" => Ok(Self::NeoHookean),
            None if text == "mooney-rivlin" => Ok(Self::MooneyRivlin),
            None if text == "ogden" => Ok(Self::Ogden(1)),
            Some(("ogden", terms)) => match terms.parse() {
                Ok(count) if (1..=MOST_TERMS).contains(&count) => Ok(Self::Ogden(count)),
                _ => Err(format!(
                    "`{terms}` is not a number of terms from 1 to {MOST_TERMS}"
                )),
            },
            _ => Err(format!(
                "law `{text}` is unknown: use ogden:TERMS, neo-hookean or mooney-rivlin"
            )),
        }
    }
}

impl Wanted {
    /// Its exponents.
    pub fn exponents(self) -> Exponents {
        match self {
            Self::NeoHookean => Exponents::Fixed(vec![2.0]),
            Self::MooneyRivlin => Exponents::Fixed(vec![2.0, -2.0]),
            Self::Ogden(count) => Exponents::Free(count),
        }
    }

    /// The law that fitted terms are, as `--law` takes it.
    fn law(self, terms: &Ogden) -> Law {
        let part = |alpha: f64| -> f64 {
            let terms = terms.terms.iter().filter(|term| term.alpha == alpha);
            terms.map(|term| 0.5 * term.mu_pa * term.alpha).sum()
        };
        match self {
            Self::NeoHookean => Law::default(),
            Self::MooneyRivlin => Law::MooneyRivlin(MooneyRivlin {
                c01_share: part(-2.0) / terms.shear_pa(),
            }),
            Self::Ogden(_) => Law::Ogden(*terms),
        }
    }
}

/// The specimen that was asked for.
fn chosen(mut samples: Vec<Sample>, asked: Option<&str>) -> Result<Sample> {
    let names: Vec<&str> = samples.iter().map(|sample| sample.name.as_str()).collect();
    let at = match asked {
        None if samples.len() == 1 => 0,
        None => bail!(
            "the file holds {}; choose one by --sample",
            names.join(", ")
        ),
        Some(name) => (names.iter().position(|other| *other == name)).with_context(|| {
            format!("no specimen `{name}`; the file holds {}", names.join(", "))
        })?,
    };
    Ok(samples.swap_remove(at))
}

/// `--relaxation`.
fn run_hold(options: &Options, branches: usize) -> Result<ExitCode> {
    let hold = Hold::read(&options.data, options.ramp)?;
    let terms = hold::best(&hold, branches)
        .with_context(|| format!("{}: cannot be fitted", options.data.display()))?;
    let r2 = hold.r2(&terms);
    if let Some(path) = &options.plot {
        std::fs::write(path, plot::draw_hold(&hold, &terms))
            .with_context(|| format!("{}: cannot be written", path.display()))?;
    }
    let written: Vec<String> = (terms.relaxation.iter())
        .map(|branch| format!("{:.4},{:.4}", branch.share, branch.tau_s))
        .collect();
    let (written, lasting) = (written.join(","), terms.relaxation.lasting());
    if options.json {
        let value = json!({"relaxation": terms.relaxation, "relaxation_option": written, "at_once": terms.at_once, "unit": hold.unit, "lasting": lasting, "r2": r2});
        println!("{}", serde_json::to_string_pretty(&value)?);
        return Ok(ExitCode::SUCCESS);
    }
    println!("--relaxation {written}");
    println!(
        "{:.4} {} if the strain came at once, of which {:.1} % lasts; R² of the hold {r2:.4} ({} points)",
        terms.at_once,
        hold.unit,
        100.0 * lasting,
        hold.held().count()
    );
    println!("linear in the strain while it rises; beyond the hold the terms extrapolate");
    if let Some(path) = &options.plot {
        println!("plot: {}", path.display());
    }
    Ok(ExitCode::SUCCESS)
}

pub fn run(options: &Options) -> Result<ExitCode> {
    if let Some(branches) = options.relaxation {
        return run_hold(options, branches);
    }
    let sample = chosen(data::read(&options.data)?, options.sample.as_deref())?;
    let exponents = match (&options.exponents[..], options.law) {
        ([], law) => law.exponents(),
        (list, Wanted::Ogden(count)) if list.len() == count => Exponents::Fixed(list.to_vec()),
        (list, Wanted::Ogden(count)) => bail!(
            "--exponents has {} numbers, and ogden:{count} has {count} terms",
            list.len()
        ),
        _ => bail!("--exponents goes with --law ogden:TERMS"),
    };
    let terms = least_squares::best(&sample.curves, &exponents)?;
    let law = options.law.law(&terms);
    if let Law::Ogden(_) = law {
        // What `upt simulate` would refuse is said here.
        if let Err(error) = format!("{law}").parse::<Law>() {
            bail!(
                "{}: the fitted law is not one that solvers take: {error}",
                options.data.display()
            );
        }
    }
    let shear = terms.shear_pa();
    // A law without a modulus of its own takes Young's.
    let written = match law {
        Law::Ogden(_) => format!("{law:.4}"),
        _ => format!("{law:.4} --young {:.1}", 2.0 * (1.0 + POISSON) * shear),
    };
    if let Some(path) = &options.plot {
        std::fs::write(path, plot::draw(&sample.curves, &[(&written, &terms)]))
            .with_context(|| format!("{}: cannot be written", path.display()))?;
    }
    if options.json {
        let r2: serde_json::Map<_, _> = (sample.curves.iter())
            .map(|curve| (curve.mode.as_str().to_owned(), json!(curve.r2(&terms))))
            .collect();
        let value = json!({"sample": sample.name, "law": law, "law_option": written, "shear_modulus_pa": shear, "r2": r2});
        println!("{}", serde_json::to_string_pretty(&value)?);
        return Ok(ExitCode::SUCCESS);
    }
    println!("--law {written}");
    println!(
        "shear modulus at rest {shear:.1} Pa, Young's modulus {:.1} Pa if incompressible",
        3.0 * shear
    );
    for curve in &sample.curves {
        let reach = curve.points.iter().map(|[x, _]| *x);
        let (low, high) = reach.fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x), b.max(x)));
        println!(
            "{:12} R² {:.3}  ({} points, {} {low} to {high})",
            curve.mode.as_str(),
            curve.r2(&terms),
            curve.points.len(),
            if curve.mode == curve::Mode::Shear {
                "shear"
            } else {
                "stretch"
            },
        );
    }
    println!("homogeneous and incompressible; beyond these stretches the law extrapolates");
    if let Some(path) = &options.plot {
        println!("plot: {}", path.display());
    }
    Ok(ExitCode::SUCCESS)
}
