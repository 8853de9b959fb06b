//! A scene against independent references: numpy for kind `reduced`, the bundle's own graphs and the rollout of the
//! Python evaluation for kind `upt`.

use fixture::{largest_difference, model, path, plain, push, scene, sparse};
use upt::bundle::TensorFile;
use upt::onnx::{ProviderPlan, Runtime, Stage, StageOptions};
use upt::{Contact, flag};

fn tensors(name: &str) -> TensorFile {
    TensorFile::parse(name, std::fs::read(path(name)).unwrap()).unwrap()
}

/// The scene against a stored rollout of the bundle; the flags that were set.
fn follow(name: &str) -> u32 {
    let model = model(name);
    let scene = scene(&model, &plain());
    let reference = tensors(&format!("{name}-rollout.safetensors"));
    let count = scene.node_count();
    let fields = reference
        .f32("displacement", &[None, Some(count), Some(3)])
        .unwrap();
    let offsets = reference.offsets("contact_offsets", 1000).unwrap();
    let nodes = reference.indices("contact_nodes", &[None], count).unwrap();
    let vectors = reference.f32("contact_vectors", &[None, Some(3)]).unwrap();
    let mut out = vec![0.0; 3 * count];
    let mut flags = 0;
    for (t, want) in fields.chunks_exact(3 * count).enumerate() {
        let rows = offsets[t]..offsets[t + 1];
        scene
            .step(
                Contact::Sparse {
                    nodes: &nodes[rows.clone()],
                    vectors: &vectors[3 * rows.start..3 * rows.end],
                },
                Some(&mut out),
            )
            .unwrap();
        flags |= scene.stats().flags;
        let difference = largest_difference(&out, want);
        assert!(difference < 1e-4, "{name}, step {t}: {difference} mm");
    }
    flags
}

#[test]
fn a_reduced_scene_follows_the_numpy_rollout() {
    assert_ne!(
        follow("tiny-reduced") & flag::CLAMPED,
        0,
        "the rollout is made to reach the bound"
    );
}

/// What `python -m upt_training evaluate` computes: linear response, free vibration, network, boundary conditions.
#[test]
fn a_upt_scene_with_a_prior_follows_the_rollout_of_the_evaluation() {
    follow("tiny-upt-prior");
}

/// One graph of the bundle with fixed shapes.
fn graph(name: &str, inputs: &[(&str, &[usize])], outputs: &[(&str, &[usize])]) -> Stage {
    let options = StageOptions {
        threads: 1,
        plan: ProviderPlan::cpu(),
    };
    let bytes = std::fs::read(path("tiny-upt").join(name)).unwrap();
    Stage::new(
        Runtime::get(None).unwrap(),
        name,
        &bytes,
        inputs,
        outputs,
        &options,
    )
    .unwrap()
}

fn gelu(x: f32) -> f32 {
    0.5 * x * (1.0 + libm::erff(x / std::f32::consts::SQRT_2))
}

#[test]
fn a_upt_scene_follows_its_graphs() {
    let model = model("tiny-upt");
    let scene = scene(&model, &plain());
    let upt::model::KindModel::Upt(kind) = &model.kind else {
        panic!("kind")
    };
    let (k, f, dims) = (
        scene.node_count(),
        kind.entry.feature_width(),
        kind.entry.dims,
    );
    let (d, q, l, h) = (dims.encoder, dims.query, dims.latent_tokens, dims.decoder);
    let graph_edges = &kind.tables.graph;
    let count = graph_edges.supernodes.len();
    let mut embed = graph(
        "embed.onnx",
        &[("positions", &[k, 3])],
        &[
            ("source_table", &[k, d]),
            ("target_table", &[k, d]),
            ("query_table", &[k, q]),
        ],
    );
    embed.input(0).copy_from_slice(model.positions());
    embed.run().unwrap();
    let mut encoder = graph(
        "encoder.onnx",
        &[
            ("features", &[k, f]),
            ("source_table", &[k, d]),
            ("target_table", &[k, d]),
        ],
        &[("source", &[k, d]), ("target", &[k, d])],
    );
    encoder.input(1).copy_from_slice(embed.output(0));
    encoder.input(2).copy_from_slice(embed.output(1));
    let mut latent = graph(
        "latent.onnx",
        &[("supernodes", &[count, d])],
        &[("keys", &[l, h]), ("values", &[l, h])],
    );
    let mut decoder = graph(
        "decoder.onnx",
        &[("queries", &[k, q]), ("keys", &[l, h]), ("values", &[l, h])],
        &[("displacement", &[k, 3])],
    );
    decoder.input(0).copy_from_slice(embed.output(2));

    let norm = kind.entry.normalisation;
    let (mut now, mut before) = (vec![0.0f32; 3 * k], vec![0.0f32; 3 * k]);
    let mut out = vec![0.0; 3 * k];
    for t in 0..18 {
        let contact = push(&model, t);
        // tiny-upt: features displacement, collision, previous_displacement, contact; base none.
        let mut field = vec![0.0f32; 3 * k];
        let mut mask = vec![0.0f32; k];
        for (&node, c) in contact.0.iter().zip(contact.1.chunks_exact(3)) {
            field[3 * node as usize..3 * node as usize + 3].copy_from_slice(c);
            mask[node as usize] = 1.0;
        }
        for (i, row) in encoder.input(0).chunks_exact_mut(f).enumerate() {
            for (group, values) in [&now, &field, &before].into_iter().enumerate() {
                for axis in 0..3 {
                    row[3 * group + axis] =
                        (values[3 * i + axis] - norm.mean[axis]) / norm.std[axis];
                }
            }
            row[9] = mask[i];
        }
        encoder.run().unwrap();
        let (source, target) = (encoder.output(0).to_vec(), encoder.output(1).to_vec());
        for (row, out) in latent.input(0).chunks_exact_mut(d).enumerate() {
            let edges = graph_edges.offsets[row] as usize..graph_edges.offsets[row + 1] as usize;
            let degree = edges.len() as f32;
            let i = graph_edges.supernodes[row] as usize;
            for (c, out) in out.iter_mut().enumerate() {
                *out = graph_edges.neighbours[edges.clone()]
                    .iter()
                    .map(|&j| gelu(source[j as usize * d + c] + target[i * d + c]))
                    .sum::<f32>()
                    / degree;
            }
        }
        latent.run().unwrap();
        decoder.input(1).copy_from_slice(latent.output(0));
        decoder.input(2).copy_from_slice(latent.output(1));
        decoder.run().unwrap();
        before.copy_from_slice(&now);
        now.copy_from_slice(decoder.output(0));
        for (&node, c) in contact.0.iter().zip(contact.1.chunks_exact(3)) {
            now[3 * node as usize..3 * node as usize + 3].copy_from_slice(c);
        }
        for &node in model.indices(upt::IndexSet::HeldNodes) {
            now[3 * node as usize..3 * node as usize + 3].fill(0.0);
        }

        scene.step(sparse(&contact), Some(&mut out)).unwrap();
        let difference = largest_difference(&out, &now);
        assert!(difference < 2e-4, "step {t}: {difference} mm");
    }
    assert!(
        now.iter().any(|u| u.abs() > 0.01),
        "the fixture's network is not silent"
    );
}
