//! Where compiled engines are kept. TensorRT names its files by the graph's name and the card alone, so the folder's name
//! holds everything else that an engine depends on: the graph's bytes, shapes, precision, provider and ONNX Runtime.

use sha2::{Digest, Sha256};

/// A hash of settings, of each with its length.
pub(super) fn engine_key(settings: &[&str]) -> Sha256 {
    let mut hash = Sha256::new();
    for part in settings {
        hash.update((part.len() as u64).to_le_bytes());
        hash.update(part);
    }
    hash
}

/// Folder for the engines of `graph`, the bytes of `file`: `latent-0123…`.
pub(super) fn engine_folder(file: &str, graph: &[u8], settings: Sha256) -> String {
    let digest = settings.chain_update(graph).finalize();
    let key = crate::bundle::hex(&digest[..16]);
    format!("{}-{key}", file.trim_end_matches(".onnx"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::onnx::Tensors;

    fn folder(version: &str, fp16: &str, graph: &[u8], rows: usize) -> String {
        let tensors = Tensors {
            inputs: &[("supernodes", &[rows, 8])],
            constants: &[("mask", &[1, 2], &[0.0, 1.0])],
            ..Tensors::default()
        };
        let key = engine_key(&["tensorrt", version, fp16, &tensors.shapes()]);
        engine_folder("latent.onnx", graph, key)
    }

    /// Two graphs of one name must not share an engine.
    #[test]
    fn engines_are_kept_apart_by_content() {
        let base = folder("1.31.1", "f32", b"graph", 64);
        assert_eq!(base, folder("1.31.1", "f32", b"graph", 64));
        assert!(base.starts_with("latent-"), "{base}");
        let mut all = vec![
            base,
            folder("1.31.1", "f32", b"other", 64),
            folder("1.31.1", "f32", b"graph", 65),
            folder("1.32.0", "f32", b"graph", 64),
            folder("1.31.1", "f16", b"graph", 64),
            // Parts do not run into one another.
            folder("1.31.1f", "32", b"graph", 64),
        ];
        let count = all.len();
        all.sort();
        all.dedup();
        assert_eq!(all.len(), count);
    }
}
