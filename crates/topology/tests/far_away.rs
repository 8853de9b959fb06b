//! A cut far from the origin.

mod block;

use std::sync::Arc;

use block::{block, open_edges, rest};
use topology::{Body, Surface, Sweep};

/// Elements are looked for in f32, whose steps are eight millimetres there.
#[test]
fn a_body_far_from_the_origin_is_cut_in_the_same_elements() {
    const FAR: f64 = (1u64 << 27) as f64;
    let mesh = block([6, 4, 3], 5.0, 0.2);
    let cut = |off: f64| {
        let mut body = Body::new(Arc::clone(&mesh));
        let mut positions = rest(&body);
        positions.iter_mut().flatten().for_each(|x| *x += off);
        let edge = |y: f64| vec![[14.3, y, 30.0], [14.3, y, 4.0]];
        let moved = |edge: Vec<[f64; 3]>| edge.iter().map(|at| at.map(|x| x + off)).collect();
        let way = Sweep::new(&[3.0, 12.0].map(edge).map(moved)).unwrap();
        let change = body.cut(&way, 0, &positions).unwrap();
        let mut surface = Surface::new(&mesh).unwrap();
        surface.update(&body).unwrap();
        assert_eq!(open_edges(&surface), 0, "{off}");
        change
    };
    let (near, far) = (cut(0.0), cut(FAR));
    assert!(!near.elements.is_empty());
    assert_eq!(near.elements, far.elements);
    assert!(
        (near.area_mm2 - far.area_mm2).abs() < 1e-3,
        "{near:?} {far:?}"
    );
}
