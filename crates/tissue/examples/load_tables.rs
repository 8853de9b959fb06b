//! Writes the tables of schemes and programmes where they are read outside of this crate:
//! `cargo run --release -p tissue --example load_tables`. `tests/loads.rs` fails when one is stale.

use std::error::Error;
use std::path::Path;

use tissue::loads::{json, programmes_table, replace, schemes_table};

fn main() -> Result<(), Box<dyn Error>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    std::fs::write(root.join("training/upt_training/loads.json"), json()?)?;
    let page = root.join("docs/guide/datasets.md");
    let mut text = std::fs::read_to_string(&page)?;
    for (marker, table) in [
        ("schemes", schemes_table()),
        ("programmes", programmes_table()),
    ] {
        text = replace(&text, marker, &table).ok_or(format!("no <!-- {marker} --> in the page"))?;
    }
    std::fs::write(&page, text)?;
    Ok(())
}
