//! Cuts in the reference solver: against meshes that have the slit, and what is conserved.

use std::collections::BTreeMap;

use tissue::material::Material;
use tissue::mesh::{Boundary, Mesh, boundary_faces, regular_box};
use tissue::solver::{ContactNode, Loads, Solver, SolverOptions, SurfacePressure};
use topology::Sweep;

/// A beam of 60 x 12 x 12 mm, held at x = 0.
fn beam(cells: [usize; 3]) -> Mesh {
    let mut mesh = regular_box([60.0, 12.0, 12.0], cells).unwrap();
    let nodes = 0..mesh.node_count() as u32;
    mesh.fixed = nodes
        .filter(|node| mesh.positions[*node as usize][0] < 1e-3)
        .collect();
    mesh.domain = (0..mesh.surface.len() as u32).collect();
    mesh
}

/// The same with the faces of the plane `x`, `z` above `bottom`, parted.
fn slit(mut mesh: Mesh, x: f32, bottom: f32) -> Mesh {
    let mut copies = BTreeMap::new();
    for tet in &mut mesh.tets {
        let middle = tet
            .iter()
            .map(|n| mesh.positions[*n as usize][0])
            .sum::<f32>()
            / 4.0;
        for node in tet.iter_mut().filter(|_| middle > x) {
            let at = mesh.positions[*node as usize];
            if (at[0] - x).abs() < 1e-3 && at[2] > bottom + 1e-3 {
                *node = *copies.entry(*node).or_insert_with(|| {
                    mesh.positions.push(at);
                    mesh.positions.len() as u32 - 1
                });
            }
        }
    }
    mesh.surface = boundary_faces(&mesh.tets).unwrap();
    mesh.domain = (0..mesh.surface.len() as u32).collect();
    mesh
}

fn sawn(x: f64, bottom: f64) -> Sweep {
    let edge = |z: f64| vec![[x, -5.0, z], [x, 17.0, z]];
    Sweep::new(&[edge(20.0), edge(bottom)]).unwrap()
}

fn solver(mesh: &Mesh) -> Solver {
    let material = Material {
        damping_per_s: 60.0,
        ..Material::default()
    };
    let options = SolverOptions {
        material,
        ..SolverOptions::default()
    };
    Solver::new(mesh, Boundary::Fixed, options).unwrap()
}

/// The free end pulled by 6 mm and held until all is at rest; the opening of the slit at its top, mm, and the force, mN.
fn pulled(solver: &mut Solver, mesh: &Mesh, sides: [f32; 2]) -> [f64; 2] {
    let ends = mesh.positions.iter().enumerate();
    let contact: Vec<ContactNode> = ends
        .filter(|(_, p)| (p[0] - 60.0).abs() < 1e-3)
        .map(|(node, _)| ContactNode {
            node: node as u32,
            displacement: [6.0, 0.0, 0.0],
        })
        .collect();
    let mut force = 0.0;
    for _ in 0..12 {
        let report = solver.step_frame(&contact, 0.05).unwrap();
        force = report.reaction.iter().map(|f| -f64::from(f[0])).sum();
    }
    let mut u = vec![[0.0; 3]; solver.node_count()];
    solver.displacement(&mut u);
    let at = |x: f32| {
        let near = |p: &[f32; 3]| (p[0] - x).abs() + (p[1] - 6.0).abs() + (p[2] - 12.0).abs();
        let nodes = mesh.positions.iter().enumerate();
        let nearest = nodes.min_by(|a, b| near(a.1).total_cmp(&near(b.1)));
        f64::from(u[nearest.unwrap().0][0])
    };
    [at(sides[1]) - at(sides[0]), force]
}

#[test]
fn a_sawn_beam_opens_as_one_that_was_meshed_so() {
    let mesh = beam([20, 4, 4]);
    let conforming = slit(mesh.clone(), 30.0, 6.0);
    let wanted = pulled(&mut solver(&conforming), &conforming, [27.0, 33.0]);
    let whole = pulled(&mut solver(&mesh), &mesh, [27.0, 33.0]);
    assert!(
        wanted[0] > 2.0 * whole[0] && wanted[1] < 0.95 * whole[1],
        "{wanted:?} {whole:?}"
    );
    // On the faces of the mesh it is the same body; through the elements nearly.
    for (x, most) in [(30.0, 1e-3), (31.1, 0.1)] {
        let mut cut = solver(&mesh);
        cut.cut(&sawn(x, 6.0), 0).unwrap();
        let sides = [x as f32 - 3.0, x as f32 + 3.0].map(|at| 3.0 * (at / 3.0).round());
        let found = pulled(&mut cut, &mesh, sides);
        let error = [0, 1].map(|k| (found[k] - wanted[k]).abs() / wanted[k]);
        println!(
            "x = {x}: opening {:.3} mm ({:.1} %), force {:.2} mN ({:.1} %)",
            found[0],
            100.0 * error[0],
            found[1],
            100.0 * error[1]
        );
        assert!(
            error[0] <= most && error[1] <= most,
            "{x}: {found:?}, not {wanted:?}"
        );
    }
}

#[test]
fn a_cut_keeps_mass_and_both_energies_and_a_fragment_flies_on() {
    let mesh = beam([10, 2, 2]);
    let mut body = solver(&mesh);
    let end: Vec<ContactNode> = (0..mesh.node_count() as u32)
        .filter(|node| mesh.positions[*node as usize][0] > 59.0)
        .map(|node| ContactNode {
            node,
            displacement: [5.0, 0.0, 3.0],
        })
        .collect();
    body.step_frame(&end, 0.05).unwrap();
    let before = body.step_frame(&[], 0.001).unwrap();
    let mass = body.mass();
    // Half way through, then all of it, in one step each; no frame has more energy than the one before.
    let mut energy = before.strain_energy + before.kinetic_energy;
    for (stroke, bottom) in [(0, 6.0), (1, -6.0)] {
        body.cut(&sawn(31.3, bottom), stroke).unwrap();
        assert!((body.mass() - mass).abs() < 1e-6 * mass);
        for _ in 0..20 {
            let report = body.step_frame(&[], 0.001).unwrap();
            let now = report.strain_energy + report.kinetic_energy;
            assert!(now < 1.002 * energy, "{now} mJ after {energy} mJ");
            energy = now;
        }
    }
    let fragments = body.drop_fragments().unwrap();
    assert_eq!(fragments.len(), 1);
    let volume = 12.0 * 12.0 * (60.0 - 31.3);
    assert!((fragments[0].volume_mm3 - volume).abs() < 0.1 * volume);
    assert!((body.mass() / mass - 1.0 + fragments[0].volume_mm3 / 8640.0).abs() < 1e-3);
    body.step_frame(&[], 0.01).unwrap();
    assert!(body.drop_fragments().unwrap().is_empty());
}

/// Gravity, a force on a node and pressure from all sides, also into the slit; where each node comes to rest, mm.
fn loaded(solver: &mut Solver, mesh: &Mesh, force_at: usize) -> Vec<[f32; 3]> {
    let mut forces = vec![[0.0; 3]; mesh.node_count()];
    forces[force_at] = [0.0, 0.0, -1.5];
    let loads = Loads {
        gravity: [0.0, 0.0, -300.0],
        forces,
        pressures: vec![SurfacePressure {
            faces: mesh.domain.clone(),
            pascal: 40.0,
            walls: true,
        }],
        ..Loads::default()
    };
    solver.set_loads(&loads).unwrap();
    for _ in 0..24 {
        solver.step_frame(&[], 0.05).unwrap();
    }
    let mut u = vec![[0.0; 3]; solver.node_count()];
    solver.displacement(&mut u);
    u
}

#[test]
fn a_sawn_beam_under_loads_is_one_that_was_meshed_so() {
    let mesh = beam([20, 4, 4]);
    let conforming = slit(mesh.clone(), 30.0, 6.0);
    let near = |mesh: &Mesh, to: [f32; 3]| {
        let off = |p: &[f32; 3]| (0..3).map(|k| (p[k] - to[k]).abs()).sum::<f32>();
        let nodes = mesh.positions.iter().enumerate();
        nodes
            .min_by(|a, b| off(a.1).total_cmp(&off(b.1)))
            .unwrap()
            .0
    };
    let end = near(&mesh, [60.0, 6.0, 0.0]);
    // On the blade itself: its tissue is half on each side. The conforming mesh has the other half at its copy.
    let wanted = loaded(&mut solver(&conforming), &conforming, end);
    let whole = loaded(&mut solver(&mesh), &mesh, end);
    let down = |u: &[[f32; 3]]| f64::from(-u[end][2]);
    assert!(
        down(&wanted) > 1.1 * down(&whole),
        "{} {}",
        down(&wanted),
        down(&whole)
    );
    for (x, most) in [(30.0, 1e-3), (31.1, 0.1)] {
        let mut cut = solver(&mesh);
        cut.cut(&sawn(x, 6.0), 0).unwrap();
        let found = loaded(&mut cut, &mesh, end);
        let off = (down(&found) - down(&wanted)).abs() / down(&wanted);
        println!("x = {x}: {:.3} mm ({:.1} %)", down(&found), 100.0 * off);
        assert!(off <= most, "{x}: {} not {}", down(&found), down(&wanted));
        // Cut while the loads act, it comes to rest where it did.
        let mut late = solver(&mesh);
        loaded(&mut late, &mesh, end);
        late.cut(&sawn(x, 6.0), 0).unwrap();
        let moved = loaded(&mut late, &mesh, end);
        let off = (down(&moved) - down(&found)).abs() / down(&found);
        // The blade came in the body as it hangs.
        assert!(off < 0.15, "{x}: {} and {}", down(&moved), down(&found));
    }
}

/// What holds a cut body carries its weight and the forces on it, wherever a blade has gone through the tissue that they act on.
#[test]
fn supports_carry_the_weight_and_the_forces_of_a_cut_body() {
    let mut mesh = beam([10, 2, 2]);
    let held: Vec<ContactNode> = (std::mem::take(&mut mesh.fixed).into_iter())
        .map(|node| ContactNode {
            node,
            displacement: [0.0; 3],
        })
        .collect();
    let mut body = solver(&mesh);
    body.cut(&sawn(31.3, 7.0), 0).unwrap();
    // Through nodes.
    body.cut(&sawn(42.0, 7.0), 1).unwrap();
    let ball = |at: [f64; 3]| 7.0 - (at[0] - 54.0).hypot(at[2] + 2.0);
    let removed = body.remove(ball, f64::MAX).unwrap().removed_mm3;
    assert!(body.drop_fragments().unwrap().is_empty());
    assert!(removed > 100.0);
    let top = |node: &[f32; 3]| node[2] > 11.0 && node[0] > 20.0;
    let forces: Vec<[f32; 3]> = (mesh.positions.iter())
        .map(|p| if top(p) { [0.0, 0.2, -0.3] } else { [0.0; 3] })
        .collect();
    let sum = forces.iter().map(|f| f64::from(f[2])).sum::<f64>();
    body.set_loads(&Loads {
        gravity: [0.0, 0.0, -400.0],
        forces,
        ..Loads::default()
    })
    .unwrap();
    let mut carried = 0.0;
    for _ in 0..60 {
        let report = body.step_frame(&held, 0.05).unwrap();
        carried = report.reaction.iter().map(|f| f64::from(f[2])).sum();
    }
    // But for the half row of elements that hangs at the held nodes themselves; g mm/s² are µN.
    let volume = 12.0 * 12.0 * 57.0 - removed;
    let weight = -1e-3 * 400.0 * Material::default().density_g_mm3() * volume;
    assert!(weight < -2.0 && sum < -4.0);
    let wanted = weight + sum;
    assert!(
        (carried.abs() / wanted.abs() - 1.0).abs() < 5e-3,
        "{carried} mN, not {wanted}"
    );
}

#[test]
fn refused_cuts_leave_the_motion_as_it_was() {
    let mesh = beam([10, 2, 2]);
    let mut body = solver(&mesh);
    let frame = |body: &mut Solver| body.step_frame(&[], 0.01).unwrap();
    assert!(body.remove(|_| 1.0, f64::MAX).is_err());
    assert!(body.scale_stiffness(&[0], -1.0).is_err());
    assert!(body.scale_stiffness(&[u32::MAX], 2.0).is_err());
    assert!(body.body().is_none());
    let found = frame(&mut body);
    assert_eq!(found, frame_of_intact(&mesh));
}

fn frame_of_intact(mesh: &Mesh) -> tissue::solver::FrameReport {
    solver(mesh).step_frame(&[], 0.01).unwrap()
}
