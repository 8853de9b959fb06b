//! Grasping: bound samples follow the tool until it lets go or they tear off.

use crate::bench::{TOP, block, drive, level, solver, sphere};
use contact::Vector;
use tissue::mesh::Boundary;

/// Touches the top, closes, pulls `height` up within ten frames, stays.
fn pull(height: f32) -> Vec<(Vector, bool)> {
    let touch = TOP + Vector::Z * 3.7;
    let mut path = vec![(touch, false)];
    path.extend((0..=14).map(|i| (touch + Vector::Z * (height * i.min(10) as f32 / 10.0), true)));
    path
}

#[test]
fn a_grasper_pulls_and_the_tissue_pulls_back() {
    let mesh = block();
    let mut solver = solver(&mesh, 1, 20.0);
    let start = level(TOP + Vector::Z * 4.2);
    solver
        .set_tools(mesh.samples(Boundary::Fixed), &[sphere(4.0, 0.3)], &[start])
        .unwrap();
    let mut path = pull(4.0);
    path.push((TOP + Vector::Z * 9.0, false));
    path.push((TOP + Vector::Z * 14.0, false));
    let reports = drive(&mut solver, path, 0.05);
    let held = &reports[15].tools[0];
    assert!(held.held >= 3 && !held.torn, "{held:?}");
    assert!(held.force[2] < -5.0, "the tissue pulls down: {held:?}");
    let free = &reports[17].tools[0];
    assert_eq!((free.held, free.contacts, free.force), (0, 0, [0.0; 3]));
}

#[test]
fn a_grasp_tears_off_at_its_force_and_stays_off_until_it_opens() {
    let mesh = block();
    let mut tool = sphere(4.0, 0.3);
    tool.tear_off_mn = 100.0;
    let mut solver = solver(&mesh, 1, 20.0);
    let start = level(TOP + Vector::Z * 4.2);
    solver
        .set_tools(mesh.samples(Boundary::Fixed), &[tool], &[start])
        .unwrap();
    let reports = drive(&mut solver, pull(6.0), 0.05);
    let pulls: Vec<f32> = reports.iter().map(|r| -r.tools[0].force[2]).collect();
    let torn = reports.iter().position(|r| r.tools[0].torn).expect("tears");
    assert!(torn > 2, "{pulls:?}");
    assert!(pulls.iter().all(|f| *f < 106.0), "{pulls:?}");
    let last = &reports[15].tools[0];
    assert!(
        last.torn && last.held == 0 && last.force == [0.0; 3],
        "{last:?}"
    );
}
