//! The response of `onnx/brain` without what its contact nodes do not reach, against the whole table: what a step reads of it, and how long
//! that takes, in turns on one thread.

use std::path::Path;

use half::f16;
use upt::kernels::project::row_dots;
use upt::kernels::random::Random;
use upt::kernels::respond::accumulate_rows;
use upt::kernels::rows::Stored;
use upt::kernels::{Isa, Pool};
use upt::{Model, ModelOptions};

use super::measure::{Row, medians, relative_error};

pub fn against_whole() -> upt::Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("onnx/brain");
    let model = Model::open(&folder, &ModelOptions::default())?;
    let Some(prior) = model.prior.as_deref() else {
        return Ok(());
    };
    let (response, width) = (&prior.response, prior.width());
    let (isa, pool) = (Isa::detect(), Pool::new(1)?);
    let mut whole = Vec::new();
    let mut q = vec![0.0; width];
    for row in 0..3 * prior.contact_nodes.len() as u32 {
        response.accumulate(isa, &pool, (&[row], &[1.0]), false, &mut q)?;
        whole.extend(q.iter().map(|&x| f16::from_f32(x)));
    }
    let whole = Stored::F16(&whole);
    for nodes in [20, 60] {
        let rows = nearest(&model, &prior.contact_nodes, nodes);
        let factors = Random::new(7).normal(rows.len(), 1.0);
        let (mut sums, mut wide) = (q.clone(), q.clone());
        let (mut dots, mut whole_dots) = (vec![0.0; rows.len()], vec![0.0; rows.len()]);
        let seconds = medians(&mut [
            Box::new(|| {
                let loads = (rows.as_slice(), factors.as_slice());
                let made = response.accumulate(isa, &pool, loads, false, &mut sums);
                made.expect("valid shapes");
            }),
            Box::new(|| {
                let made = accumulate_rows(isa, &pool, whole, &rows, &factors, false, &mut wide);
                made.expect("valid shapes");
            }),
            Box::new(|| {
                let made = response.dots(isa, &pool, &rows, &q, &mut dots);
                made.expect("valid shapes");
            }),
            Box::new(|| {
                let made = row_dots(isa, &pool, whole, &rows, &q, &mut whole_dots);
                made.expect("valid shapes");
            }),
        ]);
        let read = response.bytes(&rows, width);
        let name = |what: &str| format!("leading/{what} of {nodes} nodes, {}", isa.name());
        Row::new(name("bytes read"), read as f64 / 1e3, "kB")
            .against("whole table", (2 * rows.len() * width) as f64 / read as f64)
            .print();
        for (what, at, error) in [
            ("response", 0, relative_error(&sums, &wide)),
            ("work", 2, relative_error(&dots, &whole_dots)),
        ] {
            Row::new(name(what), 1e6 * seconds[at], "us")
                .against("whole table", seconds[at + 1] / seconds[at])
                .error(error)
                .print();
        }
    }
    Ok(())
}

/// Rows of the contact nodes nearest the first.
fn nearest(model: &Model, contact_nodes: &[u32], count: usize) -> Vec<u32> {
    let positions = model.positions();
    let at = |node: u32| &positions[3 * node as usize..][..3];
    let first = at(contact_nodes[0]);
    let distance = |column: &u32| -> f32 {
        let own = at(contact_nodes[*column as usize]);
        own.iter().zip(first).map(|(a, b)| (a - b).powi(2)).sum()
    };
    let mut columns: Vec<u32> = (0..contact_nodes.len() as u32).collect();
    columns.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    let mut near: Vec<u32> = columns.into_iter().take(count).collect();
    near.sort_unstable();
    near.into_iter().flat_map(|at| 3 * at..3 * at + 3).collect()
}
