//! From a latent state to displacements: the decoder at nodes of the mesh, all or at anchors, and at any other points.
//!
//! The three records are read by the name of a state, so that a node of a published state can be
//! decoded when a host asks for it, and not only in the step that made it.

use super::decoders::{Decoders, decode_resident, decode_tiles, take_rows};
use std::sync::Arc;

use super::{NativeDecoder, Path, UptEngine, UptRecord};
use crate::error::Result;
use crate::kernels::Compute;
use crate::kernels::decoder::{DecoderRows, Decoding, decode};
use crate::scene::inputs::Which;

impl UptEngine {
    /// A record.
    pub fn record(&self, which: Which) -> &UptRecord {
        pick(which, [&self.next, &self.last, &self.before])
    }

    /// Decodes nodes of the scene's mesh into a field `[K,3]`, before the base is added; where the bundle has anchors, at
    /// those that the nodes need, and interpolates.
    pub fn decode_mesh(
        &mut self,
        compute: Compute<'_>,
        which: Which,
        nodes: &[u32],
        out: &mut [f32],
    ) -> Result<()> {
        let tables = Arc::clone(&self.tables);
        let Some(table) = &tables.anchors else {
            return self.decode_nodes(compute, which, nodes, out);
        };
        // Taken out while the engine is borrowed for decoding, and put back whether or not that
        // succeeded: its buffers have their room.
        let mut anchors = std::mem::take(&mut self.anchors);
        let (needed, field) = anchors.needed(table, nodes);
        let done = self.decode_nodes(compute, which, needed, field);
        let done = done.and_then(|()| anchors.interpolate(compute.pool, table, nodes, out));
        self.anchors = anchors;
        done
    }

    /// Decodes rows of the query table of the mesh into the same rows of `out [n,3]`: by the graph itself where it has made
    /// whole fields (`step.onnx`, for the state being made alone), by the decoder that holds the table on its device, or by
    /// rows.
    fn decode_nodes(
        &mut self,
        compute: Compute<'_>,
        which: Which,
        nodes: &[u32],
        out: &mut [f32],
    ) -> Result<()> {
        if let (Path::Whole(stage), Which::Next) = (&self.path, which) {
            take_rows(stage.output(0), nodes, out);
            return Ok(());
        }
        if let Decoders::Resident(stage) = &mut self.decoders {
            let record = pick(which, [&self.next, &self.last, &self.before]);
            return decode_resident(stage, record, nodes, out);
        }
        let tables = Arc::clone(&self.tables);
        self.decode_queries(compute, which, &tables.query_table, nodes, out)
    }

    /// Decodes rows `rows` of a query table into the same rows of `out`, before the base is added.
    pub fn decode_queries(
        &mut self,
        compute: Compute<'_>,
        which: Which,
        queries: &[f32],
        rows: &[u32],
        out: &mut [f32],
    ) -> Result<()> {
        let record = pick(which, [&self.next, &self.last, &self.before]);
        if let Decoders::Tiles(stages) = &self.decoders {
            let width = self.kind.entry.dims.query;
            return decode_tiles(stages, compute.pool, width, record, queries, rows, out);
        }
        let NativeDecoder {
            precision,
            tokens,
            scratch,
        } = &mut self.native;
        // Packed for the kernel in each call: the keys and values are another record's each time,
        // and few beside the nodes.
        tokens.set(*precision, &record.keys, &record.values);
        let what = Decoding {
            decoder: &self.kind.decoder,
            precision: *precision,
            tokens,
            queries,
            rows: DecoderRows::Scatter(rows),
        };
        Ok(decode(compute, what, scratch, out)?)
    }
}

/// Of the records `[next, last, before]`.
fn pick(which: Which, [next, last, before]: [&UptRecord; 3]) -> &UptRecord {
    match which {
        Which::Next => next,
        Which::Last => last,
        Which::Before => before,
    }
}
