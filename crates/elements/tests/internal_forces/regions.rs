//! Regions with a law of their own.

use super::bodies::{blocks, body, forces_on, mixed, ogden_laws, wave};
use super::check_of;
use elements::{Isa, Law, Material, Ogden};
use tissue::mesh::Mesh;

#[test]
fn bodies_of_several_laws_have_the_forces_of_each() {
    for material in [Material::default(), ogden_laws()[1]] {
        check_of(&mixed(), &material, 0.6);
    }
    let one = blocks(&[ogden_laws()[0].law; 3]);
    let u = wave(&one, 0.6);
    for isa in Isa::available() {
        // A body of one law that regions name has the bits of one that the material names.
        let mut named = one.clone();
        named.region.fill(2);
        assert_eq!(
            forces_on(isa, &named, &Material::default(), &u),
            forces_on(
                isa,
                &body(),
                &Material {
                    young_pa: 3000.0,
                    ..ogden_laws()[0]
                },
                &u
            )
        );
    }
}

#[test]
fn a_region_has_a_density_of_its_own() {
    let mut mesh = mixed();
    mesh.regions[1].density_kg_m3 = Some(1850.0);
    let of = |number: u8| {
        let at = mesh.region.iter().position(|own| *own == number).unwrap();
        mesh.laws().density_of(at, 1000.0)
    };
    assert_eq!([0, 1, 2, 3].map(of), [1000.0, 1000.0, 1850.0, 1000.0]);
    assert_eq!(body().laws().density_of(0, 990.0), 990.0);
    for density in [0.0, -1.0, f64::NAN, 1e6] {
        mesh.regions[1].density_kg_m3 = Some(density);
        let error = mesh.laws().check(mesh.tets.len()).unwrap_err().to_string();
        assert!(error.contains("region `1`: density_kg_m3"), "{error}");
    }
}

#[test]
fn faults_of_regions_name_the_region() {
    let material = Material::default();
    let check = |change: &dyn Fn(&mut Mesh)| {
        let mut mesh = mixed();
        change(&mut mesh);
        mesh.check_laws(&material).unwrap_err().to_string()
    };
    let ogden = |mu: f64| Law::Ogden(Ogden::new(&[[mu, -18.0]]).unwrap());
    // The blocks have other moduli than their laws.
    assert!(check(&|_| ()).contains("region `1`: stiffness of tetrahedron"));
    assert!(check(&|mesh| mesh.regions[1].law = ogden(163.0)).contains("region `1`: law.terms[0]"));
    assert!(check(&|mesh| mesh.regions[2].law = ogden(-0.163)).contains("not kPa"));
    assert!(check(&|mesh| mesh.regions[1].name = "0".into()).contains("region `0`"));
    assert!(check(&|mesh| mesh.region[7] = 4).contains("region of tetrahedron 7"));
    assert!(check(&|mesh| mesh.region.truncate(5)).contains("`region`"));
    assert!(check(&|mesh| mesh.region.clear()).contains("`region`"));
    let mut good = mixed();
    let factor = |law: &Law| (law.young_pa(0.49).unwrap_or(3000.0) / 3000.0) as f32;
    let laws: Vec<f32> = good
        .regions
        .iter()
        .map(|region| factor(&region.law))
        .collect();
    let of = |number: &u8| {
        number
            .checked_sub(1)
            .map_or(1.0, |at| laws[usize::from(at)])
    };
    good.stiffness = good.region.iter().map(of).collect();
    good.check_laws(&material).unwrap();
}
