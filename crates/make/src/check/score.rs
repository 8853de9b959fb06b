//! What the steps of a case came to: errors in contact and after a release, by region of the surface, forces, estimates.

use tissue::mesh::{Mesh, face_centroid};
use tissue::metrics;
use upt::SceneStats;

use page::Film;

/// Nodes and vectors of one step's contact.
pub type Touch = (Vec<u32>, Vec<f32>);

/// Regions of the domain.
const REGIONS: usize = 6;

/// Centres of the regions, mm: a site belongs to the nearest.
pub type Regions = Vec<[f64; 3]>;

/// Regions of the domain whose centres are far from one another.
pub fn regions(mesh: &Mesh) -> Regions {
    let places: Vec<[f64; 3]> = mesh
        .domain
        .iter()
        .map(|&row| face_centroid(&mesh.positions, mesh.surface[row as usize]))
        .collect();
    let mut centres: Regions = Vec::new();
    let mut nearest = vec![f64::INFINITY; places.len()];
    let mut next = 0;
    while centres.len() < REGIONS.min(places.len()) {
        centres.push(places[next]);
        for (near, place) in nearest.iter_mut().zip(&places) {
            *near = near.min(squared(*place, places[next]));
        }
        next = (0..places.len())
            .max_by(|&a, &b| nearest[a].total_cmp(&nearest[b]))
            .unwrap_or(0);
    }
    centres
}

/// The region that a place belongs to.
pub fn nearest(regions: &Regions, place: [f64; 3]) -> Option<usize> {
    (0..regions.len())
        .min_by(|&a, &b| squared(place, regions[a]).total_cmp(&squared(place, regions[b])))
}

fn squared(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum()
}

/// Errors of some steps, summed.
#[derive(Clone, Debug, Default)]
pub struct Part {
    pub steps: usize,
    /// Mean over the nodes of the squared distance, summed over the steps, mm².
    pub mse: f64,
    pub baseline: f64,
    /// Those of the true displacement.
    pub truth: f64,
    /// Largest over nodes and axes, mm.
    pub largest: f64,
}

impl Part {
    fn add(&mut self, mse: f64, baseline: f64, truth: f64, largest: f64) {
        self.steps += 1;
        self.mse += mse;
        self.baseline += baseline;
        self.truth += truth;
        self.largest = self.largest.max(largest);
    }

    /// Both together.
    pub fn join(&mut self, other: &Part) {
        self.steps += other.steps;
        self.mse += other.mse;
        self.baseline += other.baseline;
        self.truth += other.truth;
        self.largest = self.largest.max(other.largest);
    }

    /// Mean of a sum over the steps.
    pub fn mean(&self, sum: f64) -> f64 {
        sum / self.steps.max(1) as f64
    }
}

/// One step.
pub struct Step<'a> {
    pub truth: &'a [[f32; 3]],
    pub field: &'a [[f32; 3]],
    pub baseline: &'a [[f32; 3]],
    pub stats: SceneStats,
    pub forces: &'a [[f32; 3]],
    pub true_forces: &'a [[f32; 3]],
    pub nodes: &'a [u32],
}

/// A case.
pub struct Score {
    pub scheme: &'static str,
    pub seed: u64,
    pub contact: Part,
    pub free: Part,
    pub regions: Vec<Part>,
    /// Squared error of the force on the instrument and the squared force, summed over the steps, mN².
    pub force: [f64; 2],
    /// Estimated and true root mean square error of each corrected step, mm.
    pub estimates: Vec<[f64; 2]>,
    /// Why the reference solver did not make all of it.
    pub ended: Option<String>,
    /// Steps that the guard refused.
    pub refused: usize,
    /// Squared error of each node, summed over the steps in contact, mm².
    pub nodes: Vec<f32>,
    /// Corrections of all steps in contact.
    pub corrections: u64,
    /// What touched in each step.
    pub touches: Vec<Touch>,
    /// The steps to play, where they are wanted.
    pub film: Option<Film>,
}

impl Score {
    pub fn new(scheme: &'static str, seed: u64, nodes: usize, regions: usize) -> Self {
        Self {
            scheme,
            seed,
            contact: Part::default(),
            free: Part::default(),
            regions: vec![Part::default(); regions],
            force: [0.0; 2],
            estimates: Vec::new(),
            ended: None,
            refused: 0,
            nodes: vec![0.0; nodes],
            corrections: 0,
            touches: Vec::new(),
            film: None,
        }
    }

    /// Counts a step.
    pub fn add(&mut self, step: &Step<'_>, mesh: &Mesh, regions: &Regions) {
        let mse = metrics::mse_mm2(step.truth, step.field);
        let baseline = metrics::mse_mm2(step.truth, step.baseline);
        let size = metrics::mse_mm2(step.truth, &vec![[0.0; 3]; step.truth.len()]);
        let largest = metrics::max_error_mm(step.truth, step.field);
        if let Some(film) = &mut self.film {
            film.add(mesh, step.field, step.truth, step.nodes);
        }
        if step.nodes.is_empty() {
            // Before the first contact there is nothing to be wrong about.
            if self.contact.steps > 0 {
                self.free.add(mse, baseline, size, largest);
            }
            return;
        }
        self.contact.add(mse, baseline, size, largest);
        self.corrections += u64::from(step.stats.corrections);
        let places = step
            .nodes
            .iter()
            .map(|&node| mesh.positions[node as usize].map(f64::from));
        let mut site = [0.0; 3];
        for place in places {
            (0..3).for_each(|k| site[k] += place[k] / step.nodes.len() as f64);
        }
        if let Some(region) = nearest(regions, site) {
            self.regions[region].add(mse, baseline, size, largest);
        }
        for k in 0..3 {
            let sum =
                |forces: &[[f32; 3]]| forces.iter().map(|force| f64::from(force[k])).sum::<f64>();
            let (found, truth) = (sum(step.forces), sum(step.true_forces));
            self.force[0] += (found - truth).powi(2);
            self.force[1] += truth.powi(2);
        }
        if step.stats.corrections > 0 && step.stats.error_mm > 0.0 {
            self.estimates
                .push([f64::from(step.stats.error_mm), mse.sqrt()]);
        }
        for (sum, (a, b)) in self.nodes.iter_mut().zip(step.truth.iter().zip(step.field)) {
            *sum += (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f32>();
        }
    }
}
