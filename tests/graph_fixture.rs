//! Supernodes and radius graph against the fixture that Python wrote (`training/scripts/make_fixtures.py`).

use upt::bundle::{Graph, TensorFile};
use upt::graph::{SupernodeGraph, node_key};

#[test]
fn graphs_equal_pythons() {
    let path = fixture::path("graph.safetensors");
    let file = TensorFile::parse("graph.safetensors", std::fs::read(path).unwrap()).unwrap();
    let positions = file.f32("positions", &[None, Some(3)]).unwrap();
    let count = positions.len() / 3;
    let domain = file.ascending("domain_nodes", count).unwrap();
    let keys = file
        .raw("keys_seed7", safetensors::Dtype::I64, &[Some(count)])
        .unwrap();
    for (node, bytes) in keys.chunks_exact(8).enumerate() {
        assert_eq!(
            node_key(7, node as u64),
            u64::from_le_bytes(bytes.try_into().unwrap()),
            "key of node {node}"
        );
    }
    let cases: Vec<Graph> = serde_json::from_str(&file.text()["cases"]).unwrap();
    assert!(cases.len() >= 3);
    for (i, settings) in cases.iter().enumerate() {
        let graph = SupernodeGraph::new(&positions, &domain, settings).unwrap();
        let name = |part: &str| format!("case{i}.{part}");
        assert_eq!(
            graph.supernodes,
            file.ascending(&name("supernodes"), count).unwrap()
        );
        let offsets: Vec<u32> = file
            .offsets(&name("offsets"), 1 << 20)
            .unwrap()
            .into_iter()
            .map(|x| x as u32)
            .collect();
        assert_eq!(graph.offsets, offsets, "case {i}");
        assert_eq!(
            graph.neighbours,
            file.indices(&name("neighbours"), &[None], count).unwrap(),
            "case {i}"
        );
    }
}
