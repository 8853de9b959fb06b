//! Kind `upt`: graphs, native weights, and the static tables of a mesh.
//!
//! A network of this kind reads features at the supernodes and their neighbours and gathers them
//! over the graph into one row a supernode; of these rows `latent.onnx` makes the keys and values
//! of latent tokens, and each node is decoded by a query against them. What depends on positions
//! alone is computed once for a mesh and kept as tables: rows of the first linear layer for sources
//! and targets of the graph, and the decoder's queries for all nodes. A step then embeds nothing.
//! The linear layers of the features, and mostly the decoder, run in this library's own kernels,
//! which is why their weights are read beside the graphs.

use std::sync::Arc;

use super::anchors::Anchors;
use crate::bundle::{BundleFiles, Mesh, TensorFile, UptEntry};
use crate::error::{Error, Result};
use crate::graph::SupernodeGraph;
use crate::kernels::decoder::{DecoderWeights, PackedDecoder};
use crate::kernels::encode::transpose_weight;
use crate::memory::{self, HeldBytes};
use crate::onnx::{ProviderChoice, ProviderPlan, Runtime, Stage, StageOptions};
use crate::options::Precision;

const TABLES: &str = "the tables of a mesh";

/// Nodes a run of `embed.onnx`.
/// The graph's batch is fixed to it, and the last tile is filled up with zeros whose rows are
/// dropped. It bounds what ONNX Runtime holds while a large mesh is embedded.
const EMBED_TILE: usize = 2048;

/// Everything that depends on the mesh alone.
#[derive(Debug, HeldBytes)]
pub struct UptTables {
    /// Supernodes and radius graph, in nodes of the mesh.
    pub graph: SupernodeGraph,
    /// Supernodes and their neighbours, ascending: the rows of the source table and of the features.
    pub encode_nodes: Vec<u32>,
    /// Row of each node in the source table `[K]`; `u32::MAX` where it has none.
    pub row_of_node: Vec<u32>,
    /// Supernodes as rows of the source table.
    pub supernode_rows: Vec<u32>,
    /// The graph's neighbours as rows of the source table.
    pub neighbour_rows: Vec<u32>,
    /// `[encode_nodes,d]`.
    pub source_table: Vec<f32>,
    /// `[n_S,d]`: only supernodes receive.
    pub target_table: Vec<f32>,
    /// `[K,2h]`.
    pub query_table: Vec<f32>,
    /// Where the bundle has them, and only for its own mesh.
    pub anchors: Option<Anchors>,
}

/// The part of a model that only kind `upt` has.
#[derive(HeldBytes)]
pub struct UptModel {
    /// The manifest's entry.
    #[held(skip)]
    pub entry: UptEntry,
    /// `[f,d]`, transposed for the kernels.
    pub source_weight: Vec<f32>,
    /// `[f,d]`, transposed for the kernels.
    pub target_weight: Vec<f32>,
    /// Decoder, packed for the native kernel.
    pub decoder: PackedDecoder,
    /// Tables of the bundle's mesh.
    #[held(skip)]
    pub tables: Arc<UptTables>,
    /// Precision of the graphs `latent` and `decoder`: float32, float16 or int8.
    #[held(skip)]
    pub precision: Precision,
    /// Bytes of `embed.onnx`, run for a mesh or points of a scene's own.
    embed: Vec<u8>,
    /// The graphs that each scene makes its stages from.
    pub(super) latent: GraphFile,
    pub(super) decoder_graph: GraphFile,
    /// That of the whole step, where the bundle has it in this precision.
    pub(super) step: Option<GraphFile>,
}

/// A graph as the bundle has it.
#[derive(HeldBytes)]
pub(super) struct GraphFile {
    pub name: String,
    pub bytes: Vec<u8>,
}

impl GraphFile {
    fn read(files: &BundleFiles, name: String) -> Result<GraphFile> {
        Ok(GraphFile {
            bytes: files.read(&name)?,
            name,
        })
    }
}

impl UptModel {
    /// Reads graphs and weights, makes a session of each graph once, computes the tables of the bundle's mesh.
    pub fn open(
        files: &BundleFiles,
        mesh: &Mesh,
        runtime: &'static Runtime,
        plan: &ProviderPlan,
        threads: usize,
        precision: Precision,
    ) -> Result<(UptModel, ProviderChoice)> {
        let latent_file = files.graph_file("latent", precision)?;
        let decoder_file = files.graph_file("decoder", precision)?;
        let step = match files.graph_file("step", precision) {
            Ok(file) if files.has(&file) => Some(GraphFile::read(files, file)?),
            _ => None,
        };
        let entry = files
            .manifest
            .upt
            .clone()
            .ok_or_else(|| Error::bundle("bundle.json", "field `upt` is missing"))?;
        let weights = files.tensors(&entry.weights)?;
        let (d, f) = (entry.dims.encoder, entry.feature_width());
        let matrix = |name: &str| weights.f32(name, &[Some(d), Some(f)]);
        let embed = files.read("embed.onnx")?;
        let source_weight = transpose_weight(&matrix("encoder.source")?, d, f)?;
        let target_weight = transpose_weight(&matrix("encoder.target")?, d, f)?;
        let mut tables = make_tables(&entry, &embed, mesh, runtime, threads)?;
        if let Some(file) = &entry.anchors {
            tables.anchors = Some(Anchors::parse(&files.tensors(file)?, mesh.node_count())?);
        }
        let tables = Arc::new(tables);
        let model = UptModel {
            source_weight,
            target_weight,
            decoder: pack_decoder(&weights, &entry)?,
            tables,
            embed,
            precision,
            latent: GraphFile::read(files, latent_file)?,
            decoder_graph: GraphFile::read(files, decoder_file)?,
            step,
            entry,
        };
        let choice = model
            .latent_stage(runtime, plan, threads, model.tables.graph.supernodes.len())?
            .choice()
            .clone();
        Ok((model, choice))
    }

    /// Tables of another mesh.
    pub fn tables_of(
        &self,
        mesh: &Mesh,
        runtime: &'static Runtime,
        threads: usize,
    ) -> Result<UptTables> {
        make_tables(&self.entry, &self.embed, mesh, runtime, threads)
    }

    /// Query rows `[n,2h]` of any points `[n,3]`, mm.
    pub fn queries(
        &self,
        points: &[f32],
        runtime: &'static Runtime,
        threads: usize,
    ) -> Result<Vec<f32>> {
        let count = points.len() / 3;
        let mut queries = memory::room(count * self.entry.dims.query, "the queries of points")?;
        embed_points(
            &self.entry,
            &self.embed,
            points,
            runtime,
            threads,
            |_, _, tile| {
                queries.extend_from_slice(tile.query);
            },
        )?;
        Ok(queries)
    }
}

/// Weights and biases of the decoder by their names in the file, checked against the manifest's
/// widths and laid out anew for the native kernel: `h` hidden, `m` inside of the MLP.
fn pack_decoder(file: &TensorFile, entry: &UptEntry) -> Result<PackedDecoder> {
    let (h, m) = (entry.dims.decoder, entry.dims.decoder_mlp);
    let tensors = |name: &str, shape: &[Option<usize>]| {
        Ok::<_, Error>((
            file.f32(&format!("decoder.{name}.weight"), shape)?,
            file.f32(&format!("decoder.{name}.bias"), &shape[..1])?,
        ))
    };
    let attention_out = tensors("attention_out", &[Some(h), Some(h)])?;
    let norm2 = tensors("norm2", &[Some(h)])?;
    let mlp1 = tensors("mlp1", &[Some(m), Some(h)])?;
    let mlp2 = tensors("mlp2", &[Some(h), Some(m)])?;
    let norm3 = tensors("norm3", &[Some(h)])?;
    let head = tensors("head", &[Some(3), Some(h)])?;
    let weights = DecoderWeights {
        hidden: h,
        heads: entry.dims.decoder_heads,
        mlp: m,
        attention_out: (&attention_out.0, &attention_out.1),
        norm2: (&norm2.0, &norm2.1),
        mlp1: (&mlp1.0, &mlp1.1),
        mlp2: (&mlp2.0, &mlp2.1),
        norm3: (&norm3.0, &norm3.1),
        head: (&head.0, &head.1),
    };
    PackedDecoder::new(file.name(), &weights)
}

/// The graph of a mesh and its tables, made when a model is opened, or a scene with a mesh of its
/// own.
///
/// Of `embed.onnx`'s three outputs the query rows are kept for every node, the others only where
/// the graph asks for them: sources at supernodes and neighbours, targets at supernodes. So a tile
/// is embedded whole, and most of it is dropped. Node lists are ascending, which is why rows can
/// simply be appended tile by tile.
fn make_tables(
    entry: &UptEntry,
    embed: &[u8],
    mesh: &Mesh,
    runtime: &'static Runtime,
    threads: usize,
) -> Result<UptTables> {
    let _span = tracing::debug_span!("tables", nodes = mesh.node_count()).entered();
    let graph = SupernodeGraph::of_mesh(mesh, &entry.graph)?;
    let encode_nodes = graph.needed_nodes()?;
    // From nodes of the mesh to rows of the table.
    let mut row = memory::filled(mesh.node_count(), u32::MAX, TABLES)?;
    for (at, &node) in encode_nodes.iter().enumerate() {
        row[node as usize] = at as u32;
    }
    let rows = |nodes: &[u32]| {
        let rows = nodes.iter().map(|&node| row[node as usize]);
        memory::collected(nodes.len(), rows, TABLES)
    };
    let d = entry.dims.encoder;
    let mut source_table = memory::room(encode_nodes.len() * d, TABLES)?;
    let mut target_table = memory::room(graph.supernodes.len() * d, TABLES)?;
    let mut query_table = memory::room(mesh.node_count() * entry.dims.query, TABLES)?;
    embed_points(
        entry,
        embed,
        &mesh.positions,
        runtime,
        threads,
        |first, end, tile| {
            for (nodes, from, to) in [
                (&encode_nodes, tile.source, &mut source_table),
                (&graph.supernodes, tile.target, &mut target_table),
            ] {
                for &node in within(nodes, first, end) {
                    to.extend_from_slice(&from[(node as usize - first) * d..][..d]);
                }
            }
            query_table.extend_from_slice(tile.query);
        },
    )?;
    Ok(UptTables {
        supernode_rows: rows(&graph.supernodes)?,
        neighbour_rows: rows(&graph.neighbours)?,
        source_table,
        target_table,
        query_table,
        row_of_node: row,
        encode_nodes,
        graph,
        anchors: None,
    })
}

/// The ascending `nodes` in `first..end`.
fn within(nodes: &[u32], first: usize, end: usize) -> &[u32] {
    let at = |limit: usize| nodes.partition_point(|&node| (node as usize) < limit);
    &nodes[at(first)..at(end)]
}

/// What `embed.onnx` gives for some points.
struct Embedded<'a> {
    /// `[n,d]`.
    source: &'a [f32],
    /// `[n,d]`.
    target: &'a [f32],
    /// `[n,2h]`.
    query: &'a [f32],
}

/// `embed.onnx` over points `[n,3]`, a tile after another: `take(first, end, rows)` gets the rows of points
/// `first..end`, so that tables of all points need not be held at once.
fn embed_points(
    entry: &UptEntry,
    embed: &[u8],
    points: &[f32],
    runtime: &'static Runtime,
    threads: usize,
    mut take: impl FnMut(usize, usize, Embedded<'_>),
) -> Result<()> {
    let (d, q) = (entry.dims.encoder, entry.dims.query);
    let mut stage = Stage::new(
        runtime,
        "embed.onnx",
        embed,
        &[("positions", &[EMBED_TILE, 3])],
        &[
            ("source_table", &[EMBED_TILE, d]),
            ("target_table", &[EMBED_TILE, d]),
            ("query_table", &[EMBED_TILE, q]),
        ],
        &StageOptions {
            threads,
            plan: ProviderPlan::cpu(),
        },
    )?;
    for (at, tile) in points.chunks(3 * EMBED_TILE).enumerate() {
        let (first, count) = (at * EMBED_TILE, tile.len() / 3);
        let input = stage.input(0);
        input.fill(0.0);
        input[..tile.len()].copy_from_slice(tile);
        stage.run()?;
        let outputs = [("source_table", d), ("target_table", d), ("query_table", q)];
        for (index, (name, width)) in outputs.into_iter().enumerate() {
            let values = &stage.output(index)[..count * width];
            // Of steps made with such a row the guard could only say that they are not finite; here
            // the file that is at fault is known.
            if values.iter().any(|x| !x.is_finite()) {
                return Err(Error::bundle(
                    "embed.onnx",
                    format!("output `{name}` holds values that are not finite"),
                ));
            }
        }
        let rows = Embedded {
            source: &stage.output(0)[..count * d],
            target: &stage.output(1)[..count * d],
            query: &stage.output(2)[..count * q],
        };
        take(first, first + count, rows);
    }
    Ok(())
}
