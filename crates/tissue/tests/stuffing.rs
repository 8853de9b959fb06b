//! Isosurface stuffing: no slivers, a manifold boundary, the right volume, the same bits.
#![cfg(feature = "files")]

use tissue::mesh::Mesh;
use tissue::mesh_import::{RawTets, from_tets};
use tissue::mesh_quality::measure;
use tissue::stuffing::{Field, GridField, HalfSpace, StuffError, Stuffed, stuff, stuff_graded};

struct Ball {
    centre: [f64; 3],
    radius: f64,
}

impl Field for Ball {
    fn value(&self, p: [f64; 3]) -> f64 {
        let squared: f64 = (0..3).map(|k| (p[k] - self.centre[k]).powi(2)).sum();
        self.radius - squared.sqrt()
    }

    fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        (
            self.centre.map(|x| x - self.radius),
            self.centre.map(|x| x + self.radius),
        )
    }
}

/// Two balls that touch the lattice in all ways while one moves.
struct Pair(Ball, Ball);

impl Field for Pair {
    fn value(&self, p: [f64; 3]) -> f64 {
        self.0.value(p).max(self.1.value(p))
    }

    fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        let (low, high) = self.0.bounds();
        let (other_low, other_high) = self.1.bounds();
        (
            [0, 1, 2].map(|k| low[k].min(other_low[k])),
            [0, 1, 2].map(|k| high[k].max(other_high[k])),
        )
    }
}

const BALL: Ball = Ball {
    centre: [0.31, 1.17, -0.73],
    radius: 20.0,
};

fn mesh(made: Stuffed) -> Mesh {
    let raw = RawTets {
        positions: made.positions,
        tets: made.tets,
    };
    from_tets(raw, false, &mut Vec::new()).expect("a stuffed body passes every check")
}

#[test]
fn dihedral_angles_of_a_ball_stay_clear_of_0_and_180_degrees() {
    // Labelle and Shewchuk prove 10.78 and 164.74 degrees for these alphas.
    for step in 0..12 {
        let quality = measure(&mesh(stuff(&BALL, 3.0 + 0.37 * f64::from(step)).unwrap()));
        assert!(quality.min_dihedral_deg > 10.78, "{quality:?}");
        assert!(quality.max_dihedral_deg < 164.75, "{quality:?}");
        assert_eq!(quality.components, 1);
        assert_eq!(quality.euler_characteristic, 2);
        assert!(quality.non_manifold_edges.is_empty());
        assert!(quality.non_manifold_nodes.is_empty());
    }
}

#[test]
fn volume_converges_with_the_square_of_the_spacing() {
    let exact = 4.0 / 3.0 * std::f64::consts::PI * BALL.radius.powi(3);
    let error = |spacing: f64| {
        let volume = measure(&mesh(stuff(&BALL, spacing).unwrap())).volume_mm3;
        (volume / exact - 1.0).abs()
    };
    let (coarse, fine) = (error(6.0), error(2.0));
    assert!(coarse < 0.05, "{coarse}");
    assert!(fine < coarse / 6.0, "{fine} is not far below {coarse}");
}

#[test]
fn surface_nodes_lie_on_the_surface() {
    let mesh = mesh(stuff(&BALL, 4.0).unwrap());
    for &node in mesh.surface.iter().flatten() {
        let distance = BALL.value(mesh.positions[node as usize].map(f64::from));
        assert!(distance.abs() < 1e-4, "node {node} is {distance} mm off");
    }
}

#[test]
fn touching_parts_are_parted_or_joined_but_never_left_hanging() {
    let mut dropped = 0;
    for step in 0..40 {
        let gap = -1.0 + 0.1 * f64::from(step);
        let pair = Pair(
            Ball {
                centre: [0.0; 3],
                radius: 9.0,
            },
            Ball {
                centre: [15.0 + gap, 0.7, 0.3],
                radius: 6.0,
            },
        );
        let made = stuff(&pair, 2.5).unwrap();
        dropped += made.dropped;
        let quality = measure(&mesh(made));
        assert_eq!(quality.components, 1, "gap {gap}");
        assert!(quality.non_manifold_edges.is_empty(), "gap {gap}");
        assert!(quality.non_manifold_nodes.is_empty(), "gap {gap}");
    }
    assert!(dropped > 0, "the sweep never touched, so it tests nothing");
}

#[test]
fn the_same_field_gives_the_same_bits() {
    assert_eq!(stuff(&BALL, 3.3).unwrap(), stuff(&BALL, 3.3).unwrap());
}

#[test]
fn two_halves_share_their_plane_node_by_node() {
    let half = |sign: f64| {
        let field = HalfSpace {
            inner: BALL,
            normal: [sign, 0.0, 0.0],
            offset: 0.0,
        };
        let made = stuff(&field, 3.0).unwrap();
        let mut plane: Vec<[u64; 2]> = made
            .positions
            .iter()
            .filter(|p| p[0] == 0.0)
            // Away from the rim, where the ball's own surface moves nodes.
            .filter(|p| BALL.value(**p) > 3.0)
            .map(|p| [p[1].to_bits(), p[2].to_bits()])
            .collect();
        plane.sort_unstable();
        plane
    };
    let left = half(-1.0);
    assert!(left.len() > 100);
    assert_eq!(left, half(1.0));
}

#[test]
fn a_grid_is_trilinear_between_samples() {
    let shape = [4, 5, 6];
    let mut values = Vec::new();
    for x in 0..4 {
        for y in 0..5 {
            for z in 0..6 {
                values.push(2.0 * x as f32 - 3.0 * y as f32 + 0.5 * z as f32);
            }
        }
    }
    let grid = GridField {
        origin: [10.0, 20.0, 30.0],
        voxel: 2.0,
        shape,
        values,
    };
    let value = grid.value([10.0 + 2.0 * 1.25, 20.0 + 2.0 * 3.5, 30.0 + 2.0 * 4.75]);
    let expected = 2.0 * 1.25 - 3.0 * 3.5 + 0.5 * 4.75;
    assert!((value - expected).abs() < 1e-12, "{value} {expected}");
}

#[test]
fn unusable_input_is_refused() {
    assert_eq!(stuff(&BALL, 0.0), Err(StuffError::Spacing(0.0)));
    assert!(matches!(stuff(&BALL, 1e-4), Err(StuffError::TooLarge(..))));
    let far = HalfSpace {
        inner: BALL,
        normal: [1.0, 0.0, 0.0],
        offset: -100.0,
    };
    assert_eq!(stuff(&far, 3.0), Err(StuffError::Empty(3.0)));
    let broken = HalfSpace {
        inner: BALL,
        normal: [f64::INFINITY, 0.0, 0.0],
        offset: 0.0,
    };
    assert!(matches!(
        stuff(&broken, 3.0),
        Err(StuffError::NotFinite { .. })
    ));
}

#[test]
fn a_lattice_that_is_finer_in_a_corner_leaves_no_gap_and_no_sliver() {
    for step in 0..6 {
        let spacing = 5.0 + 0.3 * f64::from(step);
        // Four times finer where x is above 10 mm.
        let fine = |corners: [[f64; 3]; 4], size: f64| {
            size > 0.25 * spacing && corners.iter().any(|p| p[0] > 10.0)
        };
        let made = stuff_graded(&BALL, spacing, fine).unwrap();
        let uniform = stuff_graded(&BALL, spacing, |_, _| false).unwrap();
        assert!(made.positions.len() > 2 * uniform.positions.len());
        let quality = measure(&mesh(made));
        assert!(
            quality.min_dihedral_deg > 4.0,
            "{spacing}: {}",
            quality.min_dihedral_deg
        );
        assert_eq!(quality.components, 1);
        // A gap would be a second sheet of the boundary.
        assert_eq!(quality.euler_characteristic, 2, "{spacing}");
        assert!(quality.non_manifold_edges.is_empty(), "{spacing}");
        let exact = 4.0 / 3.0 * std::f64::consts::PI * BALL.radius.powi(3);
        assert!((quality.volume_mm3 / exact - 1.0).abs() < 0.04, "{spacing}");
    }
}
