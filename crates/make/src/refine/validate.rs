//! How far a bundle's corrected steps are from their equation of motion, at sites all over the domain, without a simulation.
//!
//! Each site is pushed at a steady rate through the bundle's own scene. The residual `f_int(u) + M (a + alpha v)` of the last
//! steps, with the rates that the scene integrates by (BDF2), goes through the factor of the stiffness at rest with the contact
//! held: a Newton step, whose length is the error to first order. The measure is the same for every coarse space.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use anyhow::Result;
use elements::ElementForces;
use tissue::mesh::tet_volume;
use upt::{Contact, Corrections, Error, Model, ModelOptions, Scene, SceneOptions, flag};

use crate::Watch;
use crate::corrections::{Constraint, Push, Workbench};

/// Steps of a push, and how many at the end are measured.
const STEPS: usize = 10;
const MEASURED: usize = 3;

/// Mean squared error of each push's last steps, mm²; 0 where the elements carry none of them, so that there is nothing to make better.
/// None where there is no time for all.
pub fn errors(
    bench: &Workbench,
    bundle: &Path,
    corrections: u32,
    pushes: &[Push],
    until: Instant,
    watch: &Watch,
) -> Result<Option<Vec<f64>>> {
    let options = ModelOptions {
        threads: 1,
        ..Default::default()
    };
    let model = Model::open(bundle, &options)?;
    let forces = bench.element_forces()?;
    let mut mass = vec![0.0f32; bench.mesh.node_count()];
    for (at, tet) in bench.mesh.tets.iter().enumerate() {
        let volume = tet_volume(&bench.mesh.positions, *tet);
        let density = (bench.mesh.laws()).density_of(at, bench.material.density_kg_m3);
        let share = (0.25e-6 * density * volume) as f32;
        tet.iter().for_each(|&node| mass[node as usize] += share);
    }
    let bar = watch.bar(pushes.len() as u64, "validation");
    let mut found = Vec::with_capacity(pushes.len());
    for push in pushes {
        if Instant::now() > until {
            return Ok(None);
        }
        found.push(error(bench, &model, corrections, &forces, &mass, push)?);
        bar.inc(1);
    }
    drop(bar);
    Ok(Some(found))
}

fn error(
    bench: &Workbench,
    model: &Arc<Model>,
    corrections: u32,
    forces: &ElementForces,
    mass: &[f32],
    push: &Push,
) -> Result<f64> {
    let options = SceneOptions {
        corrections: match corrections {
            0 => Corrections::None,
            count => Corrections::Fixed(count),
        },
        threads: 1,
        ..SceneOptions::default()
    };
    let scene = Scene::new(Arc::clone(model), &options)?;
    let serial = |count: usize, task: &(dyn Fn(usize, usize) + Sync)| {
        (0..count).for_each(|chunk| task(chunk, 0));
    };
    let mut constraint = Constraint::new(bench, &push.nodes)?;
    let mut scratch = forces.scratch(1)?;
    let wide = 3 * bench.mesh.node_count();
    let zero = || vec![0.0f32; wide];
    let (mut before, mut moved, mut velocities) = (zero(), zero(), [zero(), zero()]);
    let (mut field, mut gradient) = (zero(), zero());
    let h = model.manifest.dt_s as f32;
    let damping = bench.material.damping_per_s as f32;
    let (mut sum, mut carried) = (0.0, 0usize);
    for step in 1..=STEPS {
        let part = step as f32 / STEPS as f32;
        let vectors: Vec<f32> = push.vectors.iter().map(|v| part * v).collect();
        match scene.step(
            Contact::Sparse {
                nodes: &push.nodes,
                vectors: &vectors,
            },
            Some(&mut field),
        ) {
            Ok(()) | Err(Error::Guard(_)) => {}
            Err(error) => return Err(error.into()),
        }
        forces.evaluate(&field, &mut scratch, &mut gradient, &serial);
        let [last, older] = &mut velocities;
        for i in 0..wide {
            let change = field[i] - before[i];
            let v = (3.0 * change - moved[i]) / (2.0 * h);
            let a = (3.0 * (v - last[i]) - (last[i] - older[i])) / (2.0 * h);
            gradient[i] += mass[i / 3] * (a + damping * v);
            (moved[i], before[i]) = (change, field[i]);
            (older[i], last[i]) = (last[i], v);
        }
        // Where corrections were given up, the state is not near an equilibrium, and no Newton step says how far.
        let given_up = scene.stats().flags & flag::FELL_BACK != 0;
        if step > STEPS - MEASURED && !given_up {
            let newton = constraint.newton(bench, &gradient);
            let squares: f64 = newton.iter().map(|x| f64::from(*x).powi(2)).sum();
            sum += squares / bench.mesh.node_count() as f64;
            carried += 1;
        }
    }
    Ok(sum / carried.max(1) as f64)
}
