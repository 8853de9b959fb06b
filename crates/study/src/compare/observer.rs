//! A scene that is watched: each step compared with a true state, and what the scene itself could have known of its error.

use anyhow::{Result, ensure};
use upt::forces::ReactionForces;
use upt::{Contact, Error, Scene, flag};

use crate::bench::Bench;

/// Attached points of each sort that are watched, at most.
const POINTS: usize = 2000;

/// One step.
#[derive(Clone, Debug)]
pub struct Moment {
    /// mm².
    pub mse: f64,
    /// Largest distance of a node to the true one, mm.
    pub largest_error: f64,
    /// Largest |u| of the bundle and of the truth, mm.
    pub size: f64,
    pub true_size: f64,
    /// Strain and kinetic energy of the truth, mJ.
    pub energy: f64,
    /// RMS of the internal force at nodes that are neither held nor touched, mN.
    pub residual: f64,
    /// RMS of the reaction at the contact nodes, mN.
    pub reaction: f64,
    /// The envelope ratio of the statistics.
    pub ratio: f64,
    /// Flags of the envelope and the guard.
    pub flags: u32,
    /// The guard refused the step.
    pub refused: bool,
    pub touching: bool,
    /// Reaction at the contact nodes as the scene gives it, and from the elements at the predicted state; in contact only.
    pub force: Option<ForceError>,
    pub element_force: Option<ForceError>,
    pub points: PointErrors,
}

/// A named number of each step.
pub type Series = (&'static str, fn(&Moment) -> f64);

/// Squared size of an error and of what it is an error of.
#[derive(Clone, Copy, Debug, Default)]
pub struct Share {
    pub wrong: f64,
    pub all: f64,
}

/// Error of the forces on the contact nodes, and of their sum.
#[derive(Clone, Copy, Debug, Default)]
pub struct ForceError {
    pub nodal: Share,
    pub sum: Share,
}

impl ForceError {
    /// Over the contact nodes that are free. `[m,3]` mN each.
    fn new(found: &[[f32; 3]], truth: &[[f32; 3]], is_free: impl Fn(usize) -> bool) -> Self {
        let mut nodal = Share::default();
        let (mut sum, mut true_sum) = ([0.0; 3], [0.0; 3]);
        for entry in (0..truth.len()).filter(|&entry| is_free(entry)) {
            let (got, want) = (found[entry].map(f64::from), truth[entry].map(f64::from));
            nodal.wrong += apart(got, want);
            nodal.all += square(want);
            for k in 0..3 {
                sum[k] += got[k];
                true_sum[k] += want[k];
            }
        }
        Self {
            nodal,
            sum: Share {
                wrong: apart(sum, true_sum),
                all: square(true_sum),
            },
        }
    }
}

/// At points in the middle of surface edges, mm² and mm: decoded at the point against the mean of the edge's nodes.
#[derive(Clone, Copy, Debug, Default)]
pub struct PointErrors {
    /// Mean square of the difference of both.
    pub difference: f64,
    pub largest_difference: f64,
    /// Mean square error of each.
    pub decoded: f64,
    pub interpolated: f64,
    /// Mean square of the difference of a point at a node from that node.
    pub at_nodes: f64,
    pub largest_at_nodes: f64,
}

impl Moment {
    /// Anything that warns the host.
    pub fn alarmed(&self) -> bool {
        self.refused || self.flags != 0
    }
}

/// What a step should have come to. Displacement `[K,3]` mm, reaction `[m,3]` mN, energy mJ.
pub struct Truth<'a> {
    pub displacement: &'a [[f32; 3]],
    pub reaction: &'a [[f32; 3]],
    pub energy: f64,
}

pub struct Observer {
    scene: Scene,
    forces: ReactionForces,
    free: Vec<u32>,
    edges: Vec<[u32; 2]>,
    found: Vec<f32>,
    at_points: Vec<f32>,
    internal: Vec<f32>,
}

impl Observer {
    pub fn new(bench: &Bench) -> Result<Self> {
        let material = &bench.model.manifest.material;
        let mesh = &bench.mesh;
        let held = mesh.held_nodes(bench.boundary);
        let free: Vec<u32> = (0..mesh.node_count() as u32)
            .filter(|node| held.binary_search(node).is_err())
            .collect();
        let edges = surface_edges(&mesh.surface);
        let scene = bench.scene()?;
        let middles = edges.iter().map(|edge| {
            let [a, b] = edge.map(|node| mesh.positions[node as usize]);
            [0, 1, 2].map(|k| 0.5 * (a[k] + b[k]))
        });
        let nodes = edges.iter().map(|[node, _]| mesh.positions[*node as usize]);
        let points: Vec<f32> = middles.chain(nodes).flatten().collect();
        scene.attach_points(Some(&points))?;
        Ok(Self {
            scene,
            forces: ReactionForces::new(mesh.tetrahedra(), &free, material.moduli())?,
            internal: vec![0.0; 3 * free.len()],
            at_points: vec![0.0; points.len()],
            free,
            edges,
            found: vec![0.0; 3 * mesh.node_count()],
        })
    }

    pub fn sleeps(&self) -> bool {
        self.scene.stats().sleeping
    }

    /// Steps the scene, contact nodes ascending. A refusal of the guard keeps the scene's state and is an alarm.
    pub fn step(
        &mut self,
        nodes: &[u32],
        vectors: &[[f32; 3]],
        truth: &Truth<'_>,
    ) -> Result<Moment> {
        let refused = match self.scene.step(
            Contact::Sparse {
                nodes,
                vectors: vectors.as_flattened(),
            },
            Some(&mut self.found),
        ) {
            Ok(()) => false,
            Err(Error::Guard(_)) => {
                self.scene.read(&mut self.found)?;
                true
            }
            Err(error) => return Err(error.into()),
        };
        let stats = self.scene.stats();
        ensure!(
            self.found.iter().all(|u| u.is_finite()),
            "the bundle published a displacement that is not finite"
        );
        self.forces
            .reaction(&self.found, &self.free, &mut self.internal)?;
        let (mut residual, mut reaction) = (0.0, 0.0);
        let mut of_elements = vec![[0.0; 3]; nodes.len()];
        for (node, force) in self.free.iter().zip(self.internal.as_chunks::<3>().0) {
            let size = square(force.map(f64::from));
            if let Ok(entry) = nodes.binary_search(node) {
                reaction += size;
                of_elements[entry] = *force;
            } else {
                residual += size;
            }
        }
        // A refused step leaves the scene with an earlier contact.
        let compared = !nodes.is_empty() && !refused && stats.contact_count == nodes.len() as u64;
        let mut of_scene = vec![[0.0; 3]; nodes.len()];
        if compared {
            self.scene.contact_force(of_scene.as_flattened_mut())?;
        }
        let is_free = |entry: usize| self.free.binary_search(&nodes[entry]).is_ok();
        let error =
            |found: &[[f32; 3]]| compared.then(|| ForceError::new(found, truth.reaction, is_free));
        let (force, element_force) = (error(&of_scene), error(&of_elements));
        let others = (self.free.len() - nodes.len().min(self.free.len())).max(1);
        let found = self.found.as_chunks::<3>().0;
        let largest = |field: &[[f32; 3]]| {
            let squares = field.iter().map(|u| square(u.map(f64::from)));
            squares.fold(0.0, f64::max).sqrt()
        };
        let mse = tissue::metrics::mse_mm2(truth.displacement, found);
        let largest_error = tissue::metrics::max_error_mm(truth.displacement, found);
        let (size, true_size) = (largest(found), largest(truth.displacement));
        Ok(Moment {
            mse,
            largest_error,
            size,
            true_size,
            energy: truth.energy,
            residual: (residual / others as f64).sqrt(),
            reaction: (reaction / nodes.len().max(1) as f64).sqrt(),
            ratio: f64::from(stats.indicator),
            flags: stats.flags & !(flag::CLAMPED | flag::REGULARISED),
            refused,
            touching: !nodes.is_empty(),
            force,
            element_force,
            points: self.points(truth.displacement)?,
        })
    }

    fn points(&mut self, truth: &[[f32; 3]]) -> Result<PointErrors> {
        self.scene
            .read_view(upt::View::Points, &mut self.at_points)?;
        let found = self.found.as_chunks::<3>().0;
        let middle = |field: &[[f32; 3]], edge: &[u32; 2]| {
            let [a, b] = edge.map(|node| field[node as usize].map(f64::from));
            [0, 1, 2].map(|k| 0.5 * (a[k] + b[k]))
        };
        let mut errors = PointErrors::default();
        let (middles, nodes) = self.at_points.as_chunks().0.split_at(self.edges.len());
        for ((edge, decoded), at_node) in self.edges.iter().zip(middles).zip(nodes) {
            let decoded = decoded.map(f64::from);
            let (interpolated, want) = (middle(found, edge), middle(truth, edge));
            let difference = apart(decoded, interpolated);
            errors.difference += difference;
            errors.largest_difference = errors.largest_difference.max(difference.sqrt());
            errors.decoded += apart(decoded, want);
            errors.interpolated += apart(interpolated, want);
            let node = found[edge[0] as usize].map(f64::from);
            let difference = apart(at_node.map(f64::from), node);
            errors.at_nodes += difference;
            errors.largest_at_nodes = errors.largest_at_nodes.max(difference.sqrt());
        }
        let count = self.edges.len().max(1) as f64;
        errors.difference /= count;
        errors.decoded /= count;
        errors.interpolated /= count;
        errors.at_nodes /= count;
        Ok(errors)
    }
}

fn square(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum()
}

fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    square([0, 1, 2].map(|k| a[k] - b[k]))
}

/// Edges of the surface, evenly thinned to [`POINTS`].
fn surface_edges(faces: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let mut edges: Vec<[u32; 2]> = faces
        .iter()
        .flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]])
        .map(|[a, b]| [*a.min(b), *a.max(b)])
        .collect();
    edges.sort_unstable();
    edges.dedup();
    let every = edges.len().div_ceil(POINTS).max(1);
    edges.into_iter().step_by(every).collect()
}
