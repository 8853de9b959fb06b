//! A response that leaves out what a contact node does not reach, and residual modes in a file of their own.

use std::collections::BTreeMap;
use std::path::Path;

use safetensors::tensor::{Dtype, TensorView};
use safetensors::{SafeTensors, serialize};

use super::fixture::{self, copy_of, find_runtime};
use super::open;
use half::f16;
use upt::{Model, ModelOptions};

type Tensors = BTreeMap<String, (Dtype, Vec<usize>, Vec<u8>)>;

const FILE: &str = "prior.safetensors";
const LEARNED: [&str; 3] = ["residual", "force_to_z", "force_to_p"];

fn tensors(folder: &Path) -> Tensors {
    let bytes = std::fs::read(folder.join(FILE)).unwrap();
    let file = SafeTensors::deserialize(&bytes).unwrap();
    let list = file.tensors().into_iter();
    list.map(|(name, view)| {
        let data = view.data().to_vec();
        (name, (view.dtype(), view.shape().to_vec(), data))
    })
    .collect()
}

fn write(folder: &Path, name: &str, tensors: &Tensors) {
    let views = tensors.iter().map(|(name, (dtype, shape, data))| {
        let view = TensorView::new(*dtype, shape.clone(), data).unwrap();
        (name.clone(), view)
    });
    let bytes = serialize(views, None).unwrap();
    std::fs::write(folder.join(name), &bytes).unwrap();
    fixture::renew_hash(folder, name, &bytes);
}

/// How many eights of each block's coordinates a node keeps: all, but of the last block of the first nodes all but one.
fn eights(ranks: &[usize], node: usize) -> Vec<usize> {
    let mut kept: Vec<usize> = ranks.iter().map(|rank| rank / 8).collect();
    if node < 20 {
        *kept.last_mut().unwrap() -= 1;
    }
    kept
}

/// The response in float16, with zeros where [`eights`] keeps nothing, whole and ragged.
fn responses(old: &Tensors) -> (Tensors, Tensors) {
    let numbers = |name: &str| -> Vec<u32> {
        let bytes = old[name].2.chunks_exact(4);
        bytes
            .map(|b| u32::from_le_bytes(b.try_into().unwrap()))
            .collect()
    };
    let offsets = numbers("rank_offsets");
    let ranks: Vec<usize> = offsets
        .windows(2)
        .map(|pair| (pair[1] - pair[0]) as usize)
        .collect();
    let width = *offsets.last().unwrap() as usize;
    let (mut whole, mut ragged, mut kept) = (Vec::new(), Vec::new(), Vec::new());
    for (row, values) in numbers("response").chunks_exact(width).enumerate() {
        let own = eights(&ranks, row / 3);
        if row % 3 == 0 {
            kept.extend(own.iter().map(|&count| count as u8));
        }
        for (block, &count) in own.iter().enumerate() {
            let start = offsets[block] as usize;
            for (at, &bits) in values[start..start + ranks[block]].iter().enumerate() {
                let half = f16::from_f32(f32::from_bits(bits)).to_le_bytes();
                match at < 8 * count {
                    true => {
                        whole.extend(half);
                        ragged.extend(half);
                    }
                    false => whole.extend([0, 0]),
                }
            }
        }
    }
    let shape = old["response"].1.clone();
    let mut dense = old.clone();
    dense.insert("response".into(), (Dtype::F16, shape.clone(), whole));
    let mut sparse = old.clone();
    let count = ragged.len() / 2;
    sparse.insert("response".into(), (Dtype::F16, vec![count], ragged));
    let ranks = vec![shape[0] / 3, ranks.len()];
    sparse.insert("response_ranks".into(), (Dtype::U8, ranks, kept));
    (dense, sparse)
}

fn steps(folder: &Path) -> Vec<Vec<f32>> {
    let model = Model::open(folder, &ModelOptions::default()).unwrap();
    fixture::rollout(&fixture::scene(&model, &fixture::plain()), 12)
}

#[test]
fn a_ragged_response_is_the_whole_one_with_zeros() {
    find_runtime();
    let folder = copy_of("tiny-reduced");
    let (whole, ragged) = responses(&tensors(folder.path()));
    write(folder.path(), FILE, &whole);
    let expected = steps(folder.path());
    write(folder.path(), FILE, &ragged);
    assert_eq!(steps(folder.path()), expected);

    // The learned part in a file of its own, so that the response can be shared.
    let (mut shared, mut learned) = (ragged, Tensors::new());
    for name in LEARNED {
        learned.insert(name.into(), shared.remove(name).unwrap());
    }
    write(folder.path(), FILE, &shared);
    write(folder.path(), "residual.safetensors", &learned);
    let text = open(folder.path()).unwrap_err().to_string();
    assert!(text.contains(FILE) && text.contains("is missing"), "{text}");
    let mut manifest = fixture::manifest(folder.path());
    manifest["prior"]["residual"] = "residual.safetensors".into();
    fixture::write_manifest(folder.path(), &mut manifest);
    assert_eq!(steps(folder.path()), expected);
}

/// Verifies REQ-001.
#[test]
fn a_ragged_response_that_does_not_fit_is_refused() {
    find_runtime();
    let folder = copy_of("tiny-reduced");
    let (_, good) = responses(&tensors(folder.path()));
    type Damage = fn(&mut Tensors);
    let cases: [(&str, Damage); 4] = [
        ("response_ranks", |file| {
            file.get_mut("response_ranks").unwrap().2[1] = 200
        }),
        ("tensor `response`", |file| {
            file.get_mut("response_ranks").unwrap().2[2] -= 1
        }),
        ("response_ranks", |file| {
            let (dtype, _, data) = &file["response_ranks"];
            let flat = (*dtype, vec![data.len()], data.clone());
            file.insert("response_ranks".into(), flat);
        }),
        ("leave less than one in 64", |file| {
            file.get_mut("response_ranks").unwrap().2.fill(0);
            file.insert("response".into(), (Dtype::F16, vec![0], Vec::new()));
        }),
    ];
    for (word, damage) in cases {
        let mut file = good.clone();
        damage(&mut file);
        write(folder.path(), FILE, &file);
        let error = open(folder.path()).unwrap_err();
        let text = error.to_string();
        assert_eq!(error.status(), -31, "{text}");
        assert!(
            text.contains(FILE) && text.contains(word),
            "`{word}` in: {text}"
        );
    }
}
