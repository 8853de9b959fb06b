//! Packs three.js, most of what the pages of `upt` are made of: the command holds a quarter of its bytes.

use std::fs::File;
use std::io::Write;
use std::path::PathBuf;

use flate2::Compression;
use flate2::write::ZlibEncoder;

const SOURCE: &str = "src/three.js";

fn main() -> std::io::Result<()> {
    println!("cargo:rerun-if-changed={SOURCE}");
    let folder = PathBuf::from(std::env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    let file = File::create(folder.join("three.js.z"))?;
    let mut packed = ZlibEncoder::new(file, Compression::best());
    packed.write_all(&std::fs::read(SOURCE)?)?;
    packed.finish()?;
    Ok(())
}
