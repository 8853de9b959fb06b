//! A search and a solve allocate nothing once their buffers have grown, whatever the tool's shape.

use contact::{
    Body, Contact, Law, Limits, Placed, Pose, Samples, Search, Shape, Sweeps, Vector, Whole,
};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

struct Counting;

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: hands on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.set(COUNT.get() + 1);
        // SAFETY: the caller's.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn allocations(work: impl FnOnce()) -> usize {
    let before = COUNT.get();
    work();
    COUNT.get() - before
}

#[test]
fn a_second_search_and_solve_allocate_nothing() {
    assert!(allocations(|| drop(vec![0u8; 64])) > 0, "the count counts");
    let side = 13u32;
    let positions: Vec<[f32; 3]> = (0..side * side)
        .map(|i| [(i % side) as f32 * 3.0, (i / side) as f32 * 3.0, 0.0])
        .collect();
    let faces = (0..(side - 1) * (side - 1)).flat_map(|i| {
        let a = i % (side - 1) + side * (i / (side - 1));
        [[a, a + 1, a + side + 1], [a, a + side + 1, a + side]]
    });
    let samples = Samples::new(&positions, faces, &[], 1.7);
    let corners = (0..8).map(|i: u32| [0, 1, 2].map(|k| if i >> k & 1 == 1 { 5.0 } else { -5.0 }));
    let shapes = [
        Shape::Capsule {
            half_length: 8.0,
            radius: 5.0,
        },
        Shape::Spatula {
            half_extents: [6.0, 6.0, 5.0],
            radius: 1.0,
        },
        Shape::Hull {
            points: corners.collect(),
            margin: 0.2,
        },
    ];
    let bodies = shapes.map(|shape| Body::new(&shape).unwrap());
    let tools = bodies.each_ref().map(|body| Placed {
        body,
        pose: Pose::new(Vector::new(18.0, 18.0, 4.5), Vector::new(0.1, 0.2, 0.3)),
        skin: 1.5,
    });
    let position = |n: u32| Vector::from(positions[n as usize]);
    let mut search = Search::default();
    let mut sweeps = Sweeps::default();
    let count = search.find(&samples, &tools, position).len();
    assert!(count > 60, "{count}");
    let mut delassus = vec![0.0; 9 * count * count];
    (0..3 * count).for_each(|i| delassus[i * (3 * count + 1)] = 0.1);
    let contacts: Vec<Contact> = search
        .found()
        .iter()
        .map(|c| Contact {
            law: Law::Touch { friction: 0.3 },
            normal: c.normal,
            gap: c.distance,
            slip: Vector::X * 0.1,
        })
        .collect();
    let mut forces = vec![Vector::ZERO; count];
    let mut round = || {
        search.find(&samples, &tools, position);
        forces.fill(Vector::ZERO);
        sweeps.solve(
            &mut Whole::new(&delassus, contacts.len()),
            &contacts,
            &mut forces,
            Limits::default(),
        );
    };
    round();
    assert_eq!(allocations(&mut round), 0);
    assert!(forces.iter().any(|f| *f != Vector::ZERO));
}
