//! Where tools may touch a block that has been cut.

mod block;

use std::sync::Arc;

use block::{block, open_edges, rest};
use topology::{Body, Point, Surface, Sweep, Touchable};

/// A blade through the plane x = 13.1, from z = 6 upward, from y = 6 to y = 14.
fn slit() -> Sweep {
    let edge = |y: f64| vec![[13.1, y, 31.0], [13.1, y, 6.0]];
    Sweep::new(&[edge(6.0), edge(14.0)]).unwrap()
}

/// Twice the area vectors of the pieces from `first` to `last`, summed, and the sum of their lengths.
fn sums(body: &Body, touchable: &Touchable, range: std::ops::Range<usize>) -> (Point, f64) {
    let place = |corner: u32| -> Point {
        let (nodes, weights) = touchable.corners[corner as usize];
        let mut at = [0.0; 3];
        for (node, weight) in nodes.into_iter().zip(weights) {
            let corner = body.mesh().position(body.parent(node));
            at = [0, 1, 2].map(|k| at[k] + f64::from(weight) * corner[k]);
        }
        at
    };
    let (mut sum, mut size) = ([0.0; 3], 0.0);
    for piece in &touchable.pieces[range] {
        let [a, b, c] = piece.map(place);
        let [p, q] = [b, c].map(|end| [0, 1, 2].map(|k| end[k] - a[k]));
        let area =
            [0, 1, 2].map(|k| p[(k + 1) % 3] * q[(k + 2) % 3] - p[(k + 2) % 3] * q[(k + 1) % 3]);
        size += area.iter().map(|x| x * x).sum::<f64>().sqrt();
        sum = [0, 1, 2].map(|k| sum[k] + area[k]);
    }
    (sum, size)
}

#[test]
fn walls_are_touched_on_both_sides_of_a_blade() {
    let mesh = block([5, 4, 6], 5.0, 0.2);
    let mut body = Body::new(Arc::clone(&mesh));
    let whole = body.touchable(|_| true).unwrap();
    assert!(whole.pieces.is_empty() && whole.corners.is_empty());
    let change = body.cut(&slit(), 0, &rest(&body)).unwrap();
    let touchable = body.touchable(|_| true).unwrap();
    let walls = touchable.first_wall..touchable.pieces.len();
    let (sum, size) = sums(&body, &touchable, walls.clone());
    // Both walls look into the slit: their area vectors balance, and each is the blade's area and what of the elements lies beyond it.
    assert!(sum.iter().all(|x| x.abs() < 0.05 * size), "{sum:?} {size}");
    let area = 0.25 * size;
    assert!(
        area > 0.9 * change.area_mm2 && area < 2.0 * change.area_mm2,
        "{area} {}",
        change.area_mm2
    );
    // What of the border is in pieces has the area that it had, but for triangles that are too small.
    let (_, outer) = sums(&body, &touchable, 0..touchable.first_wall);
    let was = 25.0 * (whole.faces.len() - touchable.faces.len()) as f64;
    assert!(outer < was + 0.5 && outer > 0.9 * was, "{outer} {was}");
    // Corners lie within one element's nodes, with weights that sum to 1, and each wall has its own.
    for (nodes, weights) in &touchable.corners {
        assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-5);
        assert!(
            nodes
                .iter()
                .all(|node| (*node as usize) < body.node_count())
        );
    }
    assert!(
        touchable
            .nodes()
            .any(|node| node as usize >= mesh.node_count())
    );
    let mut surface = Surface::new(&mesh).unwrap();
    surface.update(&body).unwrap();
    assert_eq!(open_edges(&surface), 0);
    // Without the border's top only the walls are left of what was cut.
    let none = body.touchable(|_| false).unwrap();
    assert_eq!((none.first_wall, none.faces.len()), (0, 0));
    assert_eq!(none.pieces.len(), walls.len());
}
