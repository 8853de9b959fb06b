//! The near elements in linear elasticity, and what of the far field's clusters they are.
//!
//! The iterations know the near elements in two ways: by their law ([`super::near`]), and linearly
//! about rest. The linear part is what the modes' Gram matrix has of them already, so it is what a
//! near set takes off; and it stands for the change of a pair at nodes that were far when the pair
//! was made.

use std::ops::Range;

use ::elements::{Moduli, Tetrahedron};

use crate::corrections::far::FarField;
use crate::error::Result;
use crate::memory::{self, HeldBytes};

/// What there is no memory for, where there is none.
pub(super) const WHAT: &str = "the elements near the tools";

/// One element.
#[derive(HeldBytes)]
struct Linear {
    /// Of the corners in the near set.
    places: [u32; 4],
    /// The cluster of the far field that it would be of.
    cluster: u32,
    /// Of the shape functions 1, 2, 3, 1/mm.
    gradients: [[f32; 3]; 3],
    /// Lame's constants times the rest volume, µN mm.
    shear: f32,
    lambda: f32,
}

/// The elements; see [`super::near`] for what a place is.
#[derive(Default, HeldBytes)]
pub(super) struct LinearElements {
    /// In the order in which the near set found them; an element is known by its place here.
    all: Vec<Linear>,
    /// Directions of fibres at rest, as far as the last element that has one.
    fibres: Vec<[f64; 3]>,
}

impl LinearElements {
    /// The room stays for the next set.
    pub fn clear(&mut self) {
        self.all.clear();
        self.fibres.clear();
    }

    /// Adds an element, with mesh nodes for places until [`LinearElements::take_places`].
    pub fn push(&mut self, far: &FarField, number: u32, element: &Tetrahedron) -> Result<()> {
        let moduli = far.moduli;
        let lambda = moduli.bulk_pa - 2.0 / 3.0 * moduli.shear_pa;
        let linear = Linear {
            places: element.corners,
            cluster: u32::from(far.cluster_of[number as usize]),
            gradients: element.gradients.map(|g| g.map(|x| x as f32)),
            shear: (moduli.shear_pa * element.volume) as f32,
            lambda: (lambda * element.volume) as f32,
        };
        // A large list, of a scene's own: its room grows by an eighth, once it has some thousands.
        if self.all.len() == self.all.capacity() {
            let more = (self.all.len() / 8).max(4096);
            memory::reserve(&mut self.all, more, WHAT)?;
        }
        self.all.push(linear);
        if element.fibre != [0.0; 3] {
            let count = self.all.len();
            if self.fibres.capacity() < count {
                let more = self.all.capacity() - self.fibres.len();
                memory::reserve(&mut self.fibres, more, WHAT)?;
            }
            self.fibres.resize(count - 1, [0.0; 3]);
            self.fibres.push(element.fibre);
        }
        Ok(())
    }

    /// Takes the places of the corners.
    pub fn take_places(&mut self, of_node: &[u32]) {
        for element in &mut self.all {
            element.places = element.places.map(|node| of_node[node as usize]);
        }
    }

    /// How many they are.
    pub fn len(&self) -> usize {
        self.all.len()
    }

    /// The places of the corners.
    pub fn places(&self) -> impl Iterator<Item = [u32; 4]> + '_ {
        self.all.iter().map(|element| element.places)
    }

    /// The places of the corners of one element.
    pub fn places_of(&self, at: usize) -> [u32; 4] {
        self.all[at].places
    }

    /// Those elements that have a corner at one of the first places that is asked for, ascending.
    pub fn find(&self, is_asked: &[bool], found: &mut Vec<u32>) -> Result<()> {
        found.clear();
        memory::fit(found, self.len(), WHAT)?;
        let asks = |place: &u32| is_asked.get(*place as usize) == Some(&true);
        let all = self.places().zip(0..);
        found.extend(all.filter_map(|(places, at)| places.iter().any(asks).then_some(at)));
        Ok(())
    }

    /// An element, its corners as places, and its moduli.
    pub fn tetrahedron(&self, at: usize, far: &FarField) -> (Tetrahedron, Moduli) {
        let element = &self.all[at];
        let tetrahedron = Tetrahedron {
            corners: element.places,
            volume: f64::from(element.shear) / far.moduli.shear_pa,
            gradients: element.gradients.map(|g| g.map(f64::from)),
            fibre: self.fibres.get(at).copied().unwrap_or_default(),
        };
        (tetrahedron, far.moduli_of(element.cluster as usize))
    }

    /// The largest entry of the gradient of a field in an element.
    pub fn largest_gradient(&self, at: usize, field: impl Fn(u32) -> [f32; 3]) -> f32 {
        let element = &self.all[at];
        let [first, rest @ ..] = element.places.map(field);
        let mut h = [[0.0f32; 3]; 3];
        for (corner, gradient) in rest.iter().zip(&element.gradients) {
            for i in 0..3 {
                for j in 0..3 {
                    h[i][j] += (corner[i] - first[i]) * gradient[j];
                }
            }
        }
        h.as_flattened()
            .iter()
            .fold(0.0, |most, x| most.max(x.abs()))
    }

    /// `K v` at the first places, as many as `out [.., 3]` has, µN, of a field `[.., 3]` by place, mm; where there are `some`, by those elements
    /// alone.
    pub fn apply(&self, v: &[f32], some: Option<&[u32]>, out: &mut [f32]) {
        out.fill(0.0);
        match some {
            Some(some) => apply(some.iter().map(|at| &self.all[*at as usize]), v, out),
            None => apply(self.all.iter(), v, out),
        }
    }
}

/// Adds `K v` of some elements.
fn apply<'a>(elements: impl Iterator<Item = &'a Linear>, v: &[f32], out: &mut [f32]) {
    let v = v.as_chunks::<3>().0;
    let out = out.as_chunks_mut::<3>().0;
    for element in elements {
        let [first, rest @ ..] = element.places.map(|place| v[place as usize]);
        let mut h = [[0.0f32; 3]; 3];
        for (corner, gradient) in rest.iter().zip(&element.gradients) {
            for i in 0..3 {
                let relative = corner[i] - first[i];
                for j in 0..3 {
                    h[i][j] += relative * gradient[j];
                }
            }
        }
        // `sigma = lambda tr H + mu (H + H^T)`, times the volume.
        let pressure = element.lambda * (h[0][0] + h[1][1] + h[2][2]);
        let mut stress = [[0.0f32; 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                stress[i][j] = element.shear * (h[i][j] + h[j][i]);
            }
            stress[i][i] += pressure;
        }
        let mut balance = [0.0f32; 3];
        for (&place, gradient) in element.places[1..].iter().zip(&element.gradients) {
            let mut force = [0.0f32; 3];
            for i in 0..3 {
                force[i] = stress[i][0] * gradient[0]
                    + stress[i][1] * gradient[1]
                    + stress[i][2] * gradient[2];
                balance[i] -= force[i];
            }
            if let Some(out) = out.get_mut(place as usize) {
                for (out, force) in out.iter_mut().zip(force) {
                    *out += force;
                }
            }
        }
        if let Some(out) = out.get_mut(element.places[0] as usize) {
            for (out, force) in out.iter_mut().zip(balance) {
                *out += force;
            }
        }
    }
}

/// What of the far field's clusters is near.
#[derive(Default, HeldBytes)]
pub(super) struct Parts {
    /// By cluster, ascending.
    list: Vec<Part>,
    /// `sum_e v_e grad N` of their free nodes, a place each, mm²; those of a part in the order of the mesh's nodes, which does not depend on what else is near.
    weights: Vec<(u32, [f32; 3])>,
    /// By place, of the part at hand; zeros between two parts.
    sums: Vec<[f32; 3]>,
    /// Places that a sum has been added to, a bit each.
    summed: Vec<u64>,
    /// Elements by cluster, and where each cluster's end.
    order: Vec<u32>,
    ends: Vec<u32>,
}

/// That of one of them.
#[derive(HeldBytes)]
pub(super) struct Part {
    pub cluster: usize,
    /// Rest volume times the stiffness over the material's, mm³.
    pub volume: f64,
    /// Into [`Parts::weights`].
    #[held(skip)]
    pub weights: Range<usize>,
}

impl Parts {
    /// Takes the parts of some elements, of which `free` nodes are free; by place `nodes` has their numbers in the mesh.
    pub fn fill(
        &mut self,
        elements: &LinearElements,
        far: &FarField,
        (nodes, free): (&[u32], usize),
    ) -> Result<()> {
        self.list.clear();
        self.weights.clear();
        self.sums.clear();
        memory::fit(&mut self.sums, free, WHAT)?;
        self.sums.resize(free, [0.0; 3]);
        self.summed.clear();
        memory::fit(&mut self.summed, free.div_ceil(64), WHAT)?;
        self.summed.resize(free.div_ceil(64), 0);
        self.sort(elements, far.clusters())?;
        for cluster in 0..far.clusters() {
            let start = cluster.checked_sub(1).map_or(0, |before| self.ends[before]);
            let own = start as usize..self.ends[cluster] as usize;
            let (mut volume, mut largest) = (0.0f64, 0.0f32);
            for element in self.order[own].iter().map(|at| &elements.all[*at as usize]) {
                let share = element.shear / far.moduli.shear_pa as f32;
                volume += f64::from(share);
                let [a, b, c] = element.gradients;
                let first = [0, 1, 2].map(|k| -(a[k] + b[k] + c[k]));
                for (place, gradient) in element.places.into_iter().zip([first, a, b, c]) {
                    if let Some(sum) = self.sums.get_mut(place as usize) {
                        self.summed[place as usize / 64] |= 1 << (place % 64);
                        for (sum, value) in sum.iter_mut().zip(gradient) {
                            *sum += share * value;
                            let size = (share * value).abs();
                            largest = if size > largest { size } else { largest };
                        }
                    }
                }
            }
            if volume == 0.0 {
                continue;
            }
            let start = self.weights.len();
            // A part has few of the places: the others are passed by, sixty-four at a time.
            for (word, bits) in self.summed.iter_mut().enumerate() {
                while *bits != 0 {
                    let place = 64 * word + bits.trailing_zeros() as usize;
                    *bits &= *bits - 1;
                    let sum = std::mem::take(&mut self.sums[place]);
                    // Inside of the part the shares of a node's elements cancel.
                    if sum.iter().any(|value| value.abs() > 1e-5 * largest) {
                        memory::push(&mut self.weights, (place as u32, sum), WHAT)?;
                    }
                }
            }
            let node = |place: u32| nodes[place as usize];
            self.weights[start..].sort_unstable_by_key(|(place, _)| node(*place));
            let part = Part {
                cluster,
                volume,
                weights: start..self.weights.len(),
            };
            memory::push(&mut self.list, part, WHAT)?;
        }
        Ok(())
    }

    /// Puts the elements in the order of their clusters, those of one in their own.
    fn sort(&mut self, elements: &LinearElements, clusters: usize) -> Result<()> {
        self.ends.clear();
        memory::fit(&mut self.ends, clusters, WHAT)?;
        self.ends.resize(clusters, 0);
        self.order.clear();
        memory::fit(&mut self.order, elements.len(), WHAT)?;
        self.order.resize(elements.len(), 0);
        for element in &elements.all {
            self.ends[element.cluster as usize] += 1;
        }
        let mut start = 0;
        for end in &mut self.ends {
            start += std::mem::replace(end, start);
        }
        for (at, element) in elements.all.iter().enumerate() {
            // The start of a cluster moves to its end while it is filled.
            let place = &mut self.ends[element.cluster as usize];
            self.order[*place as usize] = at as u32;
            *place += 1;
        }
        Ok(())
    }

    /// All parts, by cluster.
    pub fn iter(&self) -> impl Iterator<Item = &Part> + '_ {
        self.list.iter()
    }

    /// The weights of a part: a place, and `sum_e v_e grad N` there.
    pub fn weights(&self, part: &Part) -> &[(u32, [f32; 3])] {
        &self.weights[part.weights.clone()]
    }
}
