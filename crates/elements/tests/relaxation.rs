//! A strain that is held relaxes as the material's Prony series, element by element and on every instruction set.

use elements::{
    Branch, ElementForces, HistoryStep, Isa, Law, Material, MooneyRivlin, Ogden, Region,
    Relaxation, Tetrahedron, VerondaWestmann, Yeoh,
};
use tissue::mesh::{Mesh, box_phantom};

/// Brain (Miller and Chinzei 2002), and a fast branch.
fn branches() -> Relaxation {
    Relaxation::parse("0.45,0.5,0.365,50,0.05,0.02").unwrap()
}

fn materials() -> [Material; 6] {
    let ogden = Law::Ogden(Ogden::new(&[[-163.0, -18.0]]).unwrap());
    let mooney = Law::MooneyRivlin(MooneyRivlin { c01_share: 0.7 });
    let yeoh = Law::Yeoh(Yeoh {
        c2_over_c1: 1.5,
        c3_over_c1: 0.4,
    });
    let exponential = Law::VerondaWestmann(VerondaWestmann { beta: 4.0 });
    let fibres = "mooney-rivlin:0.3+fibres:3,2".parse().unwrap();
    [Law::default(), mooney, ogden, yeoh, exponential, fibres].map(|law| Material {
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
    for (at, &corners) in mesh.tets.iter().enumerate() {
        let rest = corners.map(|node| mesh.positions[node as usize].map(f64::from));
        let tet = Tetrahedron::new(corners, rest, 1.0).along(mesh.laws().fibre_of(at));
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

fn when(since_s: f64, times_s: [f64; 2], g0: f64) -> HistoryStep {
    HistoryStep {
        since_s,
        times_s,
        g0,
    }
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
    let mut mesh = box_phantom([30.0, 40.0, 50.0], [4, 5, 6]).unwrap();
    mesh.fibre = (0..mesh.tets.len())
        .map(|tet| [[0.6, 0.0, 0.8], [0.0; 3]][usize::from(tet % 3 == 0)])
        .collect();
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
                let part = when(h, [0.0, h], g0);
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
            let part = when(h, [0.0, h], g0);
            let ends = next.clone();
            let out = (now.as_mut_slice(), Some(next.as_mut_slice()));
            forces.relax(&u, &mut history, &part, &mut scratch, out, &serial);
            // One row alone is that row, and asking again changes nothing that is remembered.
            let again = when(0.0, [0.0, h], g0);
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
    let step = when(0.05, [0.0, 0.05], 1.0);
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

/// A block of three layers that is stretched and sheared alike everywhere: the material's, one with a series and a law of its own, one that is elastic.
#[test]
fn regions_relax_by_their_own_series() {
    let mut mesh = box_phantom([30.0, 40.0, 50.0], [7, 9, 12]).unwrap();
    let own = Relaxation::parse("0.3,0.1,0.3,2").unwrap();
    let named = |name: &str, law, relaxation| Region {
        name: name.into(),
        law,
        source: String::new(),
        density_kg_m3: None,
        relaxation: Some(relaxation),
    };
    mesh.regions = vec![
        named("soft", materials()[1].law, own),
        named("hard", Law::default(), Relaxation::default()),
    ];
    let layer = |tet: &[u32; 4]| (mesh.positions[tet[0] as usize][2] / 17.0) as u8;
    mesh.region = mesh.tets.iter().map(layer).collect();
    let u: Vec<f32> = (mesh.positions.iter())
        .flat_map(|[x, y, z]| [0.1 * x + 0.05 * z, -0.06 * y, -0.04 * z])
        .collect();
    let h = 0.05;
    for body in [branches(), Relaxation::default()] {
        let material = Material {
            relaxation: body,
            ..Material::default()
        };
        mesh.check_laws(&material).unwrap();
        let (g0, stepped) = (body.over(h), material.in_steps_of(h));
        let series = [body, own, Relaxation::default()];
        // Tetrahedron by tetrahedron, whole and without change of volume.
        let shear = Material {
            relaxation: branches(),
            ..material
        };
        let softer = shear.in_steps_of(h);
        let part = 1.0 - branches().over(h);
        let want = |since: f64| {
            let mut out = vec![0.0; u.len()];
            for (at, &corners) in mesh.tets.iter().enumerate() {
                let rest = corners.map(|node| mesh.positions[node as usize].map(f64::from));
                let tet = Tetrahedron::new(corners, rest, 1.0);
                let moved = corners.map(|n| [0, 1, 2].map(|k| f64::from(u[3 * n as usize + k])));
                let state = tet.deformation(moved);
                let [whole, less] = [material, softer].map(|material| {
                    let moduli = mesh.laws().moduli_of(at, material.moduli());
                    tet.forces(&state, moduli)
                });
                let relaxation = series[usize::from(mesh.region[at])];
                let left: f64 = (relaxation.iter())
                    .map(|branch| branch.gain(h) * branch.decay(since))
                    .sum();
                let lost = 1.0 - relaxation.lasting() - left;
                for (node, corner) in corners.iter().enumerate() {
                    for k in 0..3 {
                        let shape = (whole[node][k] - less[node][k]) / part;
                        out[3 * *corner as usize + k] += whole[node][k] - lost * shape;
                    }
                }
            }
            out
        };
        for isa in Isa::available() {
            let forces = ElementForces::new(mesh.tetrahedra(), &stepped, isa).unwrap();
            let mut scratch = forces.scratch(1).unwrap();
            let mut history = forces.stress_history().unwrap().unwrap();
            let (mut elastic, mut now) = (vec![0.0; u.len()], vec![0.0; u.len()]);
            forces.evaluate(&u, &mut scratch, &mut elastic, &serial);
            for step in 0..400u32 {
                let out = (now.as_mut_slice(), None);
                let part = when(h, [0.0, h], g0);
                forces.relax(&u, &mut history, &part, &mut scratch, out, &backwards);
                if ![0, 1, 20, 399].contains(&step) {
                    continue;
                }
                let want = want(f64::from(step) * h);
                let scale = want.iter().fold(0.0f64, |a, b| a.max(b.abs()));
                for (at, want) in want.iter().enumerate() {
                    let off = (f64::from(elastic[at]) - f64::from(now[at]) - want).abs() / scale;
                    assert!(off < 2e-4, "{isa:?}, step {step}, number {at}: {off:e}");
                    // In an elastic body an elastic region is not touched.
                    let is_hard = mesh.positions[at / 3][2] > 40.0;
                    assert!(!is_hard || g0 < 1.0 || now[at] == 0.0, "number {at}");
                }
            }
        }
    }
    // In tissue of which most is gone within a step nothing elastic is known in time.
    let fast = Material {
        relaxation: Relaxation::parse("0.6,0.01").unwrap(),
        ..Material::default()
    };
    let error = mesh.check_laws(&fast).unwrap_err().to_string();
    assert!(error.contains("region `soft`: relaxation"), "{error}");
    let mut other = mesh.clone();
    other.regions[0].relaxation = Some(
        Relaxation::new([Branch {
            share: 1.5,
            tau_s: 1.0,
        }])
        .unwrap(),
    );
    let error = other
        .check_laws(&Material::default())
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("region `soft`: relaxation[0].share"),
        "{error}"
    );
}
