//! A strain that is held relaxes as the material's Prony series, element by element and on every instruction set.

use elements::{
    Branch, ElementForces, Isa, Law, Material, MooneyRivlin, Ogden, Relaxation, StressStep,
    Tetrahedron, VerondaWestmann, Yeoh,
};
use tissue::mesh::{Mesh, box_phantom};

/// Brain (Miller and Chinzei 2002), and a fast branch.
fn branches() -> Relaxation {
    Relaxation::parse("0.45,0.5,0.365,50,0.05,0.02").unwrap()
}

fn materials() -> [Material; 5] {
    let ogden = Law::Ogden(Ogden::new(&[[-163.0, -18.0]]).unwrap());
    let mooney = Law::MooneyRivlin(MooneyRivlin { c01_share: 0.7 });
    let yeoh = Law::Yeoh(Yeoh {
        c2_over_c1: 1.5,
        c3_over_c1: 0.4,
    });
    let exponential = Law::VerondaWestmann(VerondaWestmann { beta: 4.0 });
    [Law::default(), mooney, ogden, yeoh, exponential].map(|law| Material {
        relaxation: branches(),
        ..Material::default().with_law(law)
    })
}

fn wave(mesh: &Mesh, size: f32) -> Vec<f32> {
    let rows = mesh.positions.iter();
    rows.flat_map(|p| [0, 1, 2].map(|k| size * (0.21 * p[k] + 0.13 * p[(k + 1) % 3]).sin()))
        .collect()
}

/// Nodal forces of the law in f64, µN.
fn exact(mesh: &Mesh, material: &Material, u: &[f32]) -> Vec<f64> {
    let mut out = vec![0.0; u.len()];
    for &corners in &mesh.tets {
        let rest = corners.map(|node| mesh.positions[node as usize].map(f64::from));
        let tet = Tetrahedron::new(corners, rest, 1.0);
        let state =
            tet.deformation(corners.map(|n| [0, 1, 2].map(|k| f64::from(u[3 * n as usize + k]))));
        for (node, force) in corners.iter().zip(tet.forces(&state, material.moduli())) {
            for k in 0..3 {
                out[3 * *node as usize + k] += force[k];
            }
        }
    }
    out
}

/// On the threads of a pool chunks come in any order.
fn backwards(count: usize, task: &(dyn Fn(usize, usize) + Sync)) {
    (0..count).rev().for_each(|chunk| task(chunk, 0));
}

fn serial(count: usize, task: &(dyn Fn(usize, usize) + Sync)) {
    (0..count).for_each(|chunk| task(chunk, 0));
}

/// Verifies REQ-096.
#[test]
fn a_held_strain_relaxes_as_the_series() {
    let mesh = box_phantom([30.0, 40.0, 50.0], [4, 5, 6]).unwrap();
    let u = wave(&mesh, 0.4);
    let h = 0.05;
    for material in materials() {
        let relaxation = material.relaxation;
        let g0 = relaxation.over(h);
        let stepped = material.in_steps_of(h);
        stepped.validate().unwrap();
        assert!((stepped.bulk_pa() / material.bulk_pa() - 1.0).abs() < 1e-9);
        let (whole, in_step) = (exact(&mesh, &material, &u), exact(&mesh, &stepped, &u));
        let isochoric = |at: usize| (whole[at] - in_step[at]) / (1.0 - g0);
        for isa in Isa::available() {
            let forces = ElementForces::new(mesh.tetrahedra(), &stepped, isa).unwrap();
            let mut scratch = forces.scratch(1).unwrap();
            let mut history = forces.stress_history().unwrap().unwrap();
            let mut elastic = vec![0.0; u.len()];
            forces.evaluate(&u, &mut scratch, &mut elastic, &serial);
            let (mut now, mut next) = (vec![0.0; u.len()], vec![0.0; u.len()]);
            for step in 0..1200u32 {
                let part = StressStep::new(&relaxation, h, [0.0, h], g0);
                let parallel = if step % 2 == 0 { serial } else { backwards };
                let out = (now.as_mut_slice(), Some(next.as_mut_slice()));
                forces.relax(&u, &mut history, &part, &mut scratch, out, &parallel);
                // Loaded within the first step, at a constant rate.
                let since = f64::from(step) * h;
                let left: f64 = (relaxation.iter())
                    .map(|branch| branch.gain(h) * branch.decay(since))
                    .sum();
                let scale = whole.iter().fold(0.0f64, |a, b| a.max(b.abs()));
                if ![0, 1, 20, 1199].contains(&step) {
                    continue;
                }
                for at in 0..u.len() {
                    let lost = 1.0 - relaxation.lasting() - left;
                    let want = whole[at] - lost * isochoric(at);
                    let got = f64::from(elastic[at]) - f64::from(now[at]);
                    let off = (got - want).abs() / scale;
                    assert!(
                        off < 2e-4,
                        "{isa:?}, {}, step {step}: {off:e}",
                        material.law
                    );
                }
            }
            // The end of a step is the start of the next.
            let part = StressStep::new(&relaxation, h, [0.0, h], g0);
            let ends = next.clone();
            let out = (now.as_mut_slice(), Some(next.as_mut_slice()));
            forces.relax(&u, &mut history, &part, &mut scratch, out, &serial);
            // One row alone is that row, and asking again changes nothing that is remembered.
            let again = StressStep::new(&relaxation, 0.0, [0.0, h], g0);
            let (known, mut alone) = (history.values().clone(), vec![0.0; u.len()]);
            let out = (alone.as_mut_slice(), None);
            forces.relax(&u, &mut history, &again, &mut scratch, out, &serial);
            assert!(history.values() == &known && alone == now);
            for (now, end) in now.iter().zip(&ends) {
                assert!((now - end).abs() < 0.05, "{now} for {end}");
            }
        }
    }
}

#[test]
fn order_and_threads_change_no_bit() {
    let mesh = box_phantom([30.0, 40.0, 50.0], [7, 9, 12]).unwrap();
    let material = materials()[0];
    let forces = ElementForces::new(mesh.tetrahedra(), &material, Isa::detect()).unwrap();
    let step = StressStep::new(&material.relaxation, 0.05, [0.0, 0.05], 1.0);
    let made = |parallel: elements::ParallelFor<'_>| {
        let mut scratch = forces.scratch(1).unwrap();
        let mut history = forces.stress_history().unwrap().unwrap();
        let mut out = [
            vec![0.0; 3 * forces.node_count()],
            vec![0.0; 3 * forces.node_count()],
        ];
        for size in [0.2, 0.5] {
            let [now, next] = &mut out;
            let u = wave(&mesh, size);
            let out = (now.as_mut_slice(), Some(next.as_mut_slice()));
            forces.relax(&u, &mut history, &step, &mut scratch, out, parallel);
        }
        (out, history.values().clone())
    };
    let one = made(&serial);
    assert!(one.0[1].iter().any(|x| *x != 0.0));
    assert_eq!(one, made(&backwards));
}

#[test]
fn an_elastic_body_remembers_nothing() {
    let mesh = box_phantom([30.0, 40.0, 50.0], [3, 3, 3]).unwrap();
    let elastic = Material::default();
    assert_eq!(elastic.in_steps_of(0.05), elastic);
    let forces = ElementForces::new(mesh.tetrahedra(), &elastic, Isa::detect()).unwrap();
    assert!(forces.stress_history().unwrap().is_none());
    let relaxing = materials()[0];
    let other = ElementForces::new(mesh.tetrahedra(), &relaxing, Isa::detect()).unwrap();
    assert!(forces.bytes() < other.bytes());
}

#[test]
fn constants_that_no_tissue_has_are_named() {
    let of = |pairs: &[[f64; 2]]| Material {
        relaxation: Relaxation::new(pairs.iter().map(|&[share, tau_s]| Branch { share, tau_s }))
            .unwrap(),
        ..Material::default()
    };
    for (pairs, field) in [
        (&[[0.6, 1.0], [0.5, 10.0]][..], "relaxation"),
        (&[[0.6, 1.0], [0.2, 0.0]], "relaxation[1].tau_s"),
        (&[[0.6, -1.0]], "relaxation[0].tau_s"),
        (&[[-0.1, 1.0]], "relaxation[0].share"),
        (&[[f64::NAN, 1.0]], "relaxation[0].share"),
        (&[[0.2, f64::INFINITY]], "relaxation[0].tau_s"),
    ] {
        assert_eq!(of(pairs).validate().unwrap_err().field, field, "{pairs:?}");
    }
    assert!(
        Relaxation::parse("0.5,1,0.2")
            .unwrap_err()
            .contains("odd count")
    );
    assert!(Relaxation::parse("0.5,x").unwrap_err().contains("`x`"));
    assert!(
        Relaxation::parse("0.7,1,0.4,2")
            .unwrap_err()
            .contains("0.999")
    );
    let many = "0.1,1,".repeat(7);
    assert!(
        Relaxation::parse(many.trim_end_matches(','))
            .unwrap_err()
            .contains("at most 6")
    );
    let branches = branches();
    assert_eq!(Relaxation::parse(&branches.to_string()), Ok(branches));
}
