//! `--tissue measured`: a brain of measured tissue in place of a bundle's textbook one, made once and kept where fetched bundles lie.
//!
//! The laws are rows of `tissues.csv`: cortex by depth, ganglia beneath, a ball of callosum, corona radiata elsewhere (decision 044). Such a bundle has some 5 MB,
//! which a clone need not hold, and is made within minutes.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Parser;
use foreign::python;
use sha2::{Digest, Sha256};
use yardstick::bundle_folder::BundleFolder;

use crate::{make, materials};

/// Regions and their tissues, as `upt make` takes them; the tissue of what is left comes first.
const REST: &str = "corona-radiata";
const REGIONS: [[&str; 2]; 3] = [
    ["cortex", "shell:6"],
    ["basal-ganglia", "not:shell:18"],
    ["corpus-callosum", "ball:0,0,20,12"],
];
/// Minutes of `upt make` at least, and nodes that it has one minute for.
const MINUTES: f64 = 3.0;
const NODES_A_MINUTE: f64 = 3000.0;

#[derive(Parser)]
struct Line {
    #[command(flatten)]
    make: make::Options,
}

/// What `upt make` is asked for.
fn order(mesh: &Path, out: &Path, nodes: usize) -> Result<make::Options> {
    let minutes = (nodes as f64 / NODES_A_MINUTE).max(MINUTES);
    let mut words = vec![
        "make".to_owned(),
        mesh.display().to_string(),
        format!("--out={}", out.display()),
        format!("--law={REST}"),
        format!("--minutes={minutes}"),
        "--cases=1".to_owned(),
        "--name=brain-measured".to_owned(),
    ];
    for [name, region] in REGIONS {
        words.push(format!("--region={name}={region}"));
        words.push(format!("--material={name}={name}"));
    }
    Ok(Line::try_parse_from(words)?.make)
}

/// Its folder's name, which is another one where mesh, tissues, regions or version are: an older bundle is never taken for what is asked for.
fn kept_as(mesh_sha256: &str) -> Result<String> {
    let mut hash = Sha256::new();
    hash.update(mesh_sha256);
    hash.update(env!("CARGO_PKG_VERSION"));
    for name in REGIONS.iter().map(|[name, _]| *name).chain([REST]) {
        let law = materials::law(name).map_err(anyhow::Error::msg)?;
        hash.update(format!("{name} {law}"));
    }
    hash.update(format!("{REGIONS:?} {MINUTES} {NODES_A_MINUTE}"));
    let digest = hash.finalize();
    let short: String = digest[..4].iter().map(|b| format!("{b:02x}")).collect();
    Ok(format!("brain-measured-{short}"))
}

/// The folder of a brain's bundle of measured tissue; made where there is none yet.
pub fn folder(bundle: &Path) -> Result<PathBuf> {
    let own = BundleFolder::read(bundle)?;
    if !own.name.starts_with("brain") {
        bail!(
            "--tissue measured: {} is `{}`, and `upt view` knows measured laws of brains alone; make another organ's bundle with upt make --law and --material (upt materials lists tissues)",
            bundle.display(),
            own.name
        );
    }
    let out = (python::cache()?.join("bundles")).join(kept_as(&own.mesh_sha256)?);
    if out.join("bundle.json").is_file() {
        return Ok(out);
    }
    let nodes = tissue::mesh::Mesh::read(&own.mesh_file)
        .with_context(|| format!("{}: cannot be read", own.mesh_file.display()))?
        .node_count();
    if let Some(parent) = out.parent() {
        std::fs::create_dir_all(parent)
            .with_context(|| format!("{}: cannot be made", parent.display()))?;
    }
    println!(
        "a brain of measured tissue is made once, into {}",
        out.display()
    );
    let order = order(&own.mesh_file, &out, nodes)?;
    make::run(&order)?;
    if !out.join("bundle.json").is_file() {
        bail!("{}: upt make has left no bundle there", out.display());
    }
    // What only a second run would need is as large as seven bundles; where it cannot go, nothing is wrong.
    let _ = std::fs::remove_dir_all(out.with_extension("work"));
    let _ = std::fs::remove_file(out.with_extension("preview.html"));
    Ok(out)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{REGIONS, folder, kept_as, materials, order};

    #[test]
    fn every_region_is_a_tissue_that_was_measured() {
        let order = order(Path::new("brain.safetensors"), Path::new("out"), 3000).unwrap();
        let told = format!("{order:?}");
        for [name, _] in REGIONS {
            assert!(told.contains(name), "{told}");
            assert!(!materials::source_of(&materials::law(name).unwrap()).is_empty());
        }
        assert!(!materials::source_of(&materials::law(super::REST).unwrap()).is_empty());
    }

    #[test]
    fn another_mesh_is_another_bundle() {
        assert_eq!(kept_as("a").unwrap(), kept_as("a").unwrap());
        assert_ne!(kept_as("a").unwrap(), kept_as("b").unwrap());
    }

    #[test]
    fn another_organ_is_refused() {
        let liver = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../onnx/liver-coarse");
        let error = folder(&liver).unwrap_err().to_string();
        assert!(error.contains("of brains alone"), "{error}");
    }
}
