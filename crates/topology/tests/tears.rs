//! Tissue that parts where it is stretched too far.

mod block;

use std::sync::Arc;

use block::{block, open_edges, rest};
use topology::{Body, Change, Point, Surface, TopologyError};

/// A bar along x, 60 by 15 by 15 mm, pulled out to 1.6 times its length between 25 and 35 mm, and bent by nothing.
fn pulled(body: &Body) -> Vec<Point> {
    let pull = |[x, y, z]: Point| [x + 0.6 * (x - 25.0).clamp(0.0, 10.0), y, z];
    rest(body).into_iter().map(pull).collect()
}

#[test]
fn a_bar_parts_across_its_pull_where_it_is_longest() {
    let mesh = block([12, 3, 3], 5.0, 0.1);
    let mut body = Body::new(Arc::clone(&mesh));
    let whole = body.volume();
    // Nowhere as long as that.
    let none = body.tear(1.9, 100, 0, &pulled(&body)).unwrap();
    assert_eq!(none, Change::default());
    assert!(body.is_intact());
    let one = body.tear(1.4, 1, 0, &pulled(&body)).unwrap();
    // The cross-section of an element at least, and no more than that of its neighbours.
    assert!((2.0..120.0).contains(&one.area_mm2), "{}", one.area_mm2);
    let mut area = one.area_mm2;
    for _ in 0..200 {
        let more = body.tear(1.4, 1, 0, &pulled(&body)).unwrap();
        area += more.area_mm2;
        if more == Change::default() {
            break;
        }
    }
    assert!((body.volume() - whole).abs() < 1e-10 * whole);
    assert!(area > 225.0, "{area}");
    // Only about the part that is pulled, and all the way through.
    for element in body.changed_elements() {
        let corners = mesh.tet(element).map(|node| mesh.position(node)[0]);
        let near = |x: f64| (19.0..=41.0).contains(&x);
        assert!(corners.into_iter().all(near), "{corners:?}");
    }
    let is_left = |node| mesh.position(body.parent(node))[0] < 1.0;
    let loose = body.fragments(is_left).unwrap();
    let most = loose
        .iter()
        .map(|piece| piece.volume_mm3)
        .fold(0.0, f64::max);
    assert!(most > 225.0 * 24.0, "{loose:?}");
    let mut surface = Surface::new(&mesh).unwrap();
    surface.update(&body).unwrap();
    assert_eq!(open_edges(&surface), 0);
}

#[test]
fn what_cannot_tear_is_refused() {
    let mut body = Body::new(block([2, 2, 2], 5.0, 0.0));
    let places = rest(&body);
    for stretch in [1.0, 0.5, f64::NAN, f64::INFINITY] {
        let refused = body.tear(stretch, 1, 0, &places).unwrap_err();
        let is_stretch = matches!(refused, TopologyError::Stretch { .. });
        assert!(is_stretch, "{refused}");
    }
    let refused = body.tear(1.5, 1, 0, &places[1..]).unwrap_err();
    assert!(matches!(refused, TopologyError::Positions { .. }));
    assert!(body.is_intact());
}
