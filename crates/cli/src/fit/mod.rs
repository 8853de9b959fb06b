//! `upt fit`: a law's constants from measured curves of tension, compression, shear and torsion, or from a press of a cylinder, and Prony terms from a strain
//! that is held.

pub mod curve;
pub mod data;
mod growing;
mod hold;
pub mod least_squares;
pub mod plot;
mod pressed;
pub mod specimen;
pub mod stretches;
pub mod wanted;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use clap::Args;
use elements::Law;
use serde_json::json;

use curve::{Response, Scaled};
use data::Sample;
use hold::Hold;
use pressed::Pressed;
use specimen::{Cylinder, Press, Specimen};
use wanted::Asked;

#[derive(Args)]
#[command(after_help = "Examples:
  upt fit kidney.csv --law ogden:2 --plot kidney.svg
  upt fit liver.csv --law yeoh:3
  upt fit skin.csv --law veronda-westmann
  upt fit brain.csv --law ogden:1 --sample cortex
  upt fit brain.csv --law ogden:1 --exponents -18 --sample cortex --json
  upt fit phantom.csv --law mooney-rivlin --specimen cylinder:25,30
  upt fit liver.csv --law ogden:1 --specimen cylinder:20,15 --press ball:3 --plot liver.svg
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
    /// Body that was tested, where it is not deformed alike everywhere: cylinder:RADIUS,HEIGHT (mm), pressed along its axis. The columns are displacement_mm (from where the press first touched) and force_n or force_mn, both 0 or more. Fitted by equilibria of a mesh, at Poisson's ratio 0.49.
    #[arg(long, value_name = "SHAPE", conflicts_with = "relaxation")]
    specimen: Option<Cylinder>,
    /// What presses the specimen: plate (both plates hold the ends, without slip) or ball:RADIUS (mm; no friction, the bottom is held).
    #[arg(long, default_value = "plate", requires = "specimen")]
    press: Press,
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

/// `--specimen`.
fn run_press(options: &Options, cylinder: Cylinder) -> Result<ExitCode> {
    let specimen = Specimen {
        cylinder,
        press: options.press,
    };
    let test = Pressed::read(&options.data, specimen, options.sample.as_deref())?;
    let found = (options.law.fit(&test, &options.exponents))
        .with_context(|| format!("{}: cannot be fitted", options.data.display()))?;
    let Scaled { law, shear_pa } = found.scaled;
    refuse(options, law)?;
    let written = as_option(law, shear_pa);
    let r2 = (test.r2(found.scaled)).context("the law that was found has no equilibrium")?;
    if let Some(path) = &options.plot {
        let line = |x: f64| test.force(found.scaled, x).unwrap_or(f64::NAN);
        std::fs::write(path, plot::draw_press(&test.points, line))
            .with_context(|| format!("{}: cannot be written", path.display()))?;
    }
    if options.json {
        let value = json!({"sample": test.name, "law": law, "law_option": written, "shear_modulus_pa": shear_pa, "poisson": POISSON, "r2": {"press": r2}, "mesh_error": test.mesh_error()});
        println!("{}", serde_json::to_string_pretty(&value)?);
        return Ok(ExitCode::SUCCESS);
    }
    println!("--law {written}");
    println!("shear modulus at rest {shear_pa:.1} Pa; Poisson's ratio {POISSON}");
    println!(
        "press        R² {r2:.3}  ({} points, displacement 0 to {} mm)",
        test.points.len(),
        test.most()
    );
    println!(
        "cylinder of radius {} mm and height {} mm under {}; the mesh alone is {:.1} % off, which is taken off; beyond these displacements the law extrapolates",
        cylinder.radius,
        cylinder.height,
        specimen.press,
        100.0 * test.mesh_error()
    );
    if let Some(path) = &options.plot {
        println!("plot: {}", path.display());
    }
    Ok(ExitCode::SUCCESS)
}

pub fn run(options: &Options) -> Result<ExitCode> {
    if let Some(branches) = options.relaxation {
        return run_hold(options, branches);
    }
    if let Some(cylinder) = options.specimen {
        return run_press(options, cylinder);
    }
    let sample = chosen(data::read(&options.data)?, options.sample.as_deref())?;
    let found = options.law.fit(&sample.curves[..], &options.exponents)?;
    match found.terms {
        Some(terms) => report(options, &sample, &terms, found.scaled),
        None => report(options, &sample, &found.scaled, found.scaled),
    }
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

/// What `upt simulate` would refuse is said here.
fn refuse(options: &Options, law: Law) -> Result<()> {
    match format!("{law}").parse::<Law>() {
        Ok(_) => Ok(()),
        Err(error) => bail!(
            "{}: the fitted law is not one that solvers take: {error}",
            options.data.display()
        ),
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
    refuse(options, law)?;
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
