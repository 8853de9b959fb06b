//! The Rust interface with fields as arrays: the same bits as with slices, and errors that say what to do.

use ndarray::{Array2, s};
use upt::{Contact, IndexSet, Model, ModelOptions, SceneOptions, StepInput};

fn model() -> std::sync::Arc<Model> {
    fixture::find_runtime();
    Model::open(&fixture::path("tiny-upt"), &ModelOptions::default()).unwrap()
}

#[test]
fn a_step_by_arrays_has_the_bits_of_a_step_by_slices() {
    let model = model();
    let rest = model.rest();
    assert_eq!(rest.as_slice().unwrap(), model.positions());
    let tets = model.elements(IndexSet::Tets);
    assert_eq!(tets.ncols(), 4);
    assert_eq!(tets[[0, 3]], model.indices(IndexSet::Tets)[3]);

    let (by_arrays, by_slices) = (
        fixture::scene(&model, &SceneOptions::default()),
        fixture::scene(&model, &SceneOptions::default()),
    );
    let nodes = [model.indices(IndexSet::DomainNodes)[0]];
    let vectors = Array2::from_shape_vec((1, 3), vec![0.5, -1.0, 0.25]).unwrap();
    let mut field = Array2::<f32>::zeros(rest.raw_dim());
    field
        .slice_mut(s![nodes[0] as usize, ..])
        .assign(&vectors.row(0));
    for dense in [false, true] {
        let contact = match dense {
            true => Contact::field(field.view()).unwrap(),
            false => Contact::at(&nodes, vectors.view()).unwrap(),
        };
        let before = by_arrays.displacement().unwrap();
        let input = StepInput::from(contact);
        let input = input.with_displacement(before.view()).unwrap();
        by_arrays.step(input, None).unwrap();
        by_slices
            .step(
                Contact::Sparse {
                    nodes: &nodes,
                    vectors: vectors.as_slice().unwrap(),
                },
                None,
            )
            .unwrap();
    }
    let after = by_arrays.displacement().unwrap();
    assert_eq!(after, by_slices.displacement().unwrap());
    assert!(after.iter().any(|u| *u != 0.0));
}

#[test]
fn an_array_of_another_shape_is_named() {
    let two = Array2::<f32>::zeros((4, 2));
    let error = Contact::field(two.view()).unwrap_err().to_string();
    assert!(
        error.contains("collision field is [4, 2]") && error.contains("3 columns"),
        "{error}"
    );
    let turned = Array2::<f32>::zeros((3, 4));
    let error = Contact::field(turned.t()).unwrap_err().to_string();
    assert!(error.contains("as_standard_layout"), "{error}");
}
