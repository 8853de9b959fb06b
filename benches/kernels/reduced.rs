//! The tables and the contact solve of a reduced bundle against their scalar references: K = 21,632 nodes in 64 blocks
//! of rank 48, 60 nodes in contact.

use half::f16;
use upt::kernels::contact::ContactFactor;
use upt::kernels::random::Random;
use upt::kernels::respond::accumulate_rows;
use upt::kernels::rows::{BlockBasis, RowPlan, Stored, decode_rows};
use upt::kernels::{Isa, Pool};

use super::measure::{Row, medians, relative_error};

pub fn tables() {
    let (block_count, block_nodes, rank) = (64usize, 338usize, 48usize);
    let mut random = Random::new(3);
    let nodes: Vec<u32> = (0..(block_count * block_nodes) as u32).collect();
    let blocks: Vec<u32> = (0..=block_count)
        .map(|k| (k * block_nodes) as u32)
        .collect();
    let ranks: Vec<u32> = (0..=block_count).map(|k| (k * rank) as u32).collect();
    let wide = random.normal(3 * nodes.len() * rank, 1.0);
    let half: Vec<f16> = wide.iter().map(|&x| f16::from_f32(x)).collect();
    let q = random.normal(block_count * rank, 1.0);
    let rows: Vec<u32> = (0..180).collect();
    let factors = random.normal(180, 1.0);
    let basis = |stored| BlockBasis {
        block_nodes: &nodes,
        block_offsets: &blocks,
        rank_offsets: &ranks,
        basis: stored,
        copies: None,
    };
    let stored = [("f32", Stored::F32(&wide)), ("f16", Stored::F16(&half))];
    let cases: Vec<(Isa, usize, &str, Stored)> =
        std::iter::once((Isa::Scalar, 1, stored[0].0, stored[0].1))
            .chain(stored.into_iter().flat_map(|(name, stored)| {
                [1, 2].map(|threads| (Isa::detect(), threads, name, stored))
            }))
            .collect();
    let pools = [1, 2].map(|threads| Pool::new(threads).expect("threads"));
    let plan = RowPlan::full(&basis(stored[0].1));
    for (what, length) in [
        ("rows of the basis", 3 * nodes.len()),
        ("response of 60 nodes", q.len()),
    ] {
        let mut outs = vec![vec![0.0; length]; cases.len()];
        let mut rivals: Vec<Box<dyn FnMut() + '_>> = Vec::new();
        for (&(isa, threads, _, stored), out) in cases.iter().zip(&mut outs) {
            let (pool, plan, q, rows, factors) = (&pools[threads - 1], &plan, &q, &rows, &factors);
            let basis = basis(stored);
            let decodes = length != q.len();
            rivals.push(Box::new(move || {
                if decodes {
                    decode_rows(isa, pool, &basis, plan, q, out)
                } else {
                    accumulate_rows(isa, pool, stored, rows, factors, false, out)
                }
                .expect("valid shapes");
            }));
        }
        let seconds = medians(&mut rivals);
        drop(rivals);
        for (i, (isa, threads, name, _)) in cases.iter().enumerate().skip(1) {
            let name = format!("table/{what}/{name}, {}, {threads} threads", isa.name());
            Row::new(name, 1e6 * seconds[i], "us")
                .against("scalar, f32", seconds[0] / seconds[i])
                .error(relative_error(&outs[i], &outs[0]))
                .print();
        }
    }
}

pub fn contact() {
    for nodes in [20usize, 60, 120] {
        let n = 3 * nodes;
        let a: Vec<f32> = (0..n * n)
            .map(|i| 0.01 / (1.0 + (i / n).abs_diff(i % n) as f32))
            .collect();
        let dofs: Vec<u32> = (0..n as u32).collect();
        let displacement = vec![1.0; n];
        let sets = [Isa::Scalar, Isa::detect()];
        let mut factors = sets.map(|_| ContactFactor::with_capacity(n));
        let mut rivals: Vec<Box<dyn FnMut() + '_>> = Vec::new();
        for (&isa, factor) in sets.iter().zip(&mut factors) {
            let (a, dofs) = (&a, &dofs);
            rivals.push(Box::new(move || {
                let fill = |upper: &mut [f64]| {
                    for (to, &from) in upper.iter_mut().zip(a) {
                        *to = f64::from(from);
                    }
                };
                factor.factor(isa, dofs, fill).expect("positive definite");
            }));
        }
        let factor_seconds = medians(&mut rivals);
        drop(rivals);
        let mut forces = sets.map(|_| vec![0.0; n]);
        let mut rivals: Vec<Box<dyn FnMut() + '_>> = Vec::new();
        for ((&isa, factor), forces) in sets.iter().zip(&mut factors).zip(&mut forces) {
            let displacement = &displacement;
            rivals.push(Box::new(move || factor.solve(isa, displacement, forces)));
        }
        let solve_seconds = medians(&mut rivals);
        drop(rivals);
        let error = relative_error(&forces[1], &forces[0]);
        for (what, seconds) in [("factor", factor_seconds), ("solve", solve_seconds)] {
            let name = format!("contact {what}/{nodes} nodes, {}", sets[1].name());
            Row::new(name, 1e6 * seconds[1], "us")
                .against("scalar", seconds[0] / seconds[1])
                .error(error)
                .print();
        }
    }
}
