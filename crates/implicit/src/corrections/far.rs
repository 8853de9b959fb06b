//! What of the elements' nonlinearity acts far from the tools: that of one element a cluster, at the cluster's mean deformation gradient.
//!
//! Far from the tools the field is smooth, but it is not small: an organ that a tool presses turns as a whole about where it is held, and
//! linear elasticity takes a rotation for a strain. So the far elements add, to their linear forces, what their law adds to it at the mean
//! of `F` over clusters of some hundred elements,
//!
//! ```text
//! F_c = I + 1/V_c sum_e v_e grad u_e        f ~ K u + sum_c V_c g(F_c) : dF_c/du        g = P - (mu (H + H^T) + lambda tr H I)
//! ```
//!
//! with the stress `P` of the law and `H = F - I`. The mean of a gradient over a cluster is a sum over the cluster's border, so the tables
//! below are short; on the modes it is a matrix.

mod cut;

use ::elements::{Deformation, Law, Moduli, Tetrahedron, add_mean_stress, stress};

use super::body::Body;
use crate::bundle::{Mesh, volume};
use crate::error::Result;
use crate::kernels::Pool;
use crate::kernels::rows::{RowPlan, decode_rows};
use crate::memory::{self, HeldBytes};
use crate::prior::{CoarseSpace, PriorTable};

const WHAT: &str = "the far field of the corrections";
/// Clusters that a body has at least, where its chunks are as many: the number that `elements` aims
/// at, so that a cluster is one chunk until a body has twice as many.
const CLUSTERS: usize = 96;
/// Numbers of a deformation gradient.
pub(super) const NINE: usize = 9;

/// The chunks of a body as what a far field is made of; made once a model.
#[derive(HeldBytes)]
pub struct FarField {
    #[held(skip)]
    pub(super) moduli: Moduli,
    laws: ClusterLaws,
    /// Chunks of a cluster, one after another.
    pub(super) group: usize,
    /// Rest volume of each chunk times its stiffness over the material's, mm³. After a cut these are the chunks of the intact body, with all that their
    /// elements have become.
    pub(super) volumes: Vec<f64>,
    pub(super) packed: PackedChunks,
    /// What gives the mean gradient of a chunk under a field.
    borders: Borders,
    /// `sum_e v_e grad Phi` of each chunk on the modes `[C,9,r]`, rows of the gradient one after another.
    pub(super) on_modes: Vec<f32>,
    /// How many elements a node has `[K]`.
    pub(super) elements_at: Vec<u16>,
    /// Cluster of each element `[T]`.
    pub(super) cluster_of: Vec<u16>,
    /// Mean edge of the elements, were they regular, mm.
    pub(super) edge_mm: f32,
}

/// What clusters are made of where that is not the material's law alone.
#[derive(Default, HeldBytes)]
struct ClusterLaws {
    /// The law of each cluster where the body has several.
    #[held(skip)]
    laws: Vec<Law>,
    /// Mean structure tensor of each cluster's fibres, `sum v a (x) a / sum v`, where the body has some.
    structure: Vec<[[f64; 3]; 3]>,
}

impl ClusterLaws {
    /// For a cut body, whose clusters have the same laws and fibres.
    fn copied(&self) -> Result<Self> {
        Ok(Self {
            laws: memory::copied(&self.laws, WHAT)?,
            structure: memory::copied(&self.structure, WHAT)?,
        })
    }

    /// Adds an element's fibres to those of its cluster.
    fn add(&mut self, cluster: usize, element: &Tetrahedron) {
        let Some(sum) = self.structure.get_mut(cluster) else {
            return;
        };
        let a = element.fibre;
        for (row, x) in sum.iter_mut().zip(a) {
            for (sum, y) in row.iter_mut().zip(a) {
                *sum += element.volume * x * y;
            }
        }
    }

    /// Sums over clusters of `group` chunks become means.
    fn divide(&mut self, volumes: &[f64], group: usize) {
        for (own, chunks) in self.structure.iter_mut().zip(volumes.chunks(group)) {
            let whole: f64 = chunks.iter().sum();
            own.as_flattened_mut().iter_mut().for_each(|x| *x /= whole);
        }
    }
}

/// The chunks that the elements are packed in: after a cut others than those of the intact body.
#[derive(HeldBytes)]
pub(super) struct PackedChunks {
    /// As [`FarField::volumes`], mm³.
    pub volumes: Vec<f64>,
    /// Box of each at rest, mm.
    pub boxes: Vec<[[f32; 3]; 2]>,
}

/// The nodes of each chunk whose displacement changes its mean gradient, those of its border.
#[derive(HeldBytes)]
struct Borders {
    /// Where each chunk's nodes start in the two lists `[C+1]`.
    starts: Vec<u32>,
    /// Mesh nodes, chunk after chunk, in the order of each chunk's list.
    nodes: Vec<u32>,
    /// `sum_e v_e grad N` of such a node, mm².
    weights: Vec<[f32; 3]>,
}

impl Borders {
    /// Of no chunk yet, with room for some chunks.
    fn room(chunks: usize) -> Result<Borders> {
        let mut starts = memory::room(chunks + 1, WHAT)?;
        starts.push(0);
        Ok(Borders {
            starts,
            nodes: Vec::new(),
            weights: Vec::new(),
        })
    }

    /// Asks for room for more nodes.
    fn reserve(&mut self, count: usize) -> Result<()> {
        memory::reserve(&mut self.nodes, count, WHAT)?;
        memory::reserve(&mut self.weights, count, WHAT)
    }

    /// Ends the chunk whose nodes have been pushed.
    fn end_chunk(&mut self) {
        self.starts.push(self.nodes.len() as u32);
    }

    /// Places of a chunk's nodes.
    fn range(&self, chunk: usize) -> std::ops::Range<usize> {
        self.starts[chunk] as usize..self.starts[chunk + 1] as usize
    }

    /// `sum_e v_e grad u` of a chunk under a field `[K,3]` that is zero at held nodes, mm³.
    fn gradient(&self, chunk: usize, field: &[f32]) -> [f32; NINE] {
        let range = self.range(chunk);
        let mut sum = [0.0f32; NINE];
        for (&node, weight) in self.nodes[range.clone()].iter().zip(&self.weights[range]) {
            let u = &field[3 * node as usize..][..3];
            for (row, u) in sum.chunks_exact_mut(3).zip(u) {
                for (sum, weight) in row.iter_mut().zip(weight) {
                    *sum += u * weight;
                }
            }
        }
        sum
    }
}

impl FarField {
    /// Prepares the chunks of a body, and their mean gradients on the modes of its coarse space.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn new(
        body: &Body,
        mesh: &Mesh,
        moduli: Moduli,
        prior: &PriorTable,
        space: &CoarseSpace,
    ) -> Result<FarField> {
        let elements = &body.forces;
        let count = elements.chunk_count();
        let mut own = FarField {
            moduli,
            laws: ClusterLaws::default(),
            group: (count / CLUSTERS).max(1),
            volumes: memory::room(count, WHAT)?,
            packed: PackedChunks {
                volumes: memory::room(count, WHAT)?,
                boxes: memory::room(count, WHAT)?,
            },
            borders: Borders::room(count)?,
            on_modes: memory::zeros(count * NINE * space.count(), WHAT)?,
            elements_at: memory::filled(mesh.node_count(), 0, WHAT)?,
            cluster_of: memory::filled(mesh.tets.len() / 4, 0, WHAT)?,
            edge_mm: 0.0,
        };
        if !mesh.laws.regions.is_empty() {
            // Chunks have one law, and so have clusters.
            own.group = 1;
            let laws = (0..count).map(|chunk| elements.moduli_of(chunk).law);
            own.laws.laws = memory::collected(count, laws, WHAT)?;
        }
        if !mesh.laws.fibre.is_empty() {
            own.laws.structure = memory::filled(count.div_ceil(own.group), [[0.0; 3]; 3], WHAT)?;
        }
        for chunk in 0..count {
            own.push(body, mesh, chunk)?;
        }
        own.laws.divide(&own.volumes, own.group);
        let sixfold = |tet: &[u32; 4]| volume(&mesh.positions, tet);
        let whole: f64 = mesh.tets.as_chunks().0.iter().map(sixfold).sum();
        // A regular tetrahedron's is a³ / sqrt 2.
        let mean = whole / own.cluster_of.len().max(1) as f64;
        own.edge_mm = libm::cbrt(std::f64::consts::SQRT_2 * mean) as f32;
        own.decode(prior, space)?;
        Ok(own)
    }

    /// Adds a chunk: its volume, box, border and its share in the lists by node and element.
    fn push(&mut self, body: &Body, mesh: &Mesh, chunk: usize) -> Result<()> {
        let nodes = body.forces.chunk_nodes(chunk);
        let mut sums = memory::filled(nodes.len(), [0.0f64; 3], WHAT)?;
        let (mut volume, mut largest) = (0.0, 0.0f64);
        let elements_at = &mut self.elements_at;
        for (number, element) in body.forces.chunk_tetrahedra(chunk) {
            self.cluster_of[number as usize] = (chunk / self.group) as u16;
            volume += element.volume;
            self.laws.add(chunk / self.group, &element);
            let [a, b, c] = element.gradients;
            let first = [0, 1, 2].map(|k| -(a[k] + b[k] + c[k]));
            for (corner, gradient) in element.corners.into_iter().zip([first, a, b, c]) {
                elements_at[nodes[corner as usize] as usize] += 1;
                for (sum, value) in sums[corner as usize].iter_mut().zip(gradient) {
                    *sum += element.volume * value;
                    largest = largest.max((element.volume * value).abs());
                }
            }
        }
        self.volumes.push(volume);
        self.packed.volumes.push(volume);
        self.borders.reserve(nodes.len())?;
        let mut bounds = [[f32::MAX; 3], [f32::MIN; 3]];
        for (&node, sum) in nodes.iter().zip(sums) {
            let at = &mesh.positions[3 * node as usize..][..3];
            for (axis, &x) in at.iter().enumerate() {
                bounds[0][axis] = bounds[0][axis].min(x);
                bounds[1][axis] = bounds[1][axis].max(x);
            }
            // Inside of the chunk the shares of a node's elements cancel.
            let matters = sum.iter().any(|value| value.abs() > 1e-5 * largest);
            if matters && !body.held.is[node as usize] {
                self.borders.nodes.push(node);
                let weight = sum.map(|value| value as f32);
                self.borders.weights.push(weight);
            }
        }
        self.packed.boxes.push(bounds);
        self.borders.end_chunk();
        Ok(())
    }

    /// The mean gradients on the modes.
    fn decode(&mut self, prior: &PriorTable, space: &CoarseSpace) -> Result<()> {
        let count = space.count();
        let held = 3 * self.elements_at.len();
        let all = memory::collected(
            self.elements_at.len(),
            0..self.elements_at.len() as u32,
            WHAT,
        )?;
        let plan = RowPlan::try_region(&prior.basis(), &all, false)?;
        let (mut q, mut field) = (
            memory::zeros(prior.width(), WHAT)?,
            memory::zeros(held, WHAT)?,
        );
        // Once a model, where no scene's threads are at hand yet.
        let pool = Pool::of(space.isa(), 1)?;
        for mode in 0..count {
            space.read_mode(mode, &mut q);
            decode_rows(space.isa(), &pool, &prior.basis(), &plan, &q, &mut field)?;
            for chunk in 0..self.volumes.len() {
                let gradient = self.gradient(chunk, &field);
                for (row, value) in gradient.into_iter().enumerate() {
                    self.on_modes[(chunk * NINE + row) * count + mode] = value;
                }
            }
        }
        Ok(())
    }

    /// `sum_e v_e grad u` of a chunk under a field `[K,3]` that is zero at held nodes, mm³.
    pub(super) fn gradient(&self, chunk: usize, field: &[f32]) -> [f32; NINE] {
        self.borders.gradient(chunk, field)
    }

    /// Clusters.
    pub(super) fn clusters(&self) -> usize {
        self.volumes.len().div_ceil(self.group)
    }

    /// Chunks of a cluster.
    pub(super) fn chunks_of(&self, cluster: usize) -> std::ops::Range<usize> {
        let first = cluster * self.group;
        first..(first + self.group).min(self.volumes.len())
    }

    /// The material's moduli with the law of a cluster.
    pub(super) fn moduli_of(&self, cluster: usize) -> Moduli {
        Moduli {
            law: (self.laws.laws.get(cluster).copied()).unwrap_or(self.moduli.law),
            ..self.moduli
        }
    }

    /// What a cluster's law adds to the linear stress at `H = F - I`, Pa, and det F.
    pub(super) fn added_stress(&self, cluster: usize, h: [f64; NINE]) -> ([f64; NINE], f64) {
        let mut f = [[0.0; 3]; 3];
        for (i, row) in f.iter_mut().enumerate() {
            for (j, value) in row.iter_mut().enumerate() {
                *value = h[3 * i + j] + if i == j { 1.0 } else { 0.0 };
            }
        }
        let state = Deformation::of(f);
        let moduli = self.moduli_of(cluster);
        let mut stress = stress(&state, moduli);
        if let (Some(fibres), Some(own)) = (moduli.law.fibres(), self.laws.structure.get(cluster)) {
            add_mean_stress(fibres, &f, (own, moduli.shear_pa), &mut stress);
        }
        let lambda = self.moduli.bulk_pa - 2.0 / 3.0 * self.moduli.shear_pa;
        // Linear elasticity of the material is what the modes and the stiffness at rest have
        // already.
        let trace = h[0] + h[4] + h[8];
        let mut added = [0.0; NINE];
        for i in 0..3 {
            for j in 0..3 {
                let both = h[3 * i + j] + h[3 * j + i];
                let volume = if i == j { lambda * trace } else { 0.0 };
                added[3 * i + j] = stress[i][j] - self.moduli.shear_pa * both - volume;
            }
        }
        (added, state.det)
    }
}
