//! The SIMD forces of a whole body against the f64 law, element by element.

mod bodies;
mod regions;

use bodies::{body, exact, fibred, forces_on, mixed, ogden_laws, serial, wave};
use elements::{
    CutTetrahedra, ElementForces, Isa, Law, Material, MooneyRivlin, Subset, VerondaWestmann, Yeoh,
};
use tissue::mesh::Mesh;

/// Verifies REQ-081.
#[test]
fn they_are_those_of_the_law_on_every_instruction_set() {
    let law = Law::MooneyRivlin(MooneyRivlin { c01_share: 0.7 });
    let yeoh = Yeoh {
        c2_over_c1: 1.5,
        c3_over_c1: 0.4,
    };
    // The cap is reached in some elements.
    let exponential = Law::VerondaWestmann(VerondaWestmann { beta: 4.0 });
    for law in [Law::default(), law, Law::Yeoh(yeoh), exponential] {
        check(&Material {
            law,
            ..Material::default()
        });
    }
}

/// Beside a body without any; strains up to a third, beyond the cap of the stiffest.
///
/// Verifies REQ-099.
#[test]
fn those_of_fibres_are_those_of_f64() {
    let mesh = fibred();
    for size in [0.05, 0.6] {
        check_of(&mesh, &Material::default(), size);
    }
    let mut without = mesh.clone();
    without.fibre.fill([0.0; 3]);
    let mut matrix = mesh.clone();
    for region in &mut matrix.regions {
        region.law = region.law.matrix();
    }
    matrix.fibre.clear();
    let u = wave(&mesh, 0.6);
    for isa in Isa::available() {
        let of = |mesh: &Mesh| forces_on(isa, mesh, &Material::default(), &u);
        // Fibres that no element has add a zero.
        assert_eq!(of(&without), of(&matrix));
        assert_ne!(of(&mesh), of(&matrix));
    }
}

#[test]
fn those_of_ogden_are_too_up_to_strains_beyond_the_cap() {
    for material in ogden_laws() {
        for size in [0.05, 0.6] {
            check_at(&material, size);
        }
    }
}

/// What a strain of one in a hundred thousand leaves of the digits: the relative error does not grow.
#[test]
fn small_strains_cost_ogden_no_digits() {
    let mesh = body();
    for material in ogden_laws() {
        for size in [1e-5, 1e-3, 0.1] {
            let u = wave(&mesh, size);
            let (want, _) = exact(&mesh, &material, &u);
            let square = |values: &[f64]| values.iter().map(|x| x * x).sum::<f64>();
            for isa in Isa::available() {
                let got = forces_on(isa, &mesh, &material, &u);
                let off: Vec<f64> = (got.iter().zip(&want))
                    .map(|(got, want)| f64::from(*got) - want)
                    .collect();
                let off = (square(&off) / square(&want)).sqrt();
                assert!(off < 5e-6, "{isa:?}, {}, {size}: {off:e}", material.law);
            }
        }
    }
}

#[test]
fn a_body_crushed_to_a_twentieth_has_the_forces_of_f64() {
    let mesh = body();
    let u: Vec<f32> = (mesh.positions.iter())
        .flat_map(|p| [0.0, 0.0, -0.95 * p[2]])
        .collect();
    for material in ogden_laws() {
        let (want, _) = exact(&mesh, &material, &u);
        let scale = want.iter().fold(0.0f64, |a, b| a.max(b.abs()));
        for isa in Isa::available() {
            let got = forces_on(isa, &mesh, &material, &u);
            for (got, want) in got.iter().zip(&want) {
                let off = (f64::from(*got) - want).abs() / scale;
                assert!(off < 1e-4, "{isa:?}, {}: {off:e}", material.law);
            }
        }
    }
}

fn check(material: &Material) {
    check_at(material, 0.6);
}

fn check_at(material: &Material, size: f32) {
    check_of(&body(), material, size);
}

fn check_of(mesh: &Mesh, material: &Material, size: f32) {
    let u = wave(mesh, size);
    let (want, least) = exact(mesh, material, &u);
    let scale = want.iter().fold(0.0f64, |a, b| a.max(b.abs()));
    for isa in Isa::available() {
        let forces = ElementForces::new(mesh.tetrahedra(), material, isa).unwrap();
        let mut scratch = forces.scratch(1).unwrap();
        let mut out = vec![f32::NAN; u.len()];
        let det = forces.evaluate(&u, &mut scratch, &mut out, &serial);
        for (got, want) in out.iter().zip(&want) {
            let error = (f64::from(*got) - want).abs();
            assert!(error < 1e-4 * scale, "{isa:?}: {got} for {want}");
        }
        assert!((f64::from(det) - least).abs() < 1e-4, "{isa:?}");
    }
}

#[test]
fn threads_do_not_change_a_bit() {
    for material in [Material::default(), ogden_laws()[0], ogden_laws()[1]] {
        check_threads(&body(), &material);
    }
    check_threads(&mixed(), &Material::default());
    check_threads(&fibred(), &Material::default());
}

fn check_threads(mesh: &Mesh, material: &Material) {
    let u = wave(mesh, 0.6);
    let forces = ElementForces::new(mesh.tetrahedra(), material, Isa::detect()).unwrap();
    let run = |parallel: elements::ParallelFor<'_>| {
        let mut scratch = forces.scratch(3).unwrap();
        let mut out = vec![0.0; u.len()];
        forces.evaluate(&u, &mut scratch, &mut out, parallel);
        out
    };
    let threaded = |count: usize, task: &(dyn Fn(usize, usize) + Sync)| {
        std::thread::scope(|scope| {
            for worker in 0..3 {
                scope.spawn(move || (worker..count).step_by(3).for_each(|c| task(c, worker)));
            }
        });
    };
    assert_eq!(run(&serial), run(&threaded));
}

#[test]
fn an_inverted_state_shows_in_det_and_a_nan_in_the_forces() {
    for material in [Material::default(), ogden_laws()[0], ogden_laws()[1]] {
        check_inverted(&material);
    }
}

fn check_inverted(material: &Material) {
    let mesh = body();
    let forces = ElementForces::new(mesh.tetrahedra(), material, Isa::detect()).unwrap();
    let mut scratch = forces.scratch(1).unwrap();
    let mut u = vec![0.0; 3 * mesh.positions.len()];
    let mut out = u.clone();
    assert!(forces.evaluate(&u, &mut scratch, &mut out, &serial) > 0.999);
    u[300] = 30.0;
    assert!(forces.evaluate(&u, &mut scratch, &mut out, &serial) < 0.0);
    u[300] = f32::NAN;
    forces.evaluate(&u, &mut scratch, &mut out, &serial);
    assert!(out[300].is_nan());
}

/// The forces of the clusters that have one of some nodes, where all elements are theirs, and how many elements they have.
fn forces_about(
    subset: &mut Subset,
    body: &ElementForces,
    mesh: &Mesh,
    is_wanted: impl Fn(u32) -> bool + Copy,
    u: &[f32],
) -> (Vec<Option<[f32; 3]>>, f64) {
    subset.clear();
    let mut volume = 0.0;
    for chunk in 0..body.chunk_count() {
        volume += subset.push(body, chunk, is_wanted).unwrap();
    }
    subset.finish(&mesh.positions).unwrap();
    let mut missing = vec![0i32; mesh.positions.len()];
    for &node in mesh.tets.iter().flatten() {
        missing[node as usize] += 1;
    }
    for (number, element) in subset.tetrahedra() {
        let mut corners = element.corners;
        let mut own = mesh.tets[number as usize];
        corners.sort_unstable();
        own.sort_unstable();
        assert_eq!(corners, own, "element {number}");
        corners.iter().for_each(|node| missing[*node as usize] -= 1);
    }
    let mut sums = vec![[0.0f32; 3]; mesh.positions.len()];
    subset.evaluate(u, |node, force| {
        for (sum, force) in sums[node as usize].iter_mut().zip(force) {
            *sum -= force;
        }
    });
    let whole = sums.into_iter().zip(missing);
    (
        whole
            .map(|(sum, missing)| (missing == 0).then_some(sum))
            .collect(),
        volume,
    )
}

#[test]
fn a_subset_has_the_forces_of_the_body_where_it_is_whole() {
    let u = wave(&body(), 0.3);
    let all = body().positions.len() as u32;
    for (mesh, material) in [
        (body(), Material::default()),
        (body(), ogden_laws()[0]),
        (mixed(), Material::default()),
        (fibred(), Material::default()),
    ] {
        for isa in Isa::available() {
            let forces = ElementForces::new(mesh.tetrahedra(), &material, isa).unwrap();
            let expected = forces_on(isa, &mesh, &material, &u);
            let largest = expected.iter().fold(0.0f32, |most, f| most.max(f.abs()));
            let mut subset = Subset::new(&forces).unwrap();
            // Filled again and again in the room that it has: all, few, none, some.
            for (first, end) in [(0, all), (40, 42), (0, 0), (100, 400)] {
                let is_wanted = |node: u32| (first..end).contains(&node);
                let (found, volume) = forces_about(&mut subset, &forces, &mesh, is_wanted, &u);
                for node in first..end {
                    let found = found[node as usize].expect("all elements of a wanted node");
                    for (axis, found) in found.into_iter().enumerate() {
                        let error = (found - expected[3 * node as usize + axis]).abs();
                        assert!(error < 2e-5 * largest, "{isa:?}, node {node}: {error}");
                    }
                }
                let own: f64 = subset.tetrahedra().map(|(_, element)| element.volume).sum();
                assert!((own - volume).abs() <= 1e-5 * volume, "{own} of {volume}");
            }
        }
    }
}

/// A body of which some elements are gone and others have become two, one of them with copies of two nodes, against the same elements packed from nothing.
#[test]
fn a_cut_body_has_the_forces_of_its_elements_whatever_they_were_packed_with() {
    for (mesh, materials) in [
        (body(), vec![Material::default(), ogden_laws()[0]]),
        (mixed(), vec![Material::default()]),
        (fibred(), vec![Material::default()]),
    ] {
        check_cut(&mesh, &materials);
    }
}

fn check_cut(mesh: &Mesh, materials: &[Material]) {
    let count = mesh.tets.len();
    let is_gone = |element: &u32| mesh.tets[*element as usize].contains(&0);
    let mut changed: Vec<u32> = (0..count as u32).filter(|e| e % 7 == 0).collect();
    changed.extend((0..count as u32).filter(is_gone));
    changed.sort_unstable();
    changed.dedup();
    let mut positions = mesh.positions.clone();
    let mut cells = Vec::new();
    for (place, element) in changed
        .iter()
        .enumerate()
        .filter(|(at, element)| at % 3 > 0 && !is_gone(element))
    {
        let mut corners = mesh.tets[*element as usize];
        cells.push((
            place as u32,
            corners,
            0.4 * mesh.stiffness[*element as usize],
        ));
        for corner in &mut corners[..2] {
            positions.push(mesh.positions[*corner as usize]);
            *corner = positions.len() as u32 - 1;
        }
        cells.push((
            place as u32,
            corners,
            0.6 * mesh.stiffness[*element as usize],
        ));
    }
    let mut whole = mesh.clone();
    let is_left = |element: &usize| changed.binary_search(&(*element as u32)).is_err();
    let left: Vec<usize> = (0..count).filter(is_left).collect();
    whole.tets = left.iter().map(|element| mesh.tets[*element]).collect();
    whole.stiffness = left
        .iter()
        .map(|element| mesh.stiffness[*element])
        .collect();
    whole.tets.extend(cells.iter().map(|cell| cell.1));
    whole.stiffness.extend(cells.iter().map(|cell| cell.2));
    whole.positions = positions;
    let numbers = |element: &usize| mesh.region.get(*element).copied();
    let parents = cells.iter().map(|cell| changed[cell.0 as usize] as usize);
    let all = left.iter().copied().chain(parents);
    whole.fibre = (all.clone())
        .filter_map(|element| mesh.fibre.get(element).copied())
        .collect();
    whole.region = all.filter_map(|element| numbers(&element)).collect();
    let mut u = wave(&whole, 0.3);
    // What no element is left of may be turned inside out.
    assert!(!whole.tets.as_flattened().contains(&0));
    u[0] += 50.0;
    for material in materials {
        let (exact, least) = exact(&whole, material, &u);
        for isa in Isa::available() {
            let intact = ElementForces::new(mesh.tetrahedra(), material, isa).unwrap();
            let cut = CutTetrahedra {
                positions: &whole.positions,
                tets: &mesh.tets,
                stiffness: &mesh.stiffness,
                fibre: &mesh.fibre,
                changed: &changed,
                cells: &cells,
            };
            let own = intact.cut(cut, material).unwrap();
            let mut numbers: Vec<u32> = (0..own.chunk_count())
                .flat_map(|chunk| own.chunk_tetrahedra(chunk).map(|(number, _)| number))
                .collect();
            numbers.sort_unstable();
            let behind = count as u32..(count + cells.len()) as u32;
            let wanted: Vec<u32> = left.iter().map(|e| *e as u32).chain(behind).collect();
            assert_eq!(numbers, wanted);
            let mut scratch = own.scratch(1).unwrap();
            let mut out = vec![f32::NAN; u.len()];
            let det = own.evaluate(&u, &mut scratch, &mut out, &serial);
            assert!((f64::from(det) - least).abs() < 1e-4, "{det} {least}");
            let largest = exact.iter().fold(0.0f64, |most, f| most.max(f.abs()));
            for (found, wanted) in out.iter().zip(&exact) {
                let off = (f64::from(*found) - wanted).abs();
                assert!(off < 2e-5 * largest, "{isa:?}: {found} {wanted}");
            }
        }
    }
}
