//! `upt fit`: a law's constants from measured curves of tension, compression, shear and torsion, and Prony terms from a strain that is held.

pub mod curve;
pub mod data;
mod growing;
mod hold;
mod least_squares;
pub mod plot;
pub mod stretches;

use std::path::PathBuf;
use std::process::ExitCode;
use std::str::FromStr;

use anyhow::{Context, Result, bail};
use clap::Args;
use elements::{Law, MOST_TERMS, MooneyRivlin, Ogden};
use serde_json::json;

use curve::{Response, Scaled};
use data::Sample;
use growing::Growing;
use hold::Hold;
use stretches::Exponents;

#[derive(Args)]
#[command(after_help = "Examples:
  upt fit kidney.csv --law ogden:2 --plot kidney.svg
  upt fit liver.csv --law yeoh:3
  upt fit skin.csv --law veronda-westmann
  upt fit brain.csv --law ogden:1 --sample cortex
  upt fit brain.csv --law ogden:1 --exponents -18 --sample cortex --json
  upt fit held.csv --relaxation 2 --ramp 0.3 --plot held.svg")]
pub struct Options {
    /// CSV file with the columns mode (tension, compression, shear, torsion), stretch (shear: amount of shear; torsion: that of a cylinder's side),
    /// nominal_stress_pa or nominal_stress_kpa (torsion: 2 M / (pi a^3) of the torque M and the radius a), and sample where it holds several. With --relaxation the columns are time_s and force_mn, force_n, torque_mn_mm or a stress.
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
    /// Law to fit: ogden:TERMS, neo-hookean, mooney-rivlin, yeoh:2 or yeoh:3 (constants), or veronda-westmann.
    #[arg(long, default_value = "ogden:1")]
    law: Asked,
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
enum Asked {
    Stretches(Wanted),
    Grows(Growing),
}

/// One that is written in stretches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    NeoHookean,
    MooneyRivlin,
    Ogden(usize),
}

impl FromStr for Asked {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once(':') {
            None if text == "neo-hookean" => Ok(Self::Stretches(Wanted::NeoHookean)),
            None if text == "mooney-rivlin" => Ok(Self::Stretches(Wanted::MooneyRivlin)),
            None if text == "ogden" => Ok(Self::Stretches(Wanted::Ogden(1))),
            None if text == "yeoh" => Ok(Self::Grows(Growing::Yeoh(3))),
            None if text == "veronda-westmann" => Ok(Self::Grows(Growing::VerondaWestmann)),
            Some(("yeoh", constants)) => match constants.parse() {
                Ok(count) if (2..=3).contains(&count) => Ok(Self::Grows(Growing::Yeoh(count))),
                _ => Err(format!(
                    "`{constants}` is not a number of constants, 2 or 3"
                )),
            },
            Some(("ogden", terms)) => match terms.parse() {
                Ok(count) if (1..=MOST_TERMS).contains(&count) => {
                    Ok(Self::Stretches(Wanted::Ogden(count)))
                }
                _ => Err(format!(
                    "`{terms}` is not a number of terms from 1 to {MOST_TERMS}"
                )),
            },
            _ => Err(format!(
                "law `{text}` is unknown: use ogden:TERMS, neo-hookean, mooney-rivlin, yeoh:2, yeoh:3 or veronda-westmann"
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
            Self::MooneyRivlin => Law::MooneyRivlin(MooneyRivlin {
                c01_share: part(-2.0) / terms.shear_pa(),
            }),
            Self::Ogden(_) => Law::Ogden(*terms),
            Self::NeoHookean => Law::default(),
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
    let wanted = match options.law {
        Asked::Stretches(wanted) => wanted,
        Asked::Grows(_) if !options.exponents.is_empty() => {
            bail!("--exponents goes with --law ogden:TERMS")
        }
        Asked::Grows(which) => {
            let found = growing::best(&sample.curves, which)?;
            return report(options, &sample, &found, found);
        }
    };
    let exponents = match (&options.exponents[..], wanted) {
        ([], wanted) => wanted.exponents(),
        (list, Wanted::Ogden(count)) if list.len() == count => Exponents::Fixed(list.to_vec()),
        (list, Wanted::Ogden(count)) => bail!(
            "--exponents has {} numbers, and ogden:{count} has {count} terms",
            list.len()
        ),
        _ => bail!("--exponents goes with --law ogden:TERMS"),
    };
    let terms = stretches::best(&sample.curves, &exponents)?;
    let found = Scaled {
        law: wanted.law(&terms),
        shear_pa: terms.shear_pa(),
    };
    report(options, &sample, &terms, found)
}

/// A fitted law as `--law` takes it.
fn as_option(law: Law, shear_pa: f64) -> String {
    // A law without a modulus of its own takes Young's.
    let young = 2.0 * (1.0 + POISSON) * shear_pa;
    match law {
        Law::Ogden(_) => format!("{law:.4}"),
        Law::Yeoh(own) => format!(
            "yeoh:{:.4},{:.4} --young {young:.1}",
            own.c2_over_c1, own.c3_over_c1
        ),
        Law::VerondaWestmann(own) => {
            format!("veronda-westmann:{:.4} --young {young:.1}", own.beta)
        }
        _ => format!("{law:.4} --young {young:.1}"),
    }
}

/// What a fit has found; `response` is the law at its stiffness.
fn report(
    options: &Options,
    sample: &Sample,
    response: &impl Response,
    found: Scaled,
) -> Result<ExitCode> {
    let Scaled { law, shear_pa } = found;
    // What `upt simulate` would refuse is said here.
    if let Err(error) = format!("{law}").parse::<Law>() {
        bail!(
            "{}: the fitted law is not one that solvers take: {error}",
            options.data.display()
        );
    }
    let written = as_option(law, shear_pa);
    if let Some(path) = &options.plot {
        std::fs::write(path, plot::draw(&sample.curves, &[(&written, response)]))
            .with_context(|| format!("{}: cannot be written", path.display()))?;
    }
    if options.json {
        let r2: serde_json::Map<_, _> = (sample.curves.iter())
            .map(|curve| (curve.mode.as_str().to_owned(), json!(curve.r2(response))))
            .collect();
        let value = json!({"sample": sample.name, "law": law, "law_option": written, "shear_modulus_pa": shear_pa, "r2": r2});
        println!("{}", serde_json::to_string_pretty(&value)?);
        return Ok(ExitCode::SUCCESS);
    }
    println!("--law {written}");
    println!(
        "shear modulus at rest {shear_pa:.1} Pa, Young's modulus {:.1} Pa if incompressible",
        3.0 * shear_pa
    );
    for curve in &sample.curves {
        let reach = curve.points.iter().map(|[x, _]| *x);
        let (low, high) = reach.fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x), b.max(x)));
        println!(
            "{:12} R² {:.3}  ({} points, {} {low} to {high})",
            curve.mode.as_str(),
            curve.r2(response),
            curve.points.len(),
            if curve.mode.is_shear() {
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
