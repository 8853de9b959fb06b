//! The programme *hang*: a patch of the surface hangs on a bed of ties, a thread at one of its nodes draws it away, and the bed tears node by node.

use crate::mesh::{Boundary, Mesh, face_area, face_centroid, face_normal};
use crate::schemes::SplitMix;
use contact::{End, Spring, Tie, TiePoint, Vector};

/// How large a bed is and how hard it is pulled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HangSizes {
    /// Of the bed, mm.
    pub radius_mm: f32,
    /// Of all of its ties together, N/m and mN.
    pub stiffness: f32,
    pub break_mn: f32,
    /// Of the thread, N/m.
    pub thread: f32,
    /// How far its end is drawn, mm, ...
    pub pull_mm: f32,
    /// ... and in which time, s.
    pub pull_s: f64,
}

impl Default for HangSizes {
    fn default() -> Self {
        Self {
            radius_mm: 12.0,
            stiffness: 120.0,
            break_mn: 90.0,
            thread: 40.0,
            pull_mm: 12.0,
            pull_s: 2.4,
        }
    }
}

/// A case ends so long after the thread has been drawn, s.
const AFTER_S: f64 = 0.4;
/// Draws of a site at most.
const DRAWS: usize = 100;
/// A bed has so many ties at least.
const LEAST_TIES: usize = 8;

/// A case.
#[derive(Clone, Debug)]
pub struct Hang {
    bed: Vec<Tie>,
    thread: Tie,
    outward: Vector,
    sizes: HangSizes,
}

impl Hang {
    /// A case about a face of the domain that is drawn by `seed`; none where no draw finds a bed.
    pub fn new(mesh: &Mesh, boundary: Boundary, seed: u64, sizes: HangSizes) -> Option<Self> {
        let vector = |v: [f64; 3]| Vector::from(v.map(|x| x as f32));
        let mut area = vec![0.0f32; mesh.node_count()];
        for row in &mesh.domain {
            let face = mesh.surface[*row as usize];
            let third = face_area(&mesh.positions, face) as f32 / 3.0;
            face.iter().for_each(|node| area[*node as usize] += third);
        }
        for node in mesh.held_nodes(boundary) {
            area[node as usize] = 0.0;
        }
        let at = |node: u32| Vector::from(mesh.positions[node as usize]);
        let mut random = SplitMix(seed);
        for _ in 0..DRAWS {
            let row = mesh.domain.get(random.below(mesh.domain.len()))?;
            let face = mesh.surface[*row as usize];
            let site = vector(face_centroid(&mesh.positions, face));
            let outward = vector(face_normal(&mesh.positions, face));
            let aside = random.within([0.0, std::f64::consts::TAU]) as f32;
            let is_in = |node: &u32| {
                area[*node as usize] > 0.0 && at(*node).distance(site) <= sizes.radius_mm
            };
            let nodes: Vec<u32> = (0..mesh.node_count() as u32).filter(is_in).collect();
            if nodes.len() < LEAST_TIES {
                continue;
            }
            let along = outward.any_orthonormal_vector();
            let beside = along * aside.cos() + outward.cross(along) * aside.sin();
            let drawn = site + beside * (0.5 * sizes.radius_mm);
            let near = |a: &&u32, b: &&u32| {
                let [a, b] = [**a, **b].map(|node| at(node).distance(drawn));
                a.total_cmp(&b)
            };
            let pulled = *nodes.iter().min_by(near)?;
            let whole: f32 = nodes.iter().map(|node| area[*node as usize]).sum();
            let tie = |node: u32, stiffness: f32, break_mn: f32| Tie {
                point: TiePoint {
                    nodes: [node; 3],
                    weights: [1.0, 0.0, 0.0],
                },
                end: End::World(at(node)),
                spring: Spring {
                    stiffness,
                    ..Spring::default()
                },
                break_mn,
            };
            let bed = nodes.iter().map(|&node| {
                let share = area[node as usize] / whole;
                tie(node, share * sizes.stiffness, share * sizes.break_mn)
            });
            return Some(Self {
                bed: bed.collect(),
                thread: tie(pulled, sizes.thread, 0.0),
                outward,
                sizes,
            });
        }
        None
    }

    /// The bed's ties, then the thread, at a time from rest.
    pub fn ties(&self, time_s: f64) -> Vec<Tie> {
        let part = (time_s / self.sizes.pull_s).min(1.0) as f32;
        let End::World(from) = self.thread.end else {
            return self.bed.clone();
        };
        let end = End::World(from + self.outward * (part * self.sizes.pull_mm));
        let thread = Tie { end, ..self.thread };
        self.bed.iter().copied().chain([thread]).collect()
    }

    /// How long a case takes, s.
    pub fn duration_s(&self) -> f64 {
        self.sizes.pull_s + AFTER_S
    }
}
