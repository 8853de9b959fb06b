//! What nonlinear elasticity adds to the linear response, without a simulation: pushes all over the domain, each taken a few
//! quasi-Newton steps towards equilibrium with the factor of the stiffness at rest, and the modes of what that added.

use anyhow::Result;
use elements::{ElementForces, Material, Simd};
use tissue::linear::{Factor, Stiffness};
use tissue::mesh::Mesh;
use upt::kernels::contact::ContactFactor;
use upt::kernels::{Isa, Pool};
use upt::prior::{ContactResponse, PriorTable};

use crate::progress;

/// Steps towards the equilibrium of each push.
const STEPS: usize = 5;
/// Depths of the pushes over the envelope's deepest.
const DEPTH: [f64; 2] = [0.4, 0.93];

/// What the pushes act on.
pub struct Source<'a> {
    pub mesh: &'a Mesh,
    pub prior: &'a PriorTable,
    pub stiffness: &'a Stiffness,
    pub factor: &'a Factor,
    pub material: Material,
    pub held: &'a [u32],
    /// Deepest push, mm, and area of a contact, mm², of the envelope.
    pub push_mm: f64,
    pub area_mm2: [f64; 2],
}

/// A push: nodes and where they go.
struct Push {
    nodes: Vec<u32>,
    vectors: Vec<f32>,
}

/// SplitMix64, uniform in [0, 1).
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn within(&mut self, [low, high]: [f64; 2]) -> f64 {
        low + (high - low) * self.unit()
    }
}

/// `count` modes in block coordinates, the largest first.
pub fn modes(
    source: &Source<'_>,
    patches: usize,
    count: usize,
    seed: u64,
    quiet: bool,
) -> Result<Vec<Vec<f32>>> {
    let mut random = Random(seed);
    let forces = ElementForces::new(source.mesh.tetrahedra(), &source.material, Simd::detect());
    let mut held = vec![false; source.mesh.node_count()];
    source
        .held
        .iter()
        .for_each(|&node| held[node as usize] = true);
    let mut response = ContactResponse::new(source.prior)?;
    let pool = Pool::new(1)?;
    let bar = progress::bar(quiet, patches as u64, "patches");
    let mut found = Vec::with_capacity(patches);
    for site in spread_sites(source, patches, &mut random) {
        let push = push(source, site, &held, &mut random);
        if let Some(difference) = relax(source, &forces, &mut response, &pool, &held, &push)? {
            found.push(difference);
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(principal(&found, count))
}

/// Sites far from each other: each the farthest of a few random ones from those before.
fn spread_sites(source: &Source<'_>, count: usize, random: &mut Random) -> Vec<u32> {
    let nodes = &source.prior.contact_nodes;
    let position = |node: u32| source.mesh.positions[node as usize].map(f64::from);
    let distance = |a: u32, b: u32| {
        let (a, b) = (position(a), position(b));
        (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>()
    };
    let mut sites: Vec<u32> = Vec::with_capacity(count);
    for _ in 0..count {
        let candidates = (0..12).map(|_| nodes[(random.unit() * nodes.len() as f64) as usize]);
        let best = candidates
            .map(|node| {
                let nearest = sites.iter().map(|&other| distance(node, other));
                (nearest.fold(f64::INFINITY, f64::min), node)
            })
            .max_by(|a, b| a.0.total_cmp(&b.0));
        sites.extend(best.map(|(_, node)| node));
    }
    sites
}

fn push(source: &Source<'_>, site: u32, held: &[bool], random: &mut Random) -> Push {
    let mesh = source.mesh;
    let centre = mesh.positions[site as usize].map(f64::from);
    let radii = source
        .area_mm2
        .map(|area| (area / std::f64::consts::PI).sqrt());
    let depths = DEPTH.map(|share| share * source.push_mm);
    let (radius, depth) = (random.within(radii), random.within(depths));
    let tilt = [0; 3].map(|_| 0.8 * (random.unit() - 0.5));
    let mut normal = [0.0; 3];
    for &face in &mesh.domain {
        let corners = mesh.surface[face as usize];
        if corners.contains(&site) {
            let outward = tissue::mesh::face_normal(&mesh.positions, corners);
            (0..3).for_each(|k| normal[k] += outward[k]);
        }
    }
    let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-12);
    let direction: [f64; 3] = std::array::from_fn(|k| tilt[k] - normal[k] / length);
    let size = direction
        .iter()
        .map(|x| x * x)
        .sum::<f64>()
        .sqrt()
        .max(1e-12);
    let vector = direction.map(|x| (depth * x / size) as f32);
    let near = |&&node: &&u32| {
        let p = mesh.positions[node as usize];
        let squared: f64 = (0..3).map(|k| (f64::from(p[k]) - centre[k]).powi(2)).sum();
        !held[node as usize] && (squared <= radius * radius || node == site)
    };
    let nodes: Vec<u32> = source
        .prior
        .contact_nodes
        .iter()
        .filter(near)
        .copied()
        .collect();
    Push {
        vectors: nodes.iter().flat_map(|_| vector).collect(),
        nodes,
    }
}

/// What the steps add to the linear response, in block coordinates; none where the response inverts an element.
fn relax(
    source: &Source<'_>,
    forces: &ElementForces,
    response: &mut ContactResponse,
    pool: &Pool,
    held: &[bool],
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
        response.solve(isa, source.prior, held, &push.nodes, &vectors)?;
        response.field(isa, pool, source.prior, &mut q)?;
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

fn decode(source: &Source<'_>, q: &[f32]) -> Vec<f32> {
    let mut u: Vec<f32> = (0..source.mesh.node_count() as u32)
        .flat_map(|node| [0, 1, 2].map(|axis| source.prior.value_at(node, axis, |at| q[at])))
        .collect();
    for &node in source.held {
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
fn norm(source: &Source<'_>, push: &Push, gradient: &[f32]) -> f64 {
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

/// The stiffness with some nodes prescribed, by the factor of the free one and their compliance.
struct Constraint {
    dofs: Vec<usize>,
    /// `K^-1` columns of the prescribed dofs `[m][n]`, mm/mN.
    columns: Vec<f64>,
    factor: ContactFactor,
}

impl Constraint {
    fn new(source: &Source<'_>, nodes: &[u32]) -> Result<Self> {
        let free = &source.stiffness.free;
        let dofs: Vec<usize> = nodes
            .iter()
            .filter_map(|&node| free.get(node))
            .flat_map(|at| [3 * at, 3 * at + 1, 3 * at + 2])
            .collect();
        let n = source.stiffness.dofs();
        let mut columns = vec![0.0; dofs.len() * n];
        for (column, &dof) in columns.chunks_exact_mut(n).zip(&dofs) {
            column[dof] = 1.0;
        }
        source.factor.solve(&mut columns);
        let mut factor = ContactFactor::with_capacity(dofs.len());
        let names: Vec<u32> = dofs.iter().map(|&dof| dof as u32).collect();
        factor.factor(Isa::detect(), &names, |upper| {
            for (row, column) in upper
                .chunks_exact_mut(dofs.len())
                .zip(columns.chunks_exact(n))
            {
                for (value, &dof) in row.iter_mut().zip(&dofs) {
                    *value = column[dof];
                }
            }
        })?;
        Ok(Self {
            dofs,
            columns,
            factor,
        })
    }

    /// `-K^-1 r` with the prescribed nodes where they are, `[K,3]`; `r` in µN.
    fn newton(&mut self, source: &Source<'_>, gradient: &[f32]) -> Vec<f32> {
        let free = &source.stiffness.free.nodes;
        let n = source.stiffness.dofs();
        let mut step: Vec<f64> = free
            .iter()
            .flat_map(|&node| {
                let at = 3 * node as usize;
                [0, 1, 2].map(|k| -1e-3 * f64::from(gradient[at + k]))
            })
            .collect();
        for &dof in &self.dofs {
            step[dof] = 0.0;
        }
        source.factor.solve(&mut step);
        let moved: Vec<f32> = self.dofs.iter().map(|&dof| step[dof] as f32).collect();
        let mut forces = vec![0.0; moved.len()];
        self.factor.solve(Isa::detect(), &moved, &mut forces);
        for (column, &force) in self.columns.chunks_exact(n).zip(&forces) {
            for (step, column) in step.iter_mut().zip(column) {
                *step -= f64::from(force) * column;
            }
        }
        let mut field = vec![0.0f32; gradient.len()];
        for (&node, step) in free.iter().zip(step.as_chunks::<3>().0) {
            let at = 3 * node as usize;
            field[at..at + 3].copy_from_slice(&step.map(|value| value as f32));
        }
        field
    }
}

/// The leading principal directions of some vectors, by their Gram matrix.
fn principal(vectors: &[Vec<f32>], count: usize) -> Vec<Vec<f32>> {
    let n = vectors.len();
    let dot = |a: &[f32], b: &[f32]| -> f64 {
        let pairs = a.iter().zip(b);
        pairs.map(|(a, b)| f64::from(*a) * f64::from(*b)).sum()
    };
    let gram = nalgebra::DMatrix::from_fn(n, n, |i, j| dot(&vectors[i], &vectors[j]));
    let eigen = gram.symmetric_eigen();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    order
        .into_iter()
        .take(count)
        .filter(|&at| eigen.eigenvalues[at] > 1e-9 * eigen.eigenvalues.max())
        .map(|at| {
            let mut mode = vec![0.0f32; vectors[0].len()];
            for (vector, &weight) in vectors.iter().zip(eigen.eigenvectors.column(at).iter()) {
                for (mode, value) in mode.iter_mut().zip(vector) {
                    *mode += weight as f32 * value;
                }
            }
            mode
        })
        .collect()
}
