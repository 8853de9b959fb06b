//! Reaction at the contact nodes from a displacement field, for haptics.
//!
//! The nodal force is the derivative of the elements' strain energy: with `F = I + du/dX` constant on
//! a tetrahedron of rest volume `V` and shape gradients `g_a`,
//! `f_a = V P g_a`, `P = F S = mu J^(-2/3) (F - I1/(3 J) cof F) + kappa (J - 1) cof F`, which is
//! `S = mu J^(-2/3) (I - I1/3 C^-1) + kappa J (J - 1) C^-1`. The tissue pushes an instrument that
//! holds node `a` with `-sum f_a` over the elements around it; inertia and damping of the node itself
//! are left out. Forces are mN, lengths mm, moduli Pa (1 Pa mm² = 1e-3 mN); all arithmetic in f64.

use crate::error::{Error, Result};

/// Neo-Hookean moduli.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moduli {
    /// Shear modulus `mu = E / (2 (1 + nu))`, Pa.
    pub shear_pa: f64,
    /// Bulk modulus `kappa = E / (3 (1 - 2 nu))`, Pa.
    pub bulk_pa: f64,
}

impl Moduli {
    /// From Young's modulus, Pa, and Poisson's ratio below 0.5.
    pub fn from_young(young_pa: f64, poisson: f64) -> Self {
        Self {
            shear_pa: young_pa / (2.0 * (1.0 + poisson)),
            bulk_pa: young_pa / (3.0 * (1.0 - 2.0 * poisson)),
        }
    }
}

/// A tetrahedron's corners, rest volume (mm³) times its stiffness over the material's, and gradients of its shape functions 1, 2, 3 (1/mm);
/// the gradient of shape function 0 is minus their sum.
#[derive(Debug, Clone, Copy)]
struct Element {
    corners: [u32; 4],
    volume: f64,
    gradients: [[f64; 3]; 3],
}

/// What is known of the elements around the nodes that can be in contact; made once a mesh.
#[derive(Debug)]
pub struct ReactionForces {
    moduli: Moduli,
    elements: Vec<Element>,
    /// Rows of `around`, one a mesh node (empty for nodes that cannot be in contact).
    offsets: Vec<u32>,
    around: Vec<u32>,
    /// Entry in the asked list plus one, for a node that is asked for; 0 otherwise.
    entry_of_node: Vec<u32>,
    /// Last call that visited the element.
    visited: Vec<u32>,
    call: u32,
}

/// How the forces came out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ForceReport {
    /// Elements that were used.
    pub elements: usize,
    /// Of these, inverted ones (`det F <= 0`): forces near them mean little.
    pub inverted: usize,
}

/// Below this `det F` the isochoric factor is that of a nearly flat element, so that it stays finite.
const SMALLEST_DET: f64 = 0.05;

impl ReactionForces {
    /// Adjacency and gradients of the elements that touch `nodes` (the surface's, say).
    ///
    /// `positions [K,3]` mm, `tets [T,4]` of positive volume, `stiffness [T]` their Young's moduli over the
    /// material's or empty for a uniform body, `nodes` below `K`.
    pub fn new(
        positions: &[f32],
        tets: &[u32],
        stiffness: &[f32],
        nodes: &[u32],
        moduli: Moduli,
    ) -> Self {
        let node_count = positions.len() / 3;
        let mut wanted = vec![false; node_count];
        nodes.iter().for_each(|&node| wanted[node as usize] = true);
        let elements: Vec<Element> = tets
            .chunks_exact(4)
            .enumerate()
            .filter(|(_, tet)| tet.iter().any(|&node| wanted[node as usize]))
            .map(|(index, tet)| {
                let mut element = Element::new(positions, [tet[0], tet[1], tet[2], tet[3]]);
                element.volume *= stiffness
                    .get(index)
                    .map_or(1.0, |&factor| f64::from(factor));
                element
            })
            .collect();
        let mut offsets = vec![0u32; node_count + 1];
        let touches = || {
            elements.iter().enumerate().flat_map(|(e, element)| {
                let nodes = element.corners.into_iter().map(|node| node as usize);
                nodes.filter(|&n| wanted[n]).map(move |n| (e as u32, n))
            })
        };
        touches().for_each(|(_, node)| offsets[node + 1] += 1);
        for node in 0..node_count {
            offsets[node + 1] += offsets[node];
        }
        let mut around = vec![0; offsets[node_count] as usize];
        let mut next = offsets.clone();
        for (element, node) in touches() {
            around[next[node] as usize] = element;
            next[node] += 1;
        }
        Self {
            moduli,
            visited: vec![0; elements.len()],
            elements,
            offsets,
            around,
            entry_of_node: vec![0; node_count],
            call: 0,
        }
    }

    /// Appends the nodes of the elements around `nodes` (whose displacement [`Self::reaction`] reads) to
    /// `out`, ascending, each once. A node that is out of range is skipped.
    pub fn neighbourhood(&self, nodes: &[u32], out: &mut Vec<u32>) {
        for &node in nodes {
            if let Some(row) = self.offsets.get(node as usize..node as usize + 2) {
                let around = &self.around[row[0] as usize..row[1] as usize];
                out.extend(
                    around
                        .iter()
                        .flat_map(|&e| self.elements[e as usize].corners),
                );
            }
        }
        out.sort_unstable();
        out.dedup();
    }

    /// Force of the tissue on the instrument at each of `nodes`, mN, to `out [m,3]`.
    ///
    /// `displacement [K,3]` mm. Elements are summed in a fixed order. No allocation.
    ///
    /// # Errors
    /// [`Error::Argument`] for a wrong length, a node out of range or twice in the list;
    /// [`Error::NonFinite`] for a displacement that is not finite at an element used; `out` is then unspecified.
    pub fn reaction(
        &mut self,
        displacement: &[f32],
        nodes: &[u32],
        out: &mut [f32],
    ) -> Result<ForceReport> {
        let node_count = self.entry_of_node.len();
        if displacement.len() != 3 * node_count || out.len() != 3 * nodes.len() {
            return Err(Error::Argument(format!(
                "reaction: displacement has {} numbers and out {}; they must have {} and {}",
                displacement.len(),
                out.len(),
                3 * node_count,
                3 * nodes.len()
            )));
        }
        let mut listed = 0;
        let mut result = Ok(());
        for (entry, &node) in nodes.iter().enumerate() {
            match self.entry_of_node.get_mut(node as usize) {
                Some(slot) if *slot == 0 => *slot = entry as u32 + 1,
                found => {
                    let cause = if found.is_some() {
                        "twice"
                    } else {
                        "not a node"
                    };
                    result = Err(Error::Argument(format!("reaction: node {node} is {cause}")));
                    break;
                }
            }
            listed += 1;
        }
        let report = result.and_then(|()| self.sum(displacement, nodes, out));
        for &node in &nodes[..listed] {
            self.entry_of_node[node as usize] = 0;
        }
        report
    }

    fn sum(&mut self, displacement: &[f32], nodes: &[u32], out: &mut [f32]) -> Result<ForceReport> {
        if self.call == u32::MAX {
            self.visited.fill(0);
            self.call = 0;
        }
        self.call += 1;
        out.fill(0.0);
        let mut report = ForceReport {
            elements: 0,
            inverted: 0,
        };
        for &node in nodes {
            let row =
                self.offsets[node as usize] as usize..self.offsets[node as usize + 1] as usize;
            for &e in &self.around[row] {
                if std::mem::replace(&mut self.visited[e as usize], self.call) == self.call {
                    continue;
                }
                let element = &self.elements[e as usize];
                let (forces, det) = element.forces(displacement, self.moduli);
                if !det.is_finite() {
                    return Err(Error::NonFinite(format!(
                        "reaction: displacement around node {node} is not finite"
                    )));
                }
                report.elements += 1;
                report.inverted += usize::from(det <= 0.0);
                for (corner, force) in element.corners.iter().zip(forces) {
                    let entry = self.entry_of_node[*corner as usize] as usize;
                    if entry > 0 {
                        for axis in 0..3 {
                            out[3 * (entry - 1) + axis] -= (1e-3 * force[axis]) as f32;
                        }
                    }
                }
            }
        }
        Ok(report)
    }
}

impl Element {
    fn new(positions: &[f32], corners: [u32; 4]) -> Self {
        let point = |a: usize| {
            let at = 3 * corners[a] as usize;
            [0, 1, 2].map(|k| f64::from(positions[at + k]))
        };
        let origin = point(0);
        let edges = [1, 2, 3].map(|a| sub(point(a), origin));
        let normals = [
            cross(edges[1], edges[2]),
            cross(edges[2], edges[0]),
            cross(edges[0], edges[1]),
        ];
        let six_volumes = dot(edges[0], normals[0]);
        Self {
            corners,
            volume: six_volumes / 6.0,
            gradients: normals.map(|n| n.map(|x| x / six_volumes)),
        }
    }

    /// `V P g_a` of the four corners, 1e-3 mN, and `det F`.
    fn forces(&self, displacement: &[f32], moduli: Moduli) -> ([[f64; 3]; 4], f64) {
        let u = self.corners.map(|node| {
            let at = 3 * node as usize;
            [0, 1, 2].map(|k| f64::from(displacement[at + k]))
        });
        // Rows of F.
        let mut f = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        for a in 0..3 {
            let relative = sub(u[a + 1], u[0]);
            for (row, relative) in f.iter_mut().zip(relative) {
                for (f, gradient) in row.iter_mut().zip(self.gradients[a]) {
                    *f += relative * gradient;
                }
            }
        }
        let cofactor = [cross(f[1], f[2]), cross(f[2], f[0]), cross(f[0], f[1])];
        let det = dot(f[0], cofactor[0]);
        let invariant: f64 = f.iter().map(|row| dot(*row, *row)).sum();
        let safe = det.max(SMALLEST_DET);
        let isochoric = moduli.shear_pa / (safe * safe).cbrt();
        let along_cofactor = moduli.bulk_pa * (det - 1.0) - isochoric * invariant / (3.0 * safe);
        let mut forces = [[0.0; 3]; 4];
        for i in 0..3 {
            let row: [f64; 3] =
                [0, 1, 2].map(|j| isochoric * f[i][j] + along_cofactor * cofactor[i][j]);
            for a in 0..3 {
                let force = self.volume * dot(row, self.gradients[a]);
                forces[a + 1][i] = force;
                forces[0][i] -= force;
            }
        }
        (forces, det)
    }
}

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: Moduli = Moduli {
        shear_pa: 1000.0,
        bulk_pa: 5000.0,
    };

    /// A cube of `n³` cells, five tetrahedra each, edge `n` mm.
    fn cube(n: u32) -> (Vec<f32>, Vec<u32>) {
        let node = |x: u32, y: u32, z: u32| x + (n + 1) * (y + (n + 1) * z);
        let mut positions = Vec::new();
        for z in 0..=n {
            for y in 0..=n {
                for x in 0..=n {
                    positions.extend([x as f32, y as f32, z as f32]);
                }
            }
        }
        let mut tets = Vec::new();
        for z in 0..n {
            for y in 0..n {
                for x in 0..n {
                    let c = |i: u32| node(x + (i & 1), y + (i >> 1 & 1), z + (i >> 2));
                    let odd = [
                        [0, 3, 5, 1],
                        [0, 6, 3, 2],
                        [0, 5, 6, 4],
                        [3, 6, 5, 7],
                        [0, 3, 6, 5],
                    ];
                    let even = [
                        [1, 2, 4, 0],
                        [1, 7, 2, 3],
                        [1, 4, 7, 5],
                        [2, 7, 4, 6],
                        [1, 2, 7, 4],
                    ];
                    for tet in if (x + y + z) % 2 == 0 { odd } else { even } {
                        let mut tet = tet.map(c);
                        if Element::new(&positions, tet).volume < 0.0 {
                            tet.swap(0, 1);
                        }
                        tets.extend(tet);
                    }
                }
            }
        }
        (positions, tets)
    }

    fn energy(positions: &[f32], tets: &[u32], u: &[f32], moduli: Moduli) -> f64 {
        tets.chunks_exact(4)
            .map(|t| {
                let element = Element::new(positions, [t[0], t[1], t[2], t[3]]);
                let x = |a: usize| {
                    let at = 3 * t[a] as usize;
                    [0, 1, 2].map(|k| f64::from(positions[at + k]) + f64::from(u[at + k]))
                };
                let edges = [1, 2, 3].map(|a| sub(x(a), x(0)));
                let det = dot(edges[0], cross(edges[1], edges[2])) / (6.0 * element.volume);
                // I1 = |F|², F = sum edge_a (outer) gradient_a.
                let f = |i: usize, j: usize| -> f64 {
                    let pairs = edges.iter().zip(&element.gradients);
                    pairs.map(|(edge, gradient)| edge[i] * gradient[j]).sum()
                };
                let invariant: f64 = (0..9).map(|k| f(k / 3, k % 3).powi(2)).sum();
                let shear = moduli.shear_pa / 2.0 * (invariant / det.powf(2.0 / 3.0) - 3.0);
                element.volume * (shear + moduli.bulk_pa / 2.0 * (det - 1.0).powi(2))
            })
            .sum()
    }

    fn wavy(positions: &[f32], size: f32) -> Vec<f32> {
        let wave =
            |(i, x): (usize, &f32)| size * (x * (1.3 + 0.2 * (i % 3) as f32) + i as f32).sin();
        positions.iter().enumerate().map(wave).collect()
    }

    #[test]
    fn forces_are_the_derivative_of_the_energy() {
        let (positions, tets) = cube(3);
        let nodes: Vec<u32> = (0..positions.len() as u32 / 3).collect();
        let mut forces = ReactionForces::new(&positions, &tets, &[], &nodes, UNIT);
        let mut u = wavy(&positions, 0.08);
        let mut out = vec![0.0; positions.len()];
        let report = forces.reaction(&u, &nodes, &mut out).unwrap();
        assert_eq!((report.elements, report.inverted), (tets.len() / 4, 0));
        for dof in [0, 7, 50, 101, 190] {
            let (step, start) = (1e-2f32, u[dof]);
            u[dof] = start + step;
            let up = energy(&positions, &tets, &u, UNIT);
            let wide = f64::from(u[dof]);
            u[dof] = start - step;
            let down = energy(&positions, &tets, &u, UNIT);
            let slope = 1e-3 * (up - down) / (wide - f64::from(u[dof]));
            u[dof] = start;
            let got = f64::from(out[dof]);
            assert!(
                (got + slope).abs() < 2e-3 * slope.abs().max(0.05),
                "{dof}: {got} {slope}"
            );
        }
    }

    #[test]
    fn a_stretched_bar_pulls_with_the_closed_form() {
        // Uniform F = diag(a, b, b): P11 = mu J^(-2/3) (a - I1/(3 a)) + kappa (J - 1) J / a.
        let (positions, tets) = cube(2);
        let (a, b) = (1.2f64, 0.93f64);
        let mut u = positions.clone();
        for node in u.chunks_exact_mut(3) {
            node[0] *= (a - 1.0) as f32;
            node[1] *= (b - 1.0) as f32;
            node[2] *= (b - 1.0) as f32;
        }
        let face: Vec<u32> = (0..27).filter(|i| i % 3 == 2).collect();
        let mut out = vec![0.0; 27];
        let mut forces = ReactionForces::new(&positions, &tets, &[], &face, UNIT);
        forces.reaction(&u, &face, &mut out).unwrap();
        let (det, invariant) = (a * b * b, a * a + 2.0 * b * b);
        let stress = UNIT.shear_pa * det.powf(-2.0 / 3.0) * (a - invariant / (3.0 * a))
            + UNIT.bulk_pa * (det - 1.0) * det / a;
        let total: f64 = out.chunks_exact(3).map(|f| f64::from(f[0])).sum();
        let want = -1e-3 * stress * 4.0;
        assert!((total - want).abs() < 1e-5 * want.abs(), "{total} {want}");
    }

    #[test]
    fn a_subset_gives_the_same_forces_and_rest_gives_none() {
        let (positions, tets) = cube(3);
        let all: Vec<u32> = (0..64).collect();
        let some = [3, 0, 17, 60];
        let u = wavy(&positions, 0.1);
        let (mut whole, mut part) = (vec![0.0; 192], vec![0.0; 12]);
        ReactionForces::new(&positions, &tets, &[], &all, UNIT)
            .reaction(&u, &all, &mut whole)
            .unwrap();
        let mut forces = ReactionForces::new(&positions, &tets, &[], &some, UNIT);
        for _ in 0..3 {
            forces.reaction(&u, &some, &mut part).unwrap();
            for (entry, &node) in some.iter().enumerate() {
                for axis in 0..3 {
                    let (x, y) = (part[3 * entry + axis], whole[3 * node as usize + axis]);
                    assert!((x - y).abs() < 1e-5, "{x} {y}");
                }
            }
        }
        forces.reaction(&vec![0.0; 192], &some, &mut part).unwrap();
        assert!(part.iter().all(|f| f.abs() < 1e-6));
    }

    #[test]
    fn the_neighbourhood_is_what_the_forces_depend_on() {
        let (positions, tets) = cube(3);
        let nodes = [21, 63];
        let mut forces = ReactionForces::new(&positions, &tets, &[], &nodes, UNIT);
        let mut around = Vec::new();
        forces.neighbourhood(&nodes, &mut around);
        assert!(around.is_sorted() && around.contains(&21) && around.len() < 64);
        let u = wavy(&positions, 0.1);
        let mut reaction = |u: &[f32]| {
            let mut out = vec![0.0; 6];
            forces.reaction(u, &nodes, &mut out).map(|_| out)
        };
        let want = reaction(&u).unwrap();
        for node in 0..64u32 {
            let mut other = u.clone();
            other[3 * node as usize] += 0.05;
            let same = reaction(&other).unwrap() == want;
            assert_eq!(same, !around.contains(&node), "node {node}");
        }
    }

    #[test]
    fn wrong_input_is_an_error_and_the_next_call_works() {
        let (positions, tets) = cube(2);
        let mut forces = ReactionForces::new(&positions, &tets, &[], &[0, 1, 2], UNIT);
        let u = vec![0.0; 81];
        let mut out = [0.0; 6];
        assert!(matches!(
            forces.reaction(&u, &[1, 1], &mut out),
            Err(Error::Argument(_))
        ));
        assert!(matches!(
            forces.reaction(&u, &[1, 99], &mut out),
            Err(Error::Argument(_))
        ));
        assert!(matches!(
            forces.reaction(&u[1..], &[1, 2], &mut out),
            Err(Error::Argument(_))
        ));
        let mut bad = u.clone();
        bad[4] = f32::NAN;
        assert!(matches!(
            forces.reaction(&bad, &[1, 2], &mut out),
            Err(Error::NonFinite(_))
        ));
        assert!(forces.reaction(&u, &[1, 2], &mut out).is_ok());
        let mut inverted = u.clone();
        inverted[0] = 5.0;
        assert!(
            forces
                .reaction(&inverted, &[1, 2], &mut out)
                .unwrap()
                .inverted
                > 0
        );
        assert!(out.iter().all(|f| f.is_finite()));
    }
}
