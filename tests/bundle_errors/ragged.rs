//! A response that leaves out what a contact node does not reach, tables in steps, and residual modes in a file of their own.

use std::collections::BTreeMap;
use std::path::Path;

use safetensors::tensor::{Dtype, TensorView};
use safetensors::{SafeTensors, serialize};

use super::open;
use fixture::{self, copy_of, find_runtime};
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

/// The response and the basis in codes of 16 bits, and as float16 of the same numbers. The step of the response is its largest number over 30,000.
fn in_steps(old: &Tensors) -> (Tensors, Tensors) {
    let floats = |name: &str| -> Vec<f32> {
        let bytes = old[name].2.chunks_exact(4);
        bytes
            .map(|b| f32::from_le_bytes(b.try_into().unwrap()))
            .collect()
    };
    let offsets = |name: &str| -> Vec<usize> {
        let numbers = floats(name);
        numbers.iter().map(|x| x.to_bits() as usize).collect()
    };
    let (response, basis) = (floats("response"), floats("basis"));
    let (columns, width) = (old["response"].1[0] / 3, old["response"].1[1]);
    let (blocks, ranks) = (offsets("block_offsets"), offsets("rank_offsets"));
    let step_of = |table: &[f32]| table.iter().fold(0.0f32, |most, x| most.max(x.abs())) / 30_000.0;
    let (mut plain, mut coded) = (old.clone(), old.clone());
    let mut put = |name: &str, table: &[f32], order: &[usize], widths: Vec<usize>, steps: usize| {
        let step = step_of(table);
        let code = |at: usize| (table[at] / step).round() as i16;
        let half = (0..table.len())
            .flat_map(|at| f16::from_f32(f32::from(code(at)) * step).to_le_bytes())
            .collect();
        plain.insert(name.into(), (Dtype::F16, old[name].1.clone(), half));
        let codes: Vec<u8> = order
            .iter()
            .flat_map(|&at| code(at).to_le_bytes())
            .collect();
        coded.insert(name.into(), (Dtype::U8, vec![codes.len()], codes));
        let all = vec![0xFF; widths.iter().product()];
        coded.insert(format!("{name}_widths"), (Dtype::U8, widths, all));
        let list = step.to_le_bytes().repeat(steps);
        coded.insert(format!("{name}_step"), (Dtype::F32, vec![steps], list));
    };
    let mut order = Vec::new();
    for node in 0..columns {
        for group in 0..width / 8 {
            for axis in 0..3 {
                order.extend((0..8).map(|at| (3 * node + axis) * width + 8 * group + at));
            }
        }
    }
    let stride = (width / 8).div_ceil(4);
    put(
        "response",
        &response,
        &order,
        vec![columns, stride],
        columns,
    );
    let (mut order, mut start) = (Vec::new(), 0);
    for (nodes, pair) in blocks.windows(2).zip(ranks.windows(2)) {
        let (rows, rank) = (3 * (nodes[1] - nodes[0]), pair[1] - pair[0]);
        for group in 0..rank / 8 {
            for row in 0..rows {
                order.extend((0..8).map(|at| start + row * rank + 8 * group + at));
            }
        }
        start += rows * rank;
    }
    put("basis", &basis, &order, vec![stride], width / 8);
    (plain, coded)
}

#[test]
fn tables_in_steps_are_those_of_their_numbers() {
    find_runtime();
    let folder = copy_of("tiny-reduced");
    let (plain, coded) = in_steps(&tensors(folder.path()));
    write(folder.path(), FILE, &plain);
    let expected = steps(folder.path());
    write(folder.path(), FILE, &coded);
    assert_eq!(steps(folder.path()), expected);
}

/// Verifies REQ-001.
#[test]
fn tables_in_steps_that_do_not_fit_are_refused() {
    find_runtime();
    let folder = copy_of("tiny-reduced");
    let (_, good) = in_steps(&tensors(folder.path()));
    type Damage = fn(&mut Tensors);
    fn shorter(file: &mut Tensors, name: &str) {
        let (dtype, _, mut data) = file[name].clone();
        data.truncate(data.len() - 4);
        let count = data.len() / if dtype == Dtype::F32 { 4 } else { 1 };
        file.insert(name.into(), (dtype, vec![count], data));
    }
    let cases: [(&str, Damage); 9] = [
        ("tensor `response`", |file| shorter(file, "response")),
        ("tensor `basis`", |file| shorter(file, "basis")),
        ("tensor `response_step`", |file| {
            shorter(file, "response_step")
        }),
        ("tensor `basis_step`", |file| shorter(file, "basis_step")),
        ("tensor `response`", |file| {
            file.get_mut("response_widths").unwrap().2[0] ^= 1
        }),
        ("tensor `basis`", |file| {
            file.get_mut("basis_widths").unwrap().2[0] ^= 2
        }),
        (
            "`response_step`: element 1 is -1, must be above 0",
            |file| {
                let step = &mut file.get_mut("response_step").unwrap().2;
                step[4..8].copy_from_slice(&(-1.0f32).to_le_bytes());
            },
        ),
        ("tensor `basis_widths`: is missing", |file| {
            file.remove("basis_widths");
        }),
        ("leave less than one in 64", |file| {
            file.get_mut("response_widths").unwrap().2.fill(0);
            file.insert("response".into(), (Dtype::U8, vec![0], Vec::new()));
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
