//! What nonlinear elasticity adds to the linear response at rest under pushes: exact equilibria, by the reference's statics.

use std::path::Path;
use std::time::Instant;

use anyhow::Result;
use tissue::solver::ContactNode;
use tissue::statics::StaticSolver;

use crate::Watch;
use crate::corrections::{Beyond, Push, Workbench};
use crate::parallel::{in_parallel, workers};

/// Pushes that share each solve.
const TOGETHER: usize = 4;

/// The differences of the pushes whose equilibrium was found in time, in block coordinates.
pub fn differences(
    bench: &Workbench,
    columns: &Path,
    pushes: &[Push],
    until: Instant,
    threads: usize,
    watch: &Watch,
) -> Result<Vec<Vec<f32>>> {
    let solver = StaticSolver::new(&bench.mesh, bench.boundary, bench.stepped, columns)?;
    let bar = watch.bar(pushes.len() as u64, "equilibria");
    let groups: Vec<&[Push]> = pushes.chunks(TOGETHER).collect();
    let work = |at: usize| {
        let contacts: Vec<Vec<ContactNode>> = groups[at].iter().map(contact).collect();
        let fields = solver.at_rest(&contacts)?;
        let mut differences = Vec::new();
        for (push, field) in groups[at].iter().zip(fields) {
            if let Some(field) = field {
                differences.push(difference(bench, push, &field)?);
            }
        }
        bar.inc(groups[at].len() as u64);
        Ok(differences)
    };
    let more = |at: usize| at < groups.len() && Instant::now() < until;
    let found = in_parallel(workers(threads), &more, &work)?;
    drop(bar);
    Ok(found.into_iter().flatten().collect())
}

fn contact(push: &Push) -> Vec<ContactNode> {
    let vectors = push.vectors.as_chunks::<3>().0;
    let pairs = push.nodes.iter().zip(vectors);
    pairs
        .map(|(&node, &displacement)| ContactNode { node, displacement })
        .collect()
}

fn difference(bench: &Workbench, push: &Push, field: &[f64]) -> Result<Vec<f32>> {
    let single: Vec<f32> = field.iter().map(|&value| value as f32).collect();
    let mut q = vec![0.0; bench.prior.width()];
    bench.prior.project(&single, &mut q);
    Beyond::new(bench)?.linear(&push.nodes, push.vectors.as_chunks::<3>().0, q)
}
