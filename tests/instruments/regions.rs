//! Regions with laws of their own, in corrected steps, after a cut and from a snapshot; and files that cannot be.

use std::path::Path;

use safetensors::tensor::{Dtype, TensorView};
use safetensors::{SafeTensors, serialize};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use upt::{Error, Model, ModelOptions};

use super::cuts::{options, slit};
use super::*;

const MESH: &str = "mesh.safetensors";

/// Gives the tetrahedra of a bundle numbers of laws, from the heights of their first corners over the body's. The manifest names the laws as `named` has them.
pub fn mark(folder: &Path, number: impl Fn(f32) -> i32, laws: &Value, named: &Value) {
    let bytes = std::fs::read(folder.join(MESH)).unwrap();
    let file = SafeTensors::deserialize(&bytes).unwrap();
    let (_, header) = SafeTensors::read_metadata(&bytes).unwrap();
    let mut metadata = header.metadata().clone().unwrap();
    metadata.insert("laws".into(), laws.to_string());
    let words = |name: &str| -> Vec<u32> {
        let view = file.tensor(name).unwrap();
        let words = view.data().as_chunks::<4>().0.iter();
        words.map(|bytes| u32::from_le_bytes(*bytes)).collect()
    };
    let height: Vec<f32> = (words("positions").chunks(3))
        .map(|p| f32::from_bits(p[2]))
        .collect();
    let low = height.iter().copied().fold(f32::MAX, f32::min);
    let high = height.iter().copied().fold(f32::MIN, f32::max);
    let share = |tet: &[u32]| (height[tet[0] as usize] - low) / (high - low);
    let region: Vec<u8> = (words("tets").chunks(4))
        .flat_map(|tet| number(share(tet)).to_le_bytes())
        .collect();
    let mut hash = Sha256::new();
    for name in ["positions", "tets", "fixed", "supported", "stiffness"] {
        if let Ok(view) = file.tensor(name) {
            hash.update(view.data());
        }
    }
    hash.update(&region);
    hash.update(laws.to_string());
    let hash: String = hash.finalize().iter().map(|b| format!("{b:02x}")).collect();
    let mut views: Vec<(String, TensorView<'_>)> = file.tensors();
    let shape = vec![region.len() / 4];
    let own = TensorView::new(Dtype::I32, shape, &region).unwrap();
    views.push(("region".into(), own));
    let bytes = serialize(views, Some(metadata)).unwrap();
    std::fs::write(folder.join(MESH), &bytes).unwrap();
    let mut manifest = fixture::manifest(folder);
    manifest["mesh"]["mesh_sha256"] = hash.into();
    manifest["laws"] = named.clone();
    fixture::write_manifest(folder, &mut manifest);
    fixture::renew_hash(folder, MESH, &bytes);
}

fn liver() -> tempfile::TempDir {
    fixture::copy_of(fixture::shipped("liver-coarse"))
}

/// One region of a law; it has the body's modulus.
fn one(law: &Value) -> Value {
    json!([{"name": "lobe", "law": law}])
}

fn mooney() -> Value {
    json!({"name": "mooney-rivlin", "c01_share": 0.9})
}

/// Of the modulus of the bundle's material.
fn ogden(folder: &Path) -> Value {
    let material = &fixture::manifest(folder)["material"];
    let [young, poisson] = ["young_pa", "poisson"].map(|key| material[key].as_f64().unwrap());
    let mu = young / (1.0 + poisson) / -18.0;
    json!({"name": "ogden", "terms": [{"mu_pa": mu, "alpha": -18.0}]})
}

fn read(folder: &Path) -> Result<std::sync::Arc<Model>, Error> {
    Model::open(folder, &ModelOptions::default())
}

/// Presses, cuts, presses on, and goes back to before and on again.
fn play(folder: &Path) -> Vec<Vec<f32>> {
    let scene = Scene::new(read(folder).unwrap(), &options()).unwrap();
    let press = |t: i32| step(&scene, &[pressing(&scene, 0.8 * t as f32, Vector::ZERO)]);
    let mut all: Vec<Vec<f32>> = (1..5).map(press).collect();
    scene.cut(0, 2, &slit(&scene, 3.0, 12.0)).unwrap();
    let saved = scene.save().unwrap();
    let after: Vec<Vec<f32>> = (4..8).map(press).collect();
    assert!(after.iter().flatten().all(|x| x.is_finite()));
    let again = Scene::new(read(folder).unwrap(), &options()).unwrap();
    again.restore(&saved).unwrap();
    let press = |t: i32| step(&again, &[pressing(&again, 0.8 * t as f32, Vector::ZERO)]);
    assert_eq!((4..8).map(press).collect::<Vec<_>>(), after);
    all.extend(after);
    all
}

#[test]
fn a_region_that_is_the_whole_body_has_the_bits_of_the_materials_law() {
    for takes_displacements in [false, true] {
        let [own, marked, half] = [liver(), liver(), liver()];
        let law = match takes_displacements {
            true => ogden(own.path()),
            false => mooney(),
        };
        let mut manifest = fixture::manifest(own.path());
        manifest["material"]["law"] = law.clone();
        fixture::write_manifest(own.path(), &mut manifest);
        let laws = one(&law);
        mark(marked.path(), |_| 1, &laws, &laws);
        let whole = play(own.path());
        assert_eq!(play(marked.path()), whole);
        // Of a body that is neo-Hookean below it, and of that body alone.
        mark(half.path(), |share| i32::from(share > 0.5), &laws, &laws);
        let mixed = play(half.path());
        let plain = play(liver().path());
        let off = |a: &[Vec<f32>], b: &[Vec<f32>]| fixture::largest_difference(&a[3], &b[3]);
        let apart = off(&plain, &whole);
        println!(
            "laws are {apart} mm apart, mixed {} and {}",
            off(&mixed, &whole),
            off(&mixed, &plain)
        );
        assert!(apart > 0.02 && off(&mixed, &plain) > 0.1 * apart);
        assert!(off(&mixed, &whole) < apart);
    }
}

/// A density of a region is in the masses of a step as the material's own is.
#[test]
fn a_region_that_is_the_whole_body_has_the_bits_of_the_materials_density() {
    let [own, marked, plain] = [liver(), liver(), liver()];
    let density = 1300.0;
    let mut manifest = fixture::manifest(own.path());
    manifest["material"]["density_kg_m3"] = density.into();
    fixture::write_manifest(own.path(), &mut manifest);
    let law = json!({"name": "neo-hookean"});
    let laws = json!([{"name": "lobe", "law": law, "density_kg_m3": density}]);
    mark(marked.path(), |_| 1, &laws, &laws);
    let whole = play(own.path());
    assert_eq!(play(marked.path()), whole);
    let heavier = fixture::largest_difference(&whole[3], &play(plain.path())[3]);
    assert!(heavier > 1e-3, "{heavier} mm");
}

#[test]
fn laws_that_cannot_be_are_named_with_their_region() {
    let refused = |number: i32, laws: &Value, named: &Value, words: &[&str]| {
        let folder = liver();
        mark(folder.path(), |_| number, laws, named);
        let text = read(folder.path()).err().unwrap().to_string();
        for word in words {
            assert!(text.contains(word), "`{word}` in: {text}");
        }
    };
    let good = one(&mooney());
    refused(
        2,
        &good,
        &good,
        &["mesh.safetensors", "region", "must be in 0..2"],
    );
    refused(-1, &good, &good, &["region", "-1"]);
    refused(1, &json!([]), &json!([]), &["region", "must be in 0..1"]);
    let bad = one(&json!({"name": "ogden", "terms": [{"mu_pa": 157, "alpha": -18}]}));
    refused(1, &bad, &bad, &["region `lobe`", "law.terms[0].mu_pa"]);
    let kilo = one(&json!({"name": "ogden", "terms": [{"mu_pa": -0.157, "alpha": -18}]}));
    refused(1, &kilo, &kilo, &["region `lobe`", "not kPa"]);
    let other = one(&json!({"name": "ogden", "terms": [{"mu_pa": -900, "alpha": -18}]}));
    refused(
        1,
        &other,
        &other,
        &["region `lobe`: stiffness of tetrahedron 0", "in Pa"],
    );
    // The material of the liver does not relax; where it does, no region may keep more.
    let relaxing = |share: f64| json!([{"name": "lobe", "law": {"name": "neo-hookean"}, "relaxation": [{"share": share, "tau_s": 0.5}]}]);
    let too_much = relaxing(1.5);
    refused(
        1,
        &too_much,
        &too_much,
        &["region `lobe`: relaxation[0].share is 1.5"],
    );
    let folder = liver();
    let mut manifest = fixture::manifest(folder.path());
    manifest["material"]["relaxation"] = json!([{"share": 0.6, "tau_s": 0.05}]);
    fixture::write_manifest(folder.path(), &mut manifest);
    let less = relaxing(0.1);
    mark(folder.path(), |_| 1, &less, &less);
    let text = read(folder.path()).err().unwrap().to_string();
    for word in ["region `lobe`: relaxation", "the tissue that relaxes least"] {
        assert!(text.contains(word), "`{word}` in: {text}");
    }
    let twice = json!([{"name": "lobe", "law": mooney()}, {"name": "lobe", "law": mooney()}]);
    refused(1, &twice, &twice, &["region `lobe`", "a name of its own"]);
    let unknown = json!([{"name": "lobe", "law": mooney(), "kappa": 1}]);
    refused(1, &unknown, &good, &["laws", "kappa"]);
    refused(
        1,
        &good,
        &json!([]),
        &["bundle.json", "laws[0]", "is nothing", "lobe"],
    );
    refused(
        1,
        &good,
        &one(&json!({"name": "neo-hookean"})),
        &["laws[0]", "mooney-rivlin"],
    );
}
