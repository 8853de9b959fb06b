//! The parts of a correction, each alone, compared with its floor: its bytes over the bandwidth of a copy, or its FLOP over the rate of a matrix
//! product, whichever is longer. Tables that stay in cache may beat the bandwidth's floor.

use upt::kernels::project::{project_field, row_dots};
use upt::kernels::respond::accumulate_rows;
use upt::kernels::rows::{RowPlan, decode_rows};
use upt::kernels::vectors::{PartialSums, add_scaled, dots};
use upt::kernels::{Isa, Pool};
use upt::{Error, Model};

use super::measure::{Row, machine, medians};

/// Pairs of the L-BFGS memory.
const PAIRS: usize = 8;
/// Products and sums of an element, about.
const FLOPS_AN_ELEMENT: f64 = 200.0;

/// Rows of every part.
pub fn rows(model: &Model, name: &str) -> upt::Result<()> {
    let isa = Isa::detect();
    let rate = 1e6 * machine::gemm_rate(isa);
    for threads in [1, 2] {
        let copy = 1e6 * machine::copy_rate(threads);
        let pool = Pool::new(threads).map_err(|error| Error::Panic(error.to_string()))?;
        let _awake = pool.keep_awake();
        for (part, flops, bytes, ms) in measured(model, isa, &pool)? {
            let (compute, memory) = (flops / (rate * threads as f64), bytes / copy);
            let (floor, what) = match compute > memory {
                true => (compute, "FLOP"),
                false => (memory, "bytes"),
            };
            println!(
                "{part}, {threads} threads: {:.1} MFLOP {compute:.3} ms, {:.1} MB {memory:.3} ms, took {ms:.3} ms",
                1e-6 * flops,
                1e-6 * bytes
            );
            Row::new(format!("{name}/{part}/{threads} threads"), ms, "ms")
                .against(format!("its floor by {what}, {floor:.3} ms"), ms / floor)
                .print();
        }
    }
    Ok(())
}

type Part = (&'static str, f64, f64, f64);

fn measured(model: &Model, isa: Isa, pool: &Pool) -> upt::Result<Vec<Part>> {
    let corrections = model.corrections()?;
    let Some(prior) = &model.prior else {
        return Ok(Vec::new());
    };
    let len = 3 * model.mesh.node_count();
    let field_bytes = 4.0 * len as f64;
    let wave = |seed: usize| -> Vec<f32> {
        (0..len)
            .map(|i| 0.1 * ((i * (seed + 1)) as f32 * 0.01).sin())
            .collect()
    };
    let (u, mut out) = (wave(0), wave(1));
    let (space, forces) = (&corrections.space, &corrections.body.forces);
    let mut scratch = (forces.scratch(pool.threads()))
        .map_err(|_| Error::OutOfMemory("no memory for the element forces".into()))?;
    let (basis, starts) = (prior.basis(), prior.basis_starts().unwrap());
    let plan = RowPlan::full(&basis);
    let (width, count) = (prior.width(), space.count());
    let (mut q, mut on_modes) = (vec![0.5f32; width], vec![0.5f32; count]);
    let mut decoded = vec![0.0f32; len];
    let vectors: Vec<Vec<f32>> = (0..2 * PAIRS).map(wave).collect();
    let views: Vec<&[f32]> = vectors.iter().map(Vec::as_slice).collect();
    let (mut partial, mut sums) = (PartialSums::default(), [0.0f64; PAIRS]);
    let factors = [0.1f32; PAIRS];
    let mut sum = wave(3);
    let once = |run: &mut dyn FnMut()| 1e3 * medians(&mut [Box::new(run)])[0];
    let times = [
        once(&mut || {
            forces.evaluate(&u, &mut scratch, &mut out, &|count, task| {
                pool.run(count, task).expect("threads");
            });
        }),
        once(&mut || project_field(isa, pool, &basis, &starts, &u, &mut q).expect("threads")),
        once(&mut || decode_rows(isa, pool, &basis, &plan, &q, &mut decoded).expect("threads")),
        once(&mut || {
            row_dots(isa, pool, space.modes(), space.rows(), &q, &mut on_modes).expect("threads");
            let modes = (space.modes(), space.rows());
            accumulate_rows(isa, pool, modes.0, modes.1, &on_modes, false, &mut q)
                .expect("threads");
        }),
        once(&mut || {
            let (s, y) = views.split_at(PAIRS);
            dots(isa, pool, s, &u, &mut partial, &mut sums).expect("threads");
            add_scaled(isa, pool, y, &factors, &mut sum).expect("threads");
            dots(isa, pool, y, &u, &mut partial, &mut sums).expect("threads");
            add_scaled(isa, pool, s, &factors, &mut sum).expect("threads");
        }),
    ];
    let numbers = basis.basis.len() as f64;
    let number_bytes = match basis.basis {
        upt::kernels::rows::Stored::F32(_) => 4.0,
        upt::kernels::rows::Stored::F16(_) => 2.0,
    };
    let of_modes = (width * count) as f64;
    let of_pairs = (PAIRS * len) as f64;
    let elements = model.mesh.tets.len() as f64 / 4.0;
    let costs = [
        (
            "element forces",
            FLOPS_AN_ELEMENT * elements,
            forces.bytes() as f64 + 2.0 * field_bytes,
        ),
        (
            "basis, field to coordinates",
            2.0 * numbers,
            number_bytes * numbers + field_bytes,
        ),
        (
            "basis, coordinates to field",
            2.0 * numbers,
            number_bytes * numbers + field_bytes,
        ),
        ("modes, both ways", 4.0 * of_modes, 4.0 * of_modes),
        ("pairs, both recursions", 8.0 * of_pairs, 16.0 * of_pairs),
    ];
    let rows = costs.into_iter().zip(times);
    Ok(rows
        .map(|((part, flops, bytes), ms)| (part, flops, bytes, ms))
        .collect())
}
