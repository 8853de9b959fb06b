//! Sessions of a `upt` bundle's graphs, with the shapes of a scene's mesh.
//!
//! Shapes are fixed when a session is made, since ONNX Runtime can then plan its memory once, and a
//! captured CUDA graph allows no others. `L` latent tokens of width `h`, `d` the encoder's width,
//! `K` nodes, `n_S` supernodes, `e` encoded nodes with `f` features each.

use super::upt::{GraphFile, UptModel, UptTables};
use crate::error::{Error, Result};
use crate::memory;
use crate::onnx::{ProviderPlan, Runtime, Stage, StageOptions, Tensors};

/// Nodes a run of `decoder.onnx`: activations stay in cache.
pub const DECODER_TILE: usize = 1024;

/// Products and sums of a latent graph that are worth one more thread. Below it ONNX Runtime's threads save nothing, and
/// the slowest steps wait for one that was woken late: for `brain-fast` (47 MFLOP by [`latent_threads`]) the median is the same on one and
/// on two, and the slowest hundredth lost twice as much on two.
const FLOPS_A_THREAD: usize = 100_000_000;

/// Threads for a latent graph of `bytes` that sees `tokens` at most, if `threads` are available: each weight (f32) met by each
/// token is an upper bound of its products and sums.
fn latent_threads(bytes: usize, tokens: usize, threads: usize) -> usize {
    let flops = 2 * (bytes / 4) * tokens;
    threads.min(1 + flops / FLOPS_A_THREAD)
}

impl UptModel {
    /// A session of the latent graph: `supernodes [n_S,d]` -> `keys [L,h]`, `values [L,h]`.
    pub fn latent_stage(
        &self,
        runtime: &'static Runtime,
        plan: &ProviderPlan,
        threads: usize,
        supernodes: usize,
    ) -> Result<Stage> {
        let dims = &self.entry.dims;
        let kv: &[usize] = &[dims.latent_tokens, dims.decoder];
        Stage::new(
            runtime,
            &self.latent.name,
            &self.latent.bytes,
            &[("supernodes", &[supernodes, dims.encoder])],
            &[("keys", kv), ("values", kv)],
            &StageOptions {
                threads: latent_threads(
                    self.latent.bytes.len(),
                    supernodes.max(dims.latent_tokens),
                    threads,
                ),
                plan: plan.clone(),
            },
        )
    }

    /// A session of the decoder graph for tiles of [`DECODER_TILE`] nodes:
    /// `queries [n,2h]`, `keys`, `values` -> `displacement [n,3]`.
    ///
    /// One thread: the scene's own pool runs the tiles side by side, each with a stage of this
    /// kind.
    pub fn decoder_stage(&self, runtime: &'static Runtime, plan: &ProviderPlan) -> Result<Stage> {
        let dims = &self.entry.dims;
        let kv: &[usize] = &[dims.latent_tokens, dims.decoder];
        Stage::new(
            runtime,
            &self.decoder_graph.name,
            &self.decoder_graph.bytes,
            &[
                ("queries", &[DECODER_TILE, dims.query]),
                ("keys", kv),
                ("values", kv),
            ],
            &[("displacement", &[DECODER_TILE, 3])],
            &StageOptions {
                threads: 1,
                plan: plan.clone(),
            },
        )
    }

    /// A session of the decoder graph for all nodes, their queries `[K,2h]` bound once: `keys`, `values` -> `displacement [K,3]`.
    ///
    /// Meant for a device: all nodes in one run, while the queries, by far the largest input, stay
    /// where they are.
    pub fn resident_decoder(
        &self,
        runtime: &'static Runtime,
        plan: &ProviderPlan,
        threads: usize,
        queries: &[f32],
    ) -> Result<Stage> {
        let dims = &self.entry.dims;
        let count = queries.len() / dims.query;
        let kv: &[usize] = &[dims.latent_tokens, dims.decoder];
        Stage::with_constants(
            runtime,
            &self.decoder_graph.name,
            &self.decoder_graph.bytes,
            &Tensors {
                inputs: &[("keys", kv), ("values", kv)],
                constants: &[("queries", &[count, dims.query], queries)],
                outputs: &[("displacement", &[count, 3])],
                ..Tensors::default()
            },
            &StageOptions {
                threads,
                plan: plan.clone(),
            },
        )
    }

    /// Whether the bundle carries `step.onnx` in the precision that runs.
    pub fn has_step(&self) -> bool {
        self.step.is_some()
    }

    /// A session of the whole step, tables and graph bound once: `features [e,f]` -> `displacement [K,3]`, `keys`, `values`.
    ///
    /// # Errors
    /// [`Error::Unsupported`] when the bundle has no such graph.
    pub fn step_stage(
        &self,
        runtime: &'static Runtime,
        plan: &ProviderPlan,
        threads: usize,
        tables: &UptTables,
    ) -> Result<Stage> {
        let Some(GraphFile { name, bytes }) = &self.step else {
            return Err(Error::Unsupported(format!(
                "step_path: the bundle has no step graph in precision {:?}; export it with `python -m upt_training export --step`",
                self.precision
            )));
        };
        const STEP: &str = "the inputs of step.onnx";
        let (dims, graph) = (&self.entry.dims, &tables.graph);
        let (d, q, rows) = (dims.encoder, dims.query, tables.encode_nodes.len());
        let (supernodes, degree) = (graph.supernodes.len(), self.entry.graph.max_degree);
        // The graph has a rectangle of neighbours where the tables have lists of different lengths.
        // A place that is not used names row 0 and has the mask 0, so that it adds nothing to the
        // mean.
        let mut neighbours = memory::filled(supernodes * degree, 0i64, STEP)?;
        let mut mask = memory::zeros(supernodes * degree, STEP)?;
        for row in 0..supernodes {
            let edges = graph.offsets[row] as usize..graph.offsets[row + 1] as usize;
            let at = row * degree;
            for (i, &node) in tables.neighbour_rows[edges].iter().enumerate() {
                neighbours[at + i] = i64::from(node);
                mask[at + i] = 1.0;
            }
        }
        let receivers = tables.supernode_rows.iter().map(|&row| i64::from(row));
        let receivers = memory::collected(supernodes, receivers, STEP)?;
        // The graph takes a target row for each row of the features, and reads the receivers'.
        let mut targets = memory::zeros(rows * d, STEP)?;
        for (row, target) in tables
            .supernode_rows
            .iter()
            .zip(tables.target_table.chunks_exact(d))
        {
            targets[*row as usize * d..][..d].copy_from_slice(target);
        }
        let count = tables.query_table.len() / q;
        let kv: &[usize] = &[dims.latent_tokens, dims.decoder];
        let padded: &[usize] = &[supernodes, degree];
        Stage::with_constants(
            runtime,
            name,
            bytes,
            &Tensors {
                inputs: &[("features", &[rows, self.entry.feature_width()])],
                constants: &[
                    ("source_table", &[rows, d], &tables.source_table),
                    ("target_table", &[rows, d], &targets),
                    ("query_table", &[count, q], &tables.query_table),
                    ("mask", padded, &mask),
                ],
                indices: &[
                    ("neighbours", padded, &neighbours),
                    ("supernodes", &[supernodes], &receivers),
                ],
                outputs: &[("displacement", &[count, 3]), ("keys", kv), ("values", kv)],
            },
            &StageOptions {
                threads,
                plan: plan.clone(),
            },
        )
    }
}

#[cfg(test)]
mod tests {
    use super::latent_threads;

    #[test]
    fn a_small_latent_graph_keeps_to_one_thread_and_a_large_one_takes_all() {
        assert_eq!(latent_threads(730_703, 128, 2), 1);
        assert_eq!(latent_threads(13_013_632, 2048, 8), 8);
        assert_eq!(latent_threads(13_013_632, 2048, 1), 1);
    }
}
