//! Bad inputs change nothing, noisy ones stay bounded; regions, thread counts and resets give the same bits.

use std::sync::Arc;

use anyhow::Result;
use upt::{Contact, Error, Scene, SceneOptions, StepInput};

use super::Row;
use crate::bench::{Bench, Run, largest, push, ramp};

pub(super) fn bad_inputs(bench: &Bench) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    let patch = bench.central()?;
    let k = 3 * bench.mesh.node_count();
    for (name, value) in [
        ("NaN", f32::NAN),
        ("infinity", f32::INFINITY),
        ("1e30", 1e30),
    ] {
        let scene = bench.scene()?;
        bench.run(&scene, 20, |s| push(&patch, patch.inward, ramp(s, 5.0)));
        let (mut before, mut after) = (vec![0.0; k], vec![0.0; k]);
        scene.read(&mut before)?;
        let (nodes, mut vectors) = push(&patch, patch.inward, 5.0);
        vectors[1] = value;
        let in_contact = scene.step(
            StepInput::from(Contact::Sparse {
                nodes: &nodes,
                vectors: &vectors,
            }),
            None,
        );
        let mut dense = vec![0.0; k];
        dense[4] = value;
        let in_field = scene.step(
            StepInput {
                displacement: Some(&dense),
                ..StepInput::default()
            },
            None,
        );
        scene.read(&mut after)?;
        let told = |r: &upt::Result<()>| {
            r.as_ref()
                .err()
                .map_or("accepted".to_string(), ToString::to_string)
        };
        let good = in_contact.is_err() && in_field.is_err() && before == after;
        let text = format!(
            "contact: {}; displacement: {}; state unchanged: {}",
            told(&in_contact),
            told(&in_field),
            before == after
        );
        rows.push(Row::new(
            &bench.subject,
            &format!("{name} in each input"),
            text,
            good,
        ));
    }
    let scene = bench.scene()?;
    let run = bench.run(&scene, 20, |_| {
        let (nodes, mut vectors) = push(&patch, patch.inward, 1.0);
        vectors.iter_mut().for_each(|v| *v *= 1e-41);
        (nodes, vectors)
    });
    rows.push(bench.row("denormals as contact", &run, run.sound(0.1)));

    // The host's own state: with noise of 0.1 mm, and 20 mm off.
    for (name, amplitude, offset) in [
        ("noise of 0.1 mm on the displacement input", 0.1, 0.0),
        ("displacement input off by 20 mm", 0.0, 20.0),
    ] {
        let scene = bench.scene()?;
        let mut field = vec![0.0f32; k];
        let mut run = Run {
            finite: true,
            ..Run::default()
        };
        let mut state = 1u64;
        for step in 1..=100 {
            let mut given = field.clone();
            for u in &mut given {
                state = state
                    .wrapping_mul(6364136223846793005)
                    .wrapping_add(1442695040888963407);
                *u += amplitude * ((state >> 40) as f32 / (1u64 << 23) as f32 - 1.0);
            }
            if offset != 0.0 && step == 30 {
                given.iter_mut().step_by(3).for_each(|u| *u += offset);
            }
            let (nodes, vectors) = push(
                &patch,
                patch.inward,
                ramp(step, 0.6 * f64::from(bench.max_push)),
            );
            let contact = Contact::Sparse {
                nodes: &nodes,
                vectors: &vectors,
            };
            match scene.step(
                StepInput {
                    displacement: Some(&given),
                    contact,
                    ..StepInput::default()
                },
                Some(&mut field),
            ) {
                Ok(()) => {
                    run.largest = run.largest.max(largest(&field));
                    run.finite &= largest(&field).is_finite();
                    run.flags |= scene.stats().flags;
                }
                Err(Error::Guard(_)) => run.refused += 1,
                Err(error) => run.other = Some(error.to_string()),
            }
        }
        let end = largest(&field);
        let row = bench.row(
            name,
            &run,
            run.sound(bench.bound.max(60.0)) && end < 2.0 * bench.max_push,
        );
        rows.push(Row {
            happened: format!("{}, {end:.2} mm at the end", row.happened),
            ..row
        });
    }
    Ok(rows)
}

/// Regions that change each step, thread counts, reset: the same bits.
pub(super) fn same_bits(bench: &Bench) -> Result<Vec<Row>> {
    let patch = bench.central()?;
    let k = 3 * bench.mesh.node_count();
    let depth = 0.7 * f64::from(bench.max_push);
    let mut fields = Vec::new();
    for threads in [1, 2, 4] {
        let scene = Scene::new(
            Arc::clone(&bench.model),
            &SceneOptions {
                threads,
                ..Default::default()
            },
        )?;
        bench.run(&scene, 30, |s| push(&patch, patch.inward, ramp(s, depth)));
        let mut field = vec![0.0f32; k];
        scene.read(&mut field)?;
        fields.push(field);
    }
    let equal = fields.iter().all(|f| f == &fields[0]);
    let mut rows = vec![Row::new(
        &bench.subject,
        "1, 2 and 4 threads",
        format!("the same bits: {equal}"),
        equal,
    )];

    let scene = bench.scene()?;
    for step in 1..=30 {
        let nodes: Vec<u32> = (0..bench.mesh.node_count() as u32)
            .filter(|n| n % 7 == step % 7)
            .collect();
        scene.set_region(if step % 3 == 0 { None } else { Some(&nodes) })?;
        let (nodes, vectors) = push(&patch, patch.inward, ramp(step as usize, depth));
        scene.step(
            StepInput::from(Contact::Sparse {
                nodes: &nodes,
                vectors: &vectors,
            }),
            None,
        )?;
    }
    scene.set_region(None)?;
    let mut field = vec![0.0f32; k];
    scene.read(&mut field)?;
    let equal = field == fields[0];
    rows.push(Row::new(
        &bench.subject,
        "another region each step",
        format!("the same bits as all nodes: {equal}"),
        equal,
    ));

    scene.reset()?;
    bench.run(&scene, 30, |s| push(&patch, patch.inward, ramp(s, depth)));
    scene.read(&mut field)?;
    let equal = field == fields[0];
    rows.push(Row::new(
        &bench.subject,
        "reset, then again",
        format!("the same bits as a fresh scene: {equal}"),
        equal,
    ));
    Ok(rows)
}
