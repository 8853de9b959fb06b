//! The kernels against their scalar references and against what one would write or call instead, at the sizes of
//! K = 21,670. `cargo bench --bench kernels -- decoder` runs one group: decoder, encoder, table, leading, contact, pool.

mod decoder;
mod encoder;
mod leading;
#[path = "../measure/mod.rs"]
mod measure;
mod pool;
mod reduced;

const NODES: usize = 21_670;

fn main() -> upt::Result<()> {
    if measure::wanted("decoder") {
        decoder::against_references();
        measure::init_library();
        decoder::against_onnx_runtime()?;
    }
    if measure::wanted("encoder") {
        encoder::against_scalar();
    }
    if measure::wanted("table") {
        reduced::tables();
    }
    if measure::wanted("leading") {
        leading::against_whole()?;
    }
    if measure::wanted("contact") {
        reduced::contact();
    }
    if measure::wanted("pool") {
        pool::costs();
    }
    Ok(())
}
