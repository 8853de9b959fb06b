//! What acts on a cut body from outside: whose tissue a force on a node takes, and where pressure acts.

mod block;

use block::{block, open_edges, rest};
use std::sync::Arc;
use topology::{Body, Point, Surface, Sweep};

fn crossing() -> Body {
    let mesh = block([6, 5, 4], 5.0, 0.25);
    let mut body = Body::new(Arc::clone(&mesh));
    // The last one through nodes.
    for (stroke, x, lean) in [(0, 12.3, 1.0), (1, 18.9, 1.0), (2, 5.0, 0.0)] {
        let poses = [
            vec![[x, -2.0, 21.0], [x + 3.0 * lean, -2.0, 8.0]],
            vec![[x + 4.0 * lean, 19.0, 21.0], [x + 5.0 * lean, 19.0, 8.0]],
        ];
        let sweep = Sweep::new(&poses).unwrap();
        body.cut(&sweep, stroke, &rest(&body)).unwrap();
    }
    let depth = |at: Point| {
        let off: f64 = (at.iter().zip([30.0, 25.0, 20.0]))
            .map(|(a, b)| (a - b).powi(2))
            .sum();
        9.5 - off.sqrt()
    };
    body.remove(depth, f64::MAX, &rest(&body)).unwrap();
    body
}

/// Whatever way a closed surface is deformed, its area vectors sum to nothing, and the border is all there but where tissue is gone.
#[test]
fn pressure_acts_on_a_closed_surface() {
    let body = crossing();
    let mesh = body.mesh();
    let moved = |node: u32| -> Point {
        let at = mesh.position(body.parent(node));
        // Copies go their own way: the slit is open.
        let own = f64::from(node % 7) * 0.1;
        [
            at[0] + own,
            at[1] + 0.02 * at[0] * at[2] - own,
            at[2] + 0.3 * own,
        ]
    };
    let twice = |[a, b, c]: [Point; 3]| -> Point {
        let (p, q) = (
            [0, 1, 2].map(|k| b[k] - a[k]),
            [0, 1, 2].map(|k| c[k] - a[k]),
        );
        [
            p[1] * q[2] - p[2] * q[1],
            p[2] * q[0] - p[0] * q[2],
            p[0] * q[1] - p[1] * q[0],
        ]
    };
    let size = |v: Point| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let (mut sum, mut walls, mut outer, mut whole) = ([0.0; 3], 0.0, 0.0, 0.0);
    for (element, face) in mesh.border(|_| true).unwrap() {
        let tet = mesh.tet(element);
        let corners = topology::rest::FACES[usize::from(face)].map(|corner| tet[corner]);
        let own = twice(corners.map(|node| mesh.position(node)));
        whole += size(own);
        if !body.is_touched(element) {
            outer += size(own);
            let own = twice(corners.map(moved));
            sum = [0, 1, 2].map(|k| sum[k] + own[k]);
        }
    }
    let mut surface = Surface::new(mesh).unwrap();
    surface.update(&body).unwrap();
    assert_eq!(open_edges(&surface), 0);
    let skin = body.skin().unwrap();
    for triangle in &skin.triangles {
        let at = |position: &dyn Fn(u32) -> Point| {
            triangle.corners.map(|corner| {
                let own = skin.vertices[corner as usize];
                let parts = own.nodes.iter().zip(own.weights).filter(|(_, w)| *w > 0.0);
                parts.fold([0.0; 3], |sum, (node, weight)| {
                    let at = position(*node);
                    [0, 1, 2].map(|k| sum[k] + weight * at[k])
                })
            })
        };
        let own = twice(at(&moved));
        sum = [0, 1, 2].map(|k| sum[k] + own[k]);
        let own = size(twice(at(&|node| mesh.position(body.parent(node)))));
        match triangle.border {
            Some(_) => outer += own,
            None => walls += own,
        }
    }
    assert!(size(sum) < 1e-9 * whole, "{sum:?}");
    assert!(outer < whole && outer > 0.8 * whole, "{outer} of {whole}");
    assert!(walls > 0.2 * whole, "{walls}");
}

#[test]
fn a_force_goes_to_the_tissue_that_is_there() {
    let body = crossing();
    let mesh = body.mesh();
    let mut parts = Vec::new();
    let mut count = [0; 3];
    for node in 0..mesh.node_count() as u32 {
        body.carriers(node, &mut parts).unwrap();
        count[parts.len().min(2)] += 1;
        let sum: f64 = parts.iter().map(|part| part.1).sum();
        assert!(parts.is_empty() || (sum - 1.0).abs() < 1e-12);
        assert!(
            parts
                .iter()
                .all(|part| body.parent(part.0) == node && part.1 > 0.0)
        );
        // None but where nothing is left.
        let around = mesh.around(node).iter();
        let is_left = around
            .flat_map(|e| body.cells(*e).into_owned())
            .any(|c| c.is_alive);
        assert_eq!(parts.is_empty(), !is_left);
    }
    // Some lie on a blade and some in the hole.
    assert!(count[0] > 0 && count[1] > 100 && count[2] > 0, "{count:?}");
}
