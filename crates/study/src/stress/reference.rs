//! Stiff and extreme cases for the reference solver. Expected of each: a finite answer (by substeps where the asked
//! step is too long), or a typed error; never NaN in the caller's hands.

mod jump;
mod press;

use std::path::Path;

use anyhow::Result;
use tissue::contact::ContactDomain;
use tissue::material::Material;
use tissue::mesh::{Boundary, Mesh, ellipsoid_phantom};
use tissue::solver::{Solver, SolverError, SolverOptions, Substep};

use upt_cli::progress;

use super::Row;
use press::relative;
use press::{Body, Press, SUBJECT};

/// All reference cases on `mesh`, or on a phantom.
pub fn rows(mesh: Option<&Path>, quick: bool) -> Result<Vec<Row>> {
    let mesh = match mesh {
        Some(path) => Mesh::read(path)?,
        None => ellipsoid_phantom([45.0, 55.0, 40.0], 8)?,
    };
    let domain = ContactDomain::new(&mesh, Boundary::Fixed)?;
    let seed = most_central(&domain);
    let body = Body { mesh, domain, seed };
    let base = SolverOptions::default();
    let with = |change: &dyn Fn(&mut Material)| {
        let mut options = base.clone();
        change(&mut options.material);
        options
    };
    let mut cases: Vec<(String, SolverOptions, Press, bool)> = Vec::new();
    for nu in [0.49, 0.495, 0.499, 0.4999] {
        let must_complete = nu <= 0.499;
        let options = with(&|m| m.poisson = nu);
        cases.push((
            format!("Poisson's ratio {nu}"),
            options,
            Press::default(),
            must_complete,
        ));
    }
    let factors: &[f64] = if quick {
        &[0.01, 1000.0]
    } else {
        &[0.01, 0.1, 10.0, 100.0, 1000.0]
    };
    for &factor in factors {
        let options = with(&|m| m.young_pa *= factor);
        cases.push((
            format!("Young's modulus x {factor}"),
            options,
            Press::default(),
            true,
        ));
    }
    for depth_mm in [15.0, 30.0, 40.0, 60.0] {
        let press = Press {
            depth_mm,
            ..Press::default()
        };
        cases.push((
            format!("push of {depth_mm} mm"),
            base.clone(),
            press,
            depth_mm <= 15.0,
        ));
    }
    let sudden = Press {
        ramp_frames: 1,
        ..Press::default()
    };
    cases.push(("10 mm in one frame".into(), base.clone(), sudden, true));
    let released = Press {
        free_frames: 60,
        ..Press::default()
    };
    cases.push((
        "abrupt release, 3 s free".into(),
        base.clone(),
        released,
        true,
    ));
    let ringing = with(&|m| m.damping_per_s = 0.0);
    cases.push((
        "damping 0, abrupt release, 3 s free".into(),
        ringing,
        released,
        true,
    ));
    let one_face = Press {
        area_mm2: 0.1,
        ..Press::default()
    };
    cases.push(("a patch of one face".into(), base.clone(), one_face, false));

    let bar = progress::cases(cases.len() + 6, SUBJECT);
    let mut rows = Vec::new();
    for (name, options, press, must_complete) in cases {
        let outcome = body.press(options, press)?;
        let good = outcome.safe() && (outcome.complete() || !must_complete);
        rows.push(Row::new(SUBJECT, &name, outcome.text(), good));
        bar.inc(1);
    }
    rows.push(large_patch(&body, &base));
    bar.inc(1);
    rows.extend(time_steps(&body, &base)?);
    bar.inc(2);
    rows.extend(bad_elements(&body, &base)?);
    bar.inc(1);
    rows.push(jump::row(&body, &base)?);
    bar.inc(1);
    bar.finish_and_clear();
    Ok(rows)
}

/// The domain face nearest to the middle of the domain.
fn most_central(domain: &ContactDomain) -> usize {
    let centroids = domain.centroids();
    let n = centroids.len().max(1) as f64;
    let middle = [0, 1, 2].map(|k| centroids.iter().map(|c| c[k]).sum::<f64>() / n);
    let distance = |c: &[f64; 3]| (0..3).map(|k| (c[k] - middle[k]).powi(2)).sum::<f64>();
    (0..centroids.len())
        .min_by(|&a, &b| distance(&centroids[a]).total_cmp(&distance(&centroids[b])))
        .unwrap_or(0)
}

/// 500 of the paper's faces, or the largest patch that the domain holds.
fn large_patch(body: &Body, base: &SolverOptions) -> Row {
    let name = "a patch of 500 faces";
    let mut area = 500.0 * 2.706;
    let patch = loop {
        match body.domain.grow(body.seed, area) {
            Ok(patch) => break patch,
            Err(_) if area > 10.0 => area *= 0.8,
            Err(error) => return Row::new(SUBJECT, name, error.to_string(), false),
        }
    };
    let outcome = body.drive(base.clone(), &patch, Press::default());
    let text = format!(
        "{:.0} mm² of the domain: {}",
        patch.area_mm2,
        outcome.text()
    );
    Row::new(SUBJECT, name, text, outcome.complete())
}

/// Asked steps of 0.5 to 4 times the critical one: the automatic solver's answer stays that of the short step; told to
/// refuse, it refuses.
fn time_steps(body: &Body, base: &SolverOptions) -> Result<Vec<Row>> {
    let critical =
        Solver::new(&body.mesh, Boundary::Fixed, base.clone())?.critical_step_at_rest_s();
    let at = |factor: f64, substep: Substep| SolverOptions {
        inner_step_s: factor * critical,
        substep,
        ..base.clone()
    };
    let press = Press::default();
    let exact = body.press(at(0.25, Substep::Automatic), press)?;
    let mut rows = Vec::new();
    for factor in [0.5, 1.0, 2.0, 4.0] {
        let outcome = body.press(at(factor, Substep::Automatic), press)?;
        let error = relative(&exact.field, &outcome.field);
        rows.push(Row::new(
            SUBJECT,
            &format!("inner step {factor} x critical, substeps allowed"),
            format!(
                "{}; differs by {:.1e} from a quarter of the critical step",
                outcome.text(),
                error
            ),
            outcome.complete() && error < 0.02,
        ));
    }
    let refused = body.press(at(2.0, Substep::Refuse), press)?;
    rows.push(Row::new(
        SUBJECT,
        "inner step 2 x critical, told to refuse",
        refused.text(),
        matches!(refused.error, Some(SolverError::StepTooLong { .. })),
    ));
    Ok(rows)
}

/// A sliver is run with shorter steps or refused; an inverted element is refused by name.
fn bad_elements(body: &Body, base: &SolverOptions) -> Result<Vec<Row>> {
    let mut flat = body.mesh.clone();
    let [a, b, c, d] = flat.tets[0].map(|n| n as usize);
    // The fourth corner goes to a hundredth of its height above the others' centroid.
    let centre = [0, 1, 2]
        .map(|k| (flat.positions[a][k] + flat.positions[b][k] + flat.positions[c][k]) / 3.0);
    for (k, middle) in centre.iter().enumerate() {
        flat.positions[d][k] = middle + 0.01 * (flat.positions[d][k] - middle);
    }
    let mut rows = Vec::new();
    let name = "a sliver element";
    if flat.validate().is_ok() {
        let domain = ContactDomain::new(&flat, Boundary::Fixed)?;
        let sliver = Body {
            seed: most_central(&domain),
            domain,
            mesh: flat,
        };
        let outcome = sliver.press(
            base.clone(),
            Press {
                ramp_frames: 4,
                hold_frames: 0,
                ..Press::default()
            },
        )?;
        rows.push(Row::new(SUBJECT, name, outcome.text(), outcome.safe()));
    } else {
        let error = flat
            .validate()
            .err()
            .map_or_else(String::new, |e| e.to_string());
        rows.push(Row::new(
            SUBJECT,
            name,
            format!("refused: {error}"),
            error.contains("tet"),
        ));
    }
    let mut inverted = body.mesh.clone();
    inverted.tets[0].swap(0, 1);
    let error = Solver::new(&inverted, Boundary::Fixed, base.clone()).err();
    let text = error
        .as_ref()
        .map_or("accepted".into(), |e| format!("refused: {e}"));
    rows.push(Row::new(
        SUBJECT,
        "an inverted element",
        text,
        error.is_some(),
    ));
    Ok(rows)
}
