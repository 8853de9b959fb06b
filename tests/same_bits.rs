//! The same bits for any thread count, region, form of input, and instance.

use fixture::{BUNDLES, bits, largest_difference, model, plain, push, rollout, scene, sparse};
use upt::{Contact, DecoderKernel, IndexSet, SceneOptions, StepInput};

/// Verifies REQ-030.
#[test]
fn one_two_and_four_threads_agree() {
    for name in BUNDLES {
        let model = model(name);
        let with = |threads| {
            let options = SceneOptions { threads, ..plain() };
            rollout(&scene(&model, &options), 18).concat()
        };
        let one = bits(&with(1));
        assert_eq!(one, bits(&with(2)), "{name}: 2 threads");
        assert_eq!(one, bits(&with(4)), "{name}: 4 threads");
    }
}

#[test]
fn a_region_is_a_part_of_the_full_state() {
    for name in BUNDLES {
        for kernel in [DecoderKernel::Native, DecoderKernel::Onnx] {
            let model = model(name);
            let options = SceneOptions { kernel, ..plain() };
            let full = scene(&model, &options);
            let part = scene(&model, &options);
            let mut region: Vec<u32> = model.indices(IndexSet::SurfaceNodes).to_vec();
            region.reverse();
            region.truncate(61);
            part.set_region(Some(&region)).unwrap();
            assert_eq!(part.region_count(), 61);
            for t in 0..18 {
                if t == 9 {
                    // Another region in the middle of a rollout: its last state is there at once.
                    region = (0..100).collect();
                    part.set_region(Some(&region)).unwrap();
                }
                let contact = push(&model, t);
                let (mut all, mut some) = (
                    vec![0.0; 3 * full.node_count()],
                    vec![0.0; 3 * region.len()],
                );
                full.step(sparse(&contact), Some(&mut all)).unwrap();
                part.step(sparse(&contact), Some(&mut some)).unwrap();
                let want: Vec<f32> = region
                    .iter()
                    .flat_map(|&node| all[3 * node as usize..3 * node as usize + 3].to_vec())
                    .collect();
                assert_eq!(bits(&some), bits(&want), "{name} {kernel:?} step {t}");
                // Nodes outside of the region, on demand, from the same state.
                let others: Vec<u32> = (0..full.node_count() as u32).rev().step_by(3).collect();
                let mut decoded = vec![0.0; 3 * others.len()];
                part.decode(&others, &mut decoded).unwrap();
                let want: Vec<f32> = others
                    .iter()
                    .flat_map(|&node| all[3 * node as usize..3 * node as usize + 3].to_vec())
                    .collect();
                assert_eq!(
                    bits(&decoded),
                    bits(&want),
                    "{name} {kernel:?} decode at step {t}"
                );
            }
            part.set_region(None).unwrap();
            assert_eq!(part.region_count(), full.node_count());
        }
    }
}

#[test]
fn dense_input_and_a_displacement_handed_back_change_nothing() {
    for name in BUNDLES {
        let model = model(name);
        let (a, b) = (scene(&model, &plain()), scene(&model, &plain()));
        let mut state = vec![0.0; 3 * a.node_count()];
        let mut out = state.clone();
        for t in 0..18 {
            let contact = push(&model, t);
            a.step(sparse(&contact), Some(&mut out)).unwrap();
            let mut dense = vec![0.0; 3 * a.node_count()];
            for (&node, c) in contact.0.iter().zip(contact.1.chunks_exact(3)) {
                dense[3 * node as usize..3 * node as usize + 3].copy_from_slice(c);
            }
            let handed = state.clone();
            let input = StepInput {
                displacement: Some(&handed),
                contact: Contact::Dense(&dense),
                ..StepInput::default()
            };
            b.step(input, Some(&mut state)).unwrap();
            assert_eq!(bits(&out), bits(&state), "{name} step {t}");
        }
    }
}

#[test]
fn the_order_of_sparse_contacts_does_not_matter() {
    for name in BUNDLES {
        let model = model(name);
        let (a, b) = (scene(&model, &plain()), scene(&model, &plain()));
        for t in 0..6 {
            let contact = push(&model, t);
            let reversed: (Vec<u32>, Vec<f32>) = (
                contact.0.iter().rev().copied().collect(),
                contact.1.chunks_exact(3).rev().flatten().copied().collect(),
            );
            let (mut x, mut y) = (vec![0.0; 3 * a.node_count()], vec![0.0; 3 * a.node_count()]);
            a.step(sparse(&contact), Some(&mut x)).unwrap();
            b.step(sparse(&reversed), Some(&mut y)).unwrap();
            assert_eq!(bits(&x), bits(&y));
            assert_eq!(
                b.last_contacts().unwrap(),
                reversed,
                "contacts are told in the host's order"
            );
        }
    }
}

#[test]
fn the_native_decoder_agrees_with_onnx_runtime() {
    let model = model("tiny-upt");
    let with = |kernel| {
        let options = SceneOptions { kernel, ..plain() };
        let scene = scene(&model, &options);
        let states = rollout(&scene, 12).concat();
        assert_eq!(scene.stats().kernel, kernel);
        states
    };
    let difference = largest_difference(&with(DecoderKernel::Native), &with(DecoderKernel::Onnx));
    assert!(difference < 1e-4, "{difference} mm");
}

#[test]
fn a_displacement_from_elsewhere_is_taken_over() {
    for name in BUNDLES {
        let model = model(name);
        let source = scene(&model, &plain());
        let states = rollout(&source, 4);
        let fresh = scene(&model, &plain());
        let (mut own, mut taken) = (states[3].clone(), states[3].clone());
        let contact = push(&model, 4);
        fresh.step(sparse(&contact), Some(&mut own)).unwrap();
        fresh.reset().unwrap();
        let input = StepInput {
            displacement: Some(&states[3]),
            ..sparse(&contact)
        };
        fresh.step(input, Some(&mut taken)).unwrap();
        assert!(
            largest_difference(&own, &taken) > 1e-4,
            "{name}: the displacement must matter"
        );
    }
}
