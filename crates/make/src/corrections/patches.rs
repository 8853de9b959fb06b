//! What nonlinear elasticity adds to the linear response, without a simulation: pushes all over the domain, each taken a few
//! quasi-Newton steps towards equilibrium with the factor of the stiffness at rest.

use std::time::Instant;

use anyhow::Result;
use elements::ElementForces;
use tissue::schemes::SplitMix;
use upt::kernels::{Isa, Pool};
use upt::prior::ContactResponse;

use super::constraint::Constraint;
use super::pushes::Push;
use super::workbench::Workbench;
use crate::Watch;

/// Steps towards the equilibrium of each push.
const STEPS: usize = 5;

/// Pushes that are made whatever the time.
const LEAST: usize = 12;

/// What each of `count` pushes adds, in block coordinates; of fewer where there is no time.
pub fn differences(
    source: &Workbench,
    count: usize,
    until: Option<Instant>,
    seed: u64,
    watch: &Watch,
) -> Result<Vec<Vec<f32>>> {
    let mut random = SplitMix(seed);
    let forces = source.element_forces()?;
    let mut response = ContactResponse::new(&source.prior)?;
    let pool = Pool::new(1)?;
    let bar = watch.bar(count as u64, "patches");
    let mut found = Vec::with_capacity(count);
    let pushes = source.pushes();
    for (made, site) in pushes
        .spread(count, &[], &mut random)
        .into_iter()
        .enumerate()
    {
        if made >= LEAST && until.is_some_and(|until| Instant::now() > until) {
            break;
        }
        let push = pushes.at(site, &mut random);
        if let Some(difference) = relax(source, &forces, &mut response, &pool, &push)? {
            found.push(difference);
        }
        bar.inc(1);
    }
    drop(bar);
    Ok(found)
}

/// What the steps add to the linear response, in block coordinates; none where the response inverts an element.
fn relax(
    source: &Workbench,
    forces: &ElementForces,
    response: &mut ContactResponse,
    pool: &Pool,
    push: &Push,
) -> Result<Option<Vec<f32>>> {
    let isa = Isa::detect();
    let nodes = source.mesh.node_count();
    let mut q = vec![0.0; source.prior.width()];
    let serial = |count: usize, task: &(dyn Fn(usize, usize) + Sync)| {
        (0..count).for_each(|chunk| task(chunk, 0));
    };
    let mut scratch = forces.scratch(1)?;
    let mut gradient = vec![0.0f32; 3 * nodes];
    // A push whose linear response is inverted is halved until it is not.
    let mut part = 1.0f32;
    let linear = loop {
        let vectors: Vec<f32> = push.vectors.iter().map(|v| part * v).collect();
        response.solve(
            isa,
            &source.prior,
            &source.held_flags,
            &push.nodes,
            &vectors,
        )?;
        response.field(isa, pool, &source.prior, &mut q)?;
        let mut u = decode(source, &q);
        impose(&mut u, push, part);
        if forces.evaluate(&u, &mut scratch, &mut gradient, &serial) > 0.2 {
            break u;
        }
        part *= 0.5;
        if part < 0.1 {
            return Ok(None);
        }
    };
    let mut constraint = Constraint::new(source, &push.nodes)?;
    let mut u = linear.clone();
    for _ in 0..STEPS {
        let det = forces.evaluate(&u, &mut scratch, &mut gradient, &serial);
        let step = constraint.newton(source, &gradient);
        let mut t = 1.0f32;
        let before = norm(source, push, &gradient);
        let mut accepted = false;
        for _ in 0..6 {
            let trial: Vec<f32> = u.iter().zip(&step).map(|(u, d)| u + t * d).collect();
            let det_new = forces.evaluate(&trial, &mut scratch, &mut gradient, &serial);
            if det_new > 0.5 * det.min(0.5) && norm(source, push, &gradient) < 2.0 * before {
                u = trial;
                accepted = true;
                break;
            }
            t *= 0.5;
        }
        if !accepted {
            break;
        }
    }
    let difference: Vec<f32> = u.iter().zip(&linear).map(|(u, l)| u - l).collect();
    let mut q = vec![0.0; source.prior.width()];
    source.prior.project(&difference, &mut q);
    Ok(Some(q))
}

fn decode(source: &Workbench, q: &[f32]) -> Vec<f32> {
    let mut u: Vec<f32> = (0..source.mesh.node_count() as u32)
        .flat_map(|node| [0, 1, 2].map(|axis| source.prior.value_at(node, axis, |at| q[at])))
        .collect();
    for &node in &source.held {
        u[3 * node as usize..3 * node as usize + 3].fill(0.0);
    }
    u
}

fn impose(u: &mut [f32], push: &Push, part: f32) {
    for (&node, vector) in push.nodes.iter().zip(push.vectors.as_chunks::<3>().0) {
        let at = 3 * node as usize;
        u[at..at + 3].copy_from_slice(&vector.map(|v| part * v));
    }
}

/// Residual force of the nodes that are free.
fn norm(source: &Workbench, push: &Push, gradient: &[f32]) -> f64 {
    let all: f64 = source
        .stiffness
        .free
        .nodes
        .iter()
        .flat_map(|&node| &gradient[3 * node as usize..3 * node as usize + 3])
        .map(|f| f64::from(*f).powi(2))
        .sum();
    let pushed: f64 = push
        .nodes
        .iter()
        .flat_map(|&node| &gradient[3 * node as usize..3 * node as usize + 3])
        .map(|f| f64::from(*f).powi(2))
        .sum();
    (all - pushed).max(0.0)
}
