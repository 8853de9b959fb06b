//! A snapshot whose state cannot be computed again changes nothing.

use fixture::{bits, copy_of, find_runtime, plain, push, renew_hash, scene};
use sha2::{Digest, Sha256};
use upt::{Contact, Model, ModelOptions, Scene};

fn touch(scene: &Scene, nodes: &[u32], depth: f32) -> upt::Result<()> {
    let vectors = [0.1, 0.0, -depth].repeat(nodes.len());
    let contact = Contact::Sparse {
        nodes,
        vectors: &vectors,
    };
    scene.step(contact, None)
}

/// A bundle in which the contact of two nodes has no solution, though each alone has one.
fn entangled(a: u32, b: u32) -> (tempfile::TempDir, std::sync::Arc<Model>) {
    let folder = copy_of("tiny-reduced");
    let path = folder.path().join("prior.safetensors");
    let mut bytes = std::fs::read(&path).unwrap();
    let (start, dofs, columns) = {
        let file = safetensors::SafeTensors::deserialize(&bytes).unwrap();
        let table = file.tensor("compliance").unwrap();
        let start = table.data().as_ptr() as usize - bytes.as_ptr() as usize;
        let nodes = file.tensor("contact_nodes").unwrap();
        let nodes: Vec<u32> = nodes
            .data()
            .as_chunks::<4>()
            .0
            .iter()
            .map(|b| u32::from_le_bytes(*b))
            .collect();
        let columns = [a, b].map(|node| nodes.binary_search(&node).unwrap());
        (start, table.shape()[0], columns)
    };
    let mut set = |row: usize, column: usize| {
        let at = start + 4 * (3 * row * dofs + 3 * column);
        bytes[at..at + 4].copy_from_slice(&1e6f32.to_le_bytes());
    };
    set(columns[0], columns[1]);
    set(columns[1], columns[0]);
    std::fs::write(&path, &bytes).unwrap();
    renew_hash(folder.path(), "prior.safetensors", &bytes);
    let model = Model::open(folder.path(), &ModelOptions::default()).unwrap();
    (folder, model)
}

#[test]
fn a_snapshot_that_cannot_be_computed_again_changes_nothing() {
    find_runtime();
    let nodes = push(&fixture::model("tiny-reduced"), 0).0;
    let (a, b, c) = (nodes[0], nodes[1], nodes[2]);
    let (_folder, model) = entangled(a, b);
    let other = scene(&model, &plain());
    touch(&other, &[a, c], 2.0).unwrap();
    // The same snapshot with `b` in the place of `c`.
    let mut snapshot = other.save().unwrap();
    let body = snapshot.len() - 32;
    let pair = [a.to_le_bytes(), c.to_le_bytes()].concat();
    let at = snapshot.windows(8).position(|w| w == pair).unwrap();
    snapshot[at + 4..at + 8].copy_from_slice(&b.to_le_bytes());
    let digest = Sha256::digest(&snapshot[..body]);
    snapshot[body..].copy_from_slice(&digest);

    let scene = scene(&model, &plain());
    for depth in [1.0, 2.5] {
        touch(&scene, &[c], depth).unwrap();
    }
    let mut state = vec![0.0; 3 * scene.node_count()];
    scene.read(&mut state).unwrap();
    let saved = scene.save().unwrap();
    let error = scene.restore(&snapshot).unwrap_err();
    assert!(error.to_string().contains("positive definite"), "{error}");
    let mut after = state.clone();
    scene.read(&mut after).unwrap();
    assert_eq!(bits(&state), bits(&after));
    assert_eq!(saved, scene.save().unwrap(), "every part of the state");
    assert_eq!(scene.last_contacts().unwrap().0, [c]);
    // And it goes on as if nothing had been asked.
    touch(&scene, &[c], 3.0).unwrap();
    let twin = fixture::scene(&model, &plain());
    for depth in [1.0, 2.5, 3.0] {
        touch(&twin, &[c], depth).unwrap();
    }
    let mut want = state.clone();
    twin.read(&mut want).unwrap();
    scene.read(&mut after).unwrap();
    assert_eq!(bits(&want), bits(&after));
}

#[test]
fn a_restored_scene_knows_its_contacts() {
    let model = fixture::model("tiny-reduced");
    let original = scene(&model, &plain());
    let nodes = push(&model, 0).0;
    touch(&original, &nodes[..2], 2.0).unwrap();
    let restored = scene(&model, &plain());
    touch(&restored, &nodes[1..], 1.0).unwrap();
    restored.restore(&original.save().unwrap()).unwrap();
    assert_eq!(
        restored.last_contacts().unwrap(),
        original.last_contacts().unwrap()
    );
    #[cfg(feature = "instruments")]
    {
        let (mut a, mut b) = ([0.0; 6], [0.0; 6]);
        original.contact_force(&mut a).unwrap();
        restored.contact_force(&mut b).unwrap();
        assert_eq!(bits(&a), bits(&b));
    }
}
