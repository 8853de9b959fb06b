//! Cuts of a block: volume, path, parts, closed surfaces, ten thousand operations.

mod block;

use std::sync::Arc;

use block::{Draw, block, open_edges, rest};
use topology::elements::LEAST_SHARE;
use topology::{Blade, Body, Change, Point, Surface, Sweep, TopologyError};

/// A blade's edge of two points at two poses: the plane `x = at` from `z` upward, `y` from `y[0]` to `y[1]`.
fn plane(at: f64, y: [f64; 2], z: f64, top: f64) -> Sweep {
    Sweep::new(&[
        vec![[at, y[0], top], [at, y[0], z]],
        vec![[at, y[1], top], [at, y[1], z]],
    ])
    .unwrap()
}

/// Inside, mm, of a ball.
fn ball(middle: Point, radius: f64) -> impl Fn(Point) -> f64 {
    move |at| {
        let off: f64 = (0..3).map(|k| (at[k] - middle[k]).powi(2)).sum();
        radius - off.sqrt()
    }
}

#[test]
fn a_plane_through_a_block_makes_two_of_it() {
    let mesh = block([6, 4, 3], 5.0, 0.2);
    for at in [14.3, 15.0, 15.02, 12.5] {
        let mut body = Body::new(Arc::clone(&mesh));
        let whole = body.volume();
        let change = body
            .cut(&plane(at, [-9.0, 30.0], -9.0, 30.0), 0, &rest(&body))
            .unwrap();
        assert!((body.volume() - whole).abs() < 1e-10 * whole, "{at}");
        assert!(
            (change.area_mm2 - 300.0).abs() < 20.0,
            "{at}: {}",
            change.area_mm2
        );
        assert!(!change.copied.is_empty());
        let pieces = body.pieces().unwrap();
        assert_eq!(pieces.len(), 2, "{at}");
        let sum: f64 = pieces.iter().map(|piece| piece.volume_mm3).sum();
        assert!((sum - whole).abs() < 1e-10 * whole);
        assert!(body.elements().all(|element| element.share >= 0.1 - 1e-12));
        // Held at the left, the right part is loose.
        let is_left = |node| mesh.position(body.parent(node))[0] < 1.0;
        let loose = body.fragments(is_left).unwrap();
        assert_eq!(loose.len(), 1);
        assert!(
            (loose[0].volume_mm3 - 300.0 * (30.0 - at)).abs() < 150.0,
            "{at}: {loose:?}"
        );
        let mut surface = Surface::new(&mesh).unwrap();
        assert_eq!(open_edges(&surface), 0);
        surface.update(&body).unwrap();
        assert_eq!(open_edges(&surface), 0, "{at}");
    }
}

#[test]
fn a_slit_lies_on_the_blade_and_opens_to_its_depth() {
    let mesh = block([8, 6, 6], 5.0, 0.3);
    let mut body = Body::new(Arc::clone(&mesh));
    // Oblique, 16 mm long, 12 mm deep from the top at z = 30.
    let blade = Sweep::new(&[
        vec![[17.0, 7.0, 31.0], [19.0, 7.0, 18.0]],
        vec![[23.0, 23.0, 31.0], [25.0, 23.0, 18.0]],
    ])
    .unwrap();
    body.cut(&blade, 0, &rest(&body)).unwrap();
    assert_eq!(body.pieces().unwrap().len(), 1);
    let mut surface = Surface::new(&mesh).unwrap();
    let change = surface.update(&body).unwrap();
    assert_eq!(open_edges(&surface), 0);
    // Vertices of the lips: inside faces.
    let mut worst = 0.0f64;
    let mut lips = 0;
    for (triangle, inside) in surface.triangles.iter().zip(&surface.inside) {
        for vertex in triangle.iter().filter(|_| *inside) {
            let at = surface.place(*vertex, |node| mesh.position(body.parent(node)));
            worst = worst.max(blade.distance(at).abs());
            lips += 1;
        }
    }
    assert!(lips > 60, "{lips}");
    assert!(worst <= 0.5 + 1e-9, "{worst} mm");
    // What nothing has touched keeps its vertices and slots.
    let intact = Surface::new(&mesh).unwrap();
    let kept = (intact.triangles.iter().zip(&surface.triangles))
        .filter(|(a, b)| a == b)
        .count();
    assert!(kept > intact.triangles.len() / 2);
    assert!(change.triangles.len() < surface.triangles.len() / 2);
    let moved = intact.triangles.iter().zip(&surface.triangles).enumerate();
    for (slot, (a, b)) in moved {
        assert_eq!(a != b, change.triangles.contains(&(slot as u32)));
    }
    assert_eq!(surface.update(&body).unwrap().triangles, [0u32; 0]);
}

#[test]
fn a_blade_that_goes_on_cuts_as_one_that_came_at_once() {
    let mesh = block([6, 4, 3], 5.0, 0.25);
    let mut body = Body::new(Arc::clone(&mesh));
    let mut area = 0.0;
    for step in 0..40 {
        let y = f64::from(step) * 0.5;
        let sweep = plane(13.7, [y, y + 0.5], -1.0, 16.0);
        area += body.cut(&sweep, 3, &rest(&body)).unwrap().area_mm2;
    }
    let mut once = Body::new(Arc::clone(&mesh));
    let all = once
        .cut(&plane(13.7, [0.0, 20.0], -1.0, 16.0), 3, &rest(&once))
        .unwrap();
    assert_eq!(body.pieces().unwrap().len(), 2);
    assert!(
        (area - all.area_mm2).abs() < 0.03 * all.area_mm2,
        "{area} {}",
        all.area_mm2
    );
    let shares = |body: &Body| -> Vec<f64> { body.elements().map(|one| one.share).collect() };
    assert_eq!(shares(&body), shares(&once));
}

#[test]
fn curved_and_crossing_blades_part_what_they_enclose() {
    let mesh = block([8, 8, 4], 4.0, 0.25);
    let mut body = Body::new(Arc::clone(&mesh));
    let whole = body.volume();
    // A tube of 9 mm around the middle, in 24 poses, right through.
    let pose = |at: u32| {
        let angle = f64::from(at) * std::f64::consts::TAU / 24.0;
        let [x, y] = [16.0 + 9.0 * angle.cos(), 16.0 + 9.0 * angle.sin()];
        vec![[x, y, -1.0], [x, y, 17.0]]
    };
    let poses: Vec<_> = (0..=24).map(pose).collect();
    body.cut(&Sweep::new(&poses).unwrap(), 0, &rest(&body))
        .unwrap();
    let pieces = body.pieces().unwrap();
    assert_eq!(
        pieces.len(),
        2,
        "{:?}",
        pieces.iter().map(|p| p.volume_mm3).collect::<Vec<_>>()
    );
    let plug = std::f64::consts::PI * 81.0 * 16.0;
    let inner = pieces
        .iter()
        .map(|piece| piece.volume_mm3)
        .fold(f64::MAX, f64::min);
    assert!((inner - plug).abs() < 0.1 * plug, "{inner} {plug}");
    for (stroke, at) in [(1, 15.3), (2, 16.9)] {
        body.cut(&plane(at, [-1.0, 40.0], -1.0, 20.0), stroke, &rest(&body))
            .unwrap();
    }
    // Of the body 4 parts (the middle slab is one on either side of the tube), of the plug 3.
    assert_eq!(body.pieces().unwrap().len(), 7);
    assert!((body.volume() - whole).abs() < 1e-9 * whole);
}

#[test]
fn an_aspirator_takes_what_it_is_given_time_for() {
    let mesh = block([8, 8, 8], 4.0, 0.2);
    let mut body = Body::new(Arc::clone(&mesh));
    let whole = body.volume();
    let mut taken = 0.0;
    for _ in 0..10 {
        let change = body
            .remove(ball([16.0, 16.0, 16.0], 8.0), 100.0, &rest(&body))
            .unwrap();
        assert!(
            (change.removed_mm3 - 100.0).abs() < 10.0,
            "{}",
            change.removed_mm3
        );
        taken += change.removed_mm3;
        // What hangs by less is thrown by what touches it.
        let least = body.elements().map(|element| element.share);
        assert!(least.fold(1.0, f64::min) > LEAST_SHARE - 1e-9);
    }
    assert!((whole - taken - body.volume()).abs() < 1e-9 * whole);
    taken += body
        .remove(ball([16.0, 16.0, 16.0], 8.0), f64::MAX, &rest(&body))
        .unwrap()
        .removed_mm3;
    let volume = 4.0 / 3.0 * std::f64::consts::PI * 512.0;
    assert!((taken - volume).abs() < 0.03 * volume, "{taken} {volume}");
    let mut surface = Surface::new(&mesh).unwrap();
    surface.update(&body).unwrap();
    assert_eq!(open_edges(&surface), 0);
    assert!(surface.inside.iter().any(|inside| *inside));
}

#[test]
fn what_is_refused_changes_nothing() {
    let mesh = block([2, 2, 2], 5.0, 0.0);
    let edge = |z: f64| vec![[5.0, -1.0, z], [5.0, 11.0, z]];
    assert_eq!(Sweep::new(&[edge(0.0)]), Err(TopologyError::NoArea));
    assert_eq!(
        Sweep::new(&[edge(0.0), edge(0.0)]),
        Err(TopologyError::NoArea)
    );
    let mut poses = [edge(0.0), edge(1.0)];
    poses[1].pop();
    assert!(matches!(
        Sweep::new(&poses),
        Err(TopologyError::EdgeLength { index: 1, .. })
    ));
    poses = [edge(0.0), edge(f64::NAN)];
    let not_finite = TopologyError::NotFinite {
        field: "blade",
        index: 1,
    };
    assert_eq!(Sweep::new(&poses), Err(not_finite));
    let mut body = Body::new(Arc::clone(&mesh)).with_room(3);
    let sweep = Sweep::new(&[edge(-1.0), edge(11.0)]).unwrap();
    let full = body.cut(&sweep, 0, &rest(&body));
    assert!(matches!(full, Err(TopologyError::Room { .. })), "{full:?}");
    let all = body.remove(ball([5.0; 3], 100.0), f64::MAX, &rest(&body));
    assert_eq!(all, Err(TopologyError::NothingLeft));
    let factor = body.scale_stiffness(&[0], f32::NAN);
    assert!(matches!(factor, Err(TopologyError::Factor { .. })));
    assert!(matches!(
        body.scale_stiffness(&[99], 2.0),
        Err(TopologyError::Index { .. })
    ));
    assert!(matches!(
        body.cut(&sweep, 0, &[]),
        Err(TopologyError::Positions { .. })
    ));
    assert!(body.is_intact() && body.node_count() == mesh.node_count());
}

/// Verifies REQ-061.
#[test]
fn ten_thousand_operations_break_nothing() {
    let mesh = block([3, 2, 2], 5.0, 0.25);
    let whole = Body::new(Arc::clone(&mesh)).volume();
    let mut draw = Draw(11);
    let (mut refused, mut open) = (0, 0);
    for series in 0..2500 {
        let mut body = Body::new(Arc::clone(&mesh));
        let mut surface = Surface::new(&mesh).unwrap();
        let mut followed = surface.clone();
        let mut removed = 0.0;
        for step in 0..4 {
            let nodes = body.node_count();
            let mut at = |size: f64| {
                [15.0, 10.0, 10.0].map(|length| (draw.next() * size + 0.5 - 0.5 * size) * length)
            };
            let change = match (series + step) % 3 {
                0 => body.remove(ball(at(1.0), 3.0), 30.0, &rest(&body)),
                _ => {
                    let poses: Vec<_> = (0..3).map(|_| vec![at(1.4), at(1.4)]).collect();
                    body.cut(&Sweep::new(&poses).unwrap(), step, &rest(&body))
                }
            };
            match change {
                Ok(change) => {
                    removed += change.removed_mm3;
                    assert_eq!(body.node_count(), nodes + change.copied.len());
                    assert!(
                        change
                            .copied
                            .iter()
                            .enumerate()
                            .all(|(k, from)| (*from as usize) < nodes + k)
                    );
                }
                Err(_) => refused += 1,
            }
            if series % 10 == 0 {
                followed.update(&body).unwrap();
            }
        }
        assert!(
            (body.volume() + removed - whole).abs() < 1e-6 * whole,
            "series {series}: {} {removed} {whole}",
            body.volume()
        );
        let count = body.node_count();
        for element in body.elements() {
            assert!(element.nodes.iter().all(|node| (*node as usize) < count));
            assert!(element.share > 0.0 && element.share <= 1.0 + 1e-9);
            let parents = element.nodes.map(|node| body.parent(node));
            assert_eq!(parents, mesh.tet(element.parent));
        }
        let pieces: f64 = body
            .pieces()
            .unwrap()
            .iter()
            .map(|piece| piece.volume_mm3)
            .sum();
        assert!((pieces + removed - whole).abs() < 1e-6 * whole);
        if series % 10 == 0 {
            surface.update(&body).unwrap();
            open += open_edges(&surface) + open_edges(&followed);
            let counts = [&surface, &followed].map(|own| {
                let full = own.triangles.iter().filter(|corners| **corners != [0; 3]);
                full.count()
            });
            assert_eq!(counts[0], counts[1], "series {series}");
        }
        // What a snapshot keeps is taken again, also of halves that kept more than their part.
        let again = Body::of_kept(Arc::clone(&mesh), body.kept()).unwrap();
        assert_eq!(again.kept(), body.kept());
    }
    assert_eq!((refused, open), (0, 0));
}

/// The work of the blade is the fracture energy of what it has laid open, by whatever steps; on its way back it feels nothing.
#[test]
fn the_work_of_a_blade_is_the_energy_of_its_area() {
    let mesh = block([6, 4, 3], 5.0, 0.25);
    for step in [5.0, 1.0, 0.05] {
        let mut body = Body::new(Arc::clone(&mesh));
        let blade = Blade {
            energy: 40.0,
            threshold_mn: 90.0,
            pushed_mn: 100.0,
            ahead: [0.0, 2.0, 0.0],
        };
        let edge = |y: f64| vec![[13.7, y, 20.0], [13.7, y, 6.0]];
        // Pushed too little, aside or flat it does not begin.
        let first = Sweep::new(&[edge(-1.0), edge(1.0)]).unwrap();
        let weak = Blade {
            pushed_mn: 80.0,
            ..blade
        };
        let flat = Blade {
            ahead: [1.0, 0.2, 0.0],
            ..blade
        };
        let at = rest(&body);
        for idle in [weak, flat] {
            let change = body.cut_with(&idle, &first, 0, &at).unwrap();
            assert_eq!(change, Change::default());
        }
        assert!(body.is_intact());
        let bad = Blade {
            energy: -1.0,
            ..blade
        };
        assert!(body.cut_with(&bad, &first, 0, &at).is_err());
        let (mut work, mut area, mut largest) = (0.0, 0.0, 0.0f64);
        let mut y = -1.0;
        while y < 21.0 {
            let sweep = Sweep::new(&[edge(y), edge(y + step)]).unwrap();
            // Once in the tissue it needs no threshold.
            let own = Blade {
                pushed_mn: if y > 2.0 { 0.0 } else { 100.0 },
                ..blade
            };
            let at = rest(&body);
            let change = body.cut_with(&own, &sweep, 0, &at).unwrap();
            let force = change.force();
            work += force[1] * step;
            area += change.area_mm2;
            assert!(force[0].abs() < 1e-9 && force[2].abs() < 1e-9);
            for push in &change.pushes {
                assert!((push.weights.iter().sum::<f64>() - 1.0).abs() < 1e-9);
                assert!(
                    push.nodes
                        .iter()
                        .all(|node| (*node as usize) < body.node_count())
                );
            }
            // In the middle of the block, where the edge is 9 mm deep: 40 mN/mm.
            if (5.0..15.0).contains(&y) {
                largest = largest.max(force[1]);
            }
            y += step;
        }
        let wanted = 20.0 * 9.0;
        assert!((work - 40.0 * area).abs() < 1e-6 * work, "{step}: {work}");
        assert!((area - wanted).abs() < 0.05 * wanted, "{step}: {area} mm²");
        println!(
            "{step}: area {area} of {wanted}, force at most {largest} of {}",
            40.0 * 9.0
        );
        assert!(largest < 1.3 * 40.0 * 9.0, "{step}: {largest}");
        // What it goes over again takes no more than the elements at its end had left.
        let any = Blade {
            ahead: [0.0; 3],
            ..blade
        };
        for most in [0.15, 0.001] {
            let back = Sweep::new(&[edge(20.0), edge(0.0)]).unwrap();
            let at = rest(&body);
            let again = body.cut_with(&any, &back, 0, &at).unwrap();
            assert!(again.area_mm2 <= most * wanted, "{step}: {again:?}");
            assert!(again.elements.is_empty(), "{step}: {again:?}");
        }
    }
}
