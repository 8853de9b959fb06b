//! Where programmes of cuts are made: a flat place of the domain, drawn from a seed.

use contact::Vector;
use upt::Scene;

/// A place is flat where the surface this near to it looks the same way.
const FLAT_MM: f32 = 12.0;

/// A flat place of the domain.
#[derive(Clone, Copy, Debug)]
pub struct Site {
    at: Vector,
    pub normal: Vector,
    along: Vector,
    across: Vector,
}

impl Site {
    /// The place of a seed, among the flattest tenth of the domain; none where the domain is small.
    pub fn of(scene: &Scene, seed: u64) -> Option<Site> {
        let mesh = scene.mesh();
        let at = |node: u32| Vector::from_slice(&mesh.positions[3 * node as usize..][..3]);
        let faces: Vec<(Vector, Vector)> = (mesh.domain.faces.chunks_exact(3))
            .map(|face| {
                let [a, b, c] = [0, 1, 2].map(|k| at(face[k]));
                ((a + b + c) / 3.0, (b - a).cross(c - a))
            })
            .collect();
        let mut rated: Vec<(f32, u32, Vector)> = (mesh.domain.nodes.iter())
            .map(|&node| {
                let near = faces
                    .iter()
                    .filter(|(middle, _)| (*middle - at(node)).length() < FLAT_MM);
                let (sum, size) = near.fold((Vector::ZERO, 0.0), |(sum, size), (_, area)| {
                    (sum + *area, size + area.length())
                });
                // A domain that ends here has less of it.
                (sum.length() - 0.5 * size, node, sum)
            })
            .collect();
        rated.sort_by(|a, b| b.0.total_cmp(&a.0));
        let best = rated.len().div_ceil(10);
        let step = (0x9E37_79B9_7F4A_7C15_u64.wrapping_mul(seed) >> 33) as usize;
        let (_, node, sum) = *rated.get(step % best.max(1))?;
        let normal = sum.normalize_or_zero();
        let along = normal.any_orthonormal_vector();
        Some(Site {
            at: at(node),
            normal,
            along,
            across: normal.cross(along),
        })
    }

    /// Of the places of 40 seeds the farthest from this one.
    pub fn another(&self, scene: &Scene) -> Option<Site> {
        let sites = (1..=40).filter_map(|seed| Site::of(scene, seed));
        let far = |site: &Site| (site.at - self.at).length();
        sites.max_by(|a, b| far(a).total_cmp(&far(b)))
    }

    pub fn distance(&self, place: [f32; 3]) -> f32 {
        (Vector::from(place) - self.at).length()
    }

    /// Where the ball waits.
    pub fn away(&self) -> [f32; 3] {
        self.place(0.0, 0.0, 35.0)
    }

    pub fn place(&self, ahead: f32, aside: f32, above: f32) -> [f32; 3] {
        let at = self.at + self.along * ahead + self.across * aside + self.normal * above;
        at.to_array()
    }

    /// An edge that stands upright, from below to 6 mm above the tissue.
    pub fn upright(&self, ahead: f32, aside: f32, depth: f32) -> [[f32; 3]; 2] {
        [
            self.place(ahead, aside, -depth),
            self.place(ahead, aside, 6.0),
        ]
    }
}
