//! Stiff and extreme cases for a bundle. Expected: flags when and only when the contact is outside of what the model was
//! trained on, bounded states or a refusal with the last good state kept, and recovery afterwards.

use std::path::Path;

use anyhow::Result;
use tissue::schemes::{Group, Programme, Scheme};

use upt_cli::progress;

use super::{Row, half, inputs, outside, storm, tools};
use crate::bench::{Bench, Run, Touch, largest, push, ramp};

/// All cases of the bundle at `path`.
pub fn rows(path: &Path, quick: bool) -> Result<Vec<Row>> {
    let bench = Bench::open(path, quick)?;
    let bar = progress::cases(8, &bench.subject);
    let mut rows = inside(&bench)?;
    bar.inc(1);
    rows.extend(long_runs(&bench)?);
    bar.inc(2);
    rows.extend(outside::rows(&bench)?);
    bar.inc(1);
    rows.extend(inputs::bad_inputs(&bench)?);
    rows.push(half::row(&bench, path)?);
    bar.inc(1);
    rows.extend(inputs::same_bits(&bench)?);
    bar.inc(1);
    rows.extend(storm::rows(&bench)?);
    bar.inc(1);
    rows.extend(tools::rows(&bench, path)?);
    bar.finish_and_clear();
    Ok(rows)
}

/// Those of some kinds of sudden tools alone; none named: all.
pub fn sudden_rows(path: &Path, quick: bool, kinds: &[tools::Sudden]) -> Result<Vec<Row>> {
    tools::sudden_rows(&Bench::open(path, quick)?, path, kinds)
}

/// No false alarm on the schemes that the model was trained on.
fn inside(bench: &Bench) -> Result<Vec<Row>> {
    let cases = if bench.quick { 1 } else { 4 };
    let mut worst = Run {
        finite: true,
        ..Run::default()
    };
    for scheme in Scheme::of(Group::Trained) {
        for case in 0..cases {
            let scene = bench.scene()?;
            let programme = Programme::new(scheme, &bench.domain, 9_000 + case)?;
            let run = bench.run(&scene, 160, |step| of_programme(&programme, step));
            worst.flags |= run.flags;
            worst.largest = worst.largest.max(run.largest);
            worst.refused += run.refused;
            worst.finite &= run.finite;
            worst.other = worst.other.or(run.other);
        }
    }
    let good = worst.sound(bench.bound) && worst.alarms() == 0 && worst.refused == 0;
    Ok(vec![bench.row(
        &format!("schemes 1 to 4, {} new cases: no alarm", 4 * cases),
        &worst,
        good,
    )])
}

fn of_programme(programme: &Programme, step: usize) -> Touch {
    let contact = programme.contact(step);
    (
        contact.iter().map(|c| c.node).collect(),
        contact.iter().flat_map(|c| c.displacement).collect(),
    )
}

fn long_runs(bench: &Bench) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    // Random cases of all schemes, one after another, without a reset.
    let steps = bench.steps(10_000);
    let scene = bench.scene()?;
    // Largest displacement over the largest imposed one: of the first quarter, and of all.
    let (mut first, mut worst) = (0.0f32, 0.0f32);
    let mut seed = 0;
    let mut programme = Programme::new(Scheme::One, &bench.domain, seed)?;
    let chunk = 160;
    let mut total = Run {
        finite: true,
        ..Run::default()
    };
    for start in (0..steps).step_by(chunk) {
        seed += 1;
        if let Ok(next) = Programme::new(
            Scheme::NUMBERED[seed as usize % 5],
            &bench.domain,
            40_000 + seed,
        ) {
            programme = next;
        }
        let mut imposed = 1.0f32;
        let run = bench.run(&scene, chunk.min(steps - start), |step| {
            let touch = of_programme(&programme, step);
            imposed = imposed.max(largest(&touch.1));
            touch
        });
        worst = worst.max(run.largest / imposed);
        if start < steps / 4 {
            first = worst;
        }
        total.flags |= run.flags;
        total.largest = total.largest.max(run.largest);
        total.refused += run.refused;
        total.finite &= run.finite;
        total.other = total.other.or(run.other);
    }
    let grown = worst > 1.5 * first;
    rows.push(bench.row(
        &format!("{steps} random steps of all schemes"),
        &total,
        total.sound(bench.bound) && !grown && total.alarms() == 0 && total.refused == 0,
    ));

    let patch = bench.central()?;
    let scene = bench.scene()?;
    let depth = 0.7 * f64::from(bench.max_push);
    let mut early = vec![0.0; 3 * bench.mesh.node_count()];
    let mut late = early.clone();
    let hold = bench.steps(12_000);
    let mut run = bench.run(&scene, 100, |step| {
        push(&patch, patch.inward, ramp(step, depth))
    });
    scene.read(&mut early)?;
    let more = bench.run(&scene, hold, |_| push(&patch, patch.inward, depth));
    scene.read(&mut late)?;
    run.largest = run.largest.max(more.largest);
    run.refused += more.refused;
    run.flags |= more.flags;
    let drift = early
        .iter()
        .zip(&late)
        .fold(0.0f32, |m, (a, b)| m.max((a - b).abs()));
    let row = bench.row(
        &format!("hold for {:.0} s", hold as f64 * 0.05),
        &run,
        run.sound(bench.bound) && run.alarms() == 0 && run.refused == 0 && drift < 0.5,
    );
    rows.push(Row {
        happened: format!("{}, drift {drift:.3} mm", row.happened),
        ..row
    });

    let mut run = Run {
        finite: true,
        ..Run::default()
    };
    let free = bench.run(&scene, 400, |_| (Vec::new(), Vec::new()));
    run.largest = free.largest;
    scene.read(&mut late)?;
    let rest = largest(&late);
    let good = free.sound(bench.bound) && rest == 0.0 && scene.stats().sleeping;
    let row = bench.row("abrupt release, then 20 s", &run, good);
    rows.push(Row {
        happened: format!(
            "{}, {rest:.4} mm left, asleep: {}",
            row.happened,
            scene.stats().sleeping
        ),
        ..row
    });
    Ok(rows)
}
