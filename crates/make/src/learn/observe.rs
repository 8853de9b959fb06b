//! Reference simulations at chosen sites, as what is learned from: what the tissue does beyond the linear response in contact, and how it
//! moves after each release, both in block coordinates.

use std::time::Instant;

use anyhow::Result;
use tissue::contact::ContactDomain;
use tissue::mesh::Mesh;
use tissue::schemes::{FRAME_S, FRAMES, Programme, Scheme};
use tissue::solver::{ContactNode, Solver, SolverOptions};

use crate::Watch;
use crate::corrections::{Beyond, Workbench};
use crate::parallel::{in_parallel, workers};

/// Push of the programmes as they are written, mm.
const PROGRAMME_PUSH_MM: f64 = 15.0;
/// Of the frames in contact one in so many is kept.
const EVERY: usize = 4;
/// Frames of a release: two in contact, and those after them.
pub const RELEASE_FRAMES: usize = 10;

/// What simulations showed.
#[derive(Default)]
pub struct Observed {
    /// What the law adds to the linear response in contact, `[Q]` each.
    pub contact: Vec<Vec<f32>>,
    /// Frames of each release, `[RELEASE_FRAMES][Q]`.
    pub releases: Vec<Vec<Vec<f32>>>,
    /// Simulations that ended at a load that the mesh cannot carry.
    pub ended: usize,
}

/// Simulates a `probe` programme for each list of sites (rows of the domain), as long as there is time.
pub fn observe(
    bench: &Workbench,
    push_mm: f64,
    sites: &[Vec<usize>],
    seed: u64,
    until: Instant,
    threads: usize,
    watch: &Watch,
) -> Result<Observed> {
    let bar = watch.bar((sites.len() * FRAMES) as u64, "tool trajectories");
    let work = |at: usize| {
        let seed = seed.wrapping_add(at as u64);
        simulate(bench, push_mm, &sites[at], seed, until, &|| bar.inc(1))
    };
    let more = |at: usize| at < sites.len() && Instant::now() < until;
    let found = in_parallel(workers(threads), &more, &work)?;
    drop(bar);
    let mut all = Observed::default();
    for case in found {
        all.contact.extend(case.contact);
        all.releases.extend(case.releases);
        all.ended += case.ended;
    }
    Ok(all)
}

fn simulate(
    bench: &Workbench,
    push_mm: f64,
    faces: &[usize],
    seed: u64,
    until: Instant,
    done: &dyn Fn(),
) -> Result<Observed> {
    let mesh: &Mesh = &bench.mesh;
    // Programmes are written for a brain.
    let scale = push_mm / PROGRAMME_PUSH_MM;
    let mut enlarged = mesh.clone();
    for x in enlarged.positions.iter_mut().flatten() {
        *x = (f64::from(*x) / scale) as f32;
    }
    let domain = ContactDomain::new(&enlarged, bench.boundary)?;
    let programme = Programme::at(Scheme::Probe, &domain, seed, faces)?;
    let mut solver = Solver::new(
        mesh,
        bench.boundary,
        SolverOptions {
            material: bench.material,
            ..SolverOptions::default()
        },
    )?;
    let mut beyond = Beyond::new(bench)?;
    let mut truth = vec![[0.0f32; 3]; mesh.node_count()];
    let mut frames: Vec<(bool, Vec<f32>)> = Vec::with_capacity(FRAMES);
    let mut observed = Observed::default();
    for frame in 1..FRAMES {
        if Instant::now() > until {
            break;
        }
        let mut contact: Vec<ContactNode> = programme.contact(frame);
        for entry in &mut contact {
            entry.displacement = entry.displacement.map(|x| (f64::from(x) * scale) as f32);
        }
        match solver.step_frame(&contact, FRAME_S) {
            Ok(_) => {}
            // What came before is sound.
            Err(error) if error.is_load() => {
                observed.ended = 1;
                break;
            }
            Err(error) => return Err(error.into()),
        }
        solver.displacement(&mut truth);
        let mut q = vec![0.0; bench.prior.width()];
        bench.prior.project(truth.as_flattened(), &mut q);
        if !contact.is_empty() && frame % EVERY == 0 {
            let nodes: Vec<u32> = contact.iter().map(|entry| entry.node).collect();
            let vectors: Vec<[f32; 3]> = contact.iter().map(|entry| entry.displacement).collect();
            observed
                .contact
                .push(beyond.linear(&nodes, &vectors, q.clone())?);
        }
        frames.push((!contact.is_empty(), q));
        done();
    }
    for window in frames.windows(RELEASE_FRAMES) {
        let (touched, free) = window.split_at(2);
        if touched.iter().all(|(contact, _)| *contact) && free.iter().all(|(contact, _)| !contact) {
            let fields = window.iter().map(|(_, q)| q.clone());
            observed.releases.push(fields.collect());
        }
    }
    Ok(observed)
}
