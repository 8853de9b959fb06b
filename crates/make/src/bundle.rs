//! The bundle's folder: its manifest, put together in the work folder, and published whole.

use std::path::Path;

use anyhow::{Context, Result, bail};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use tissue::mesh::Mesh;

use super::fixed;
use super::options::Options;
use super::sizes::Sizes;
use super::unload;

/// What a bundle of this command says of its origin.
const COMMAND: &str = "upt make";
const DIGEST: &str = "manifest_sha256";

/// Whether the folder to write is free, or a bundle that this command made.
pub fn check_target(out: &Path) -> Result<()> {
    let mut entries = match std::fs::read_dir(out) {
        Ok(entries) => entries,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(()),
        Err(error) => {
            return Err(error).with_context(|| format!("{}: cannot be read", out.display()));
        }
    };
    let ours = || -> Option<bool> {
        let text = std::fs::read(out.join("bundle.json")).ok()?;
        let manifest: Value = serde_json::from_slice(&text).ok()?;
        Some(manifest["provenance"]["command"] == COMMAND)
    };
    if entries.next().is_some() && ours() != Some(true) {
        bail!(
            "{}: exists, but `upt make` did not make it; choose another --out, or remove it",
            out.display()
        );
    }
    Ok(())
}

fn hex(bytes: &[u8]) -> String {
    Sha256::digest(bytes)
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect()
}

/// Puts the files of the linear response and its free vibration together as a bundle in `folder`.
pub fn assemble(
    options: &Options,
    mesh: &Mesh,
    sizes: &Sizes,
    work: &Path,
    folder: &Path,
) -> Result<()> {
    if folder.exists() {
        std::fs::remove_dir_all(folder)
            .with_context(|| format!("{}: cannot be removed", folder.display()))?;
    }
    std::fs::create_dir_all(folder)
        .with_context(|| format!("{}: cannot be made", folder.display()))?;
    let mut files = serde_json::Map::new();
    for name in [
        "mesh.safetensors",
        "prior.safetensors",
        "vibration.safetensors",
    ] {
        let to = folder.join(name);
        std::fs::copy(work.join(name), &to)
            .with_context(|| format!("{}: cannot be written", to.display()))?;
        let bytes = std::fs::read(&to)?;
        files.insert(
            name.into(),
            json!({"bytes": bytes.len(), "sha256": hex(&bytes)}),
        );
    }
    let material = options.material()?;
    let mut requires = vec!["unlearned", "vibration"];
    if !material.law.is_default() {
        requires.insert(0, "law");
    }
    let relaxes =
        (mesh.regions.iter()).any(|own| own.relaxation.is_some_and(|own| !own.is_empty()));
    if !material.relaxation.is_empty() || relaxes {
        requires.insert(0, "relaxation");
    }
    if !mesh.regions.is_empty() {
        requires.insert(0, "laws");
    }
    let gravity = unload::at_rest(options);
    if gravity.is_some() {
        requires.insert(0, "gravity_at_rest");
    }
    let rounded = |x: f64| (x * 1000.0).round() / 1000.0;
    let blank = "0".repeat(64);
    let entries = [
        ("format", json!("upt-bundle")),
        ("version", json!(1)),
        ("requires", json!(requires)),
        ("kind", json!("reduced")),
        ("name", json!(mesh.name)),
        (
            "description",
            json!("Linear-elastic response, its free vibration and corrections by the elements"),
        ),
        ("license", json!(mesh.license)),
        ("dt_s", json!(tissue::schemes::FRAME_S)),
        ("length_unit", json!("mm")),
        ("force_unit", json!("mN")),
        ("boundary", json!(options.boundary.as_str())),
        ("material", serde_json::to_value(material)?),
        (
            "mesh",
            json!({"file": "mesh.safetensors", "nodes": mesh.node_count(), "mesh_sha256": mesh.hash()}),
        ),
        (
            "envelope",
            json!({
                "max_push_mm": rounded(sizes.push_mm),
                // Nothing was trained: these limit what the check tries.
                "max_push_rate_mm": rounded(0.5 * sizes.push_mm),
                "contact_area_mm2": [rounded(0.5 * sizes.area_mm2[0]), rounded(1.5 * sizes.area_mm2[1])],
                "max_sites": 2,
                "displacement_bound_mm": rounded((3.0 * sizes.push_mm).max(2.0 * sizes.push_mm + 1.0)),
            }),
        ),
        ("precisions", json!(["f32"])),
        (
            "prior",
            json!({"file": "prior.safetensors", "vibration": "vibration.safetensors"}),
        ),
        ("supports", json!(fixed::read(work, fixed::SUPPORTS)?)),
        ("regions", json!(fixed::read(work, fixed::REGIONS)?)),
        ("laws", json!(mesh.regions)),
        ("gravity_at_rest_m_s2", json!(gravity.unwrap_or_default())),
        (
            "provenance",
            json!({"command": COMMAND, "version": env!("CARGO_PKG_VERSION"), "options": options.words(), "seed": options.seed}),
        ),
        ("errors", json!({})),
        ("files", Value::Object(files)),
        (DIGEST, json!(blank)),
    ];
    // A bundle without these is one that libraries before them read.
    let is_told = |(name, value): &&(&str, Value)| match *name {
        "supports" | "regions" | "laws" => *value != json!([]),
        "gravity_at_rest_m_s2" => gravity.is_some(),
        _ => true,
    };
    let lines: Vec<String> = entries
        .iter()
        .filter(is_told)
        .map(|(name, value)| {
            let text = serde_json::to_string_pretty(value)?.replace('\n', "\n  ");
            Ok(format!("  \"{name}\": {text}"))
        })
        .collect::<Result<_>>()?;
    let text = format!("{{\n{}\n}}\n", lines.join(",\n"));
    let text = text.replace(&blank, &hex(text.as_bytes()));
    let path = folder.join("bundle.json");
    std::fs::write(&path, text).with_context(|| format!("{}: cannot be written", path.display()))
}

fn remove(folder: &Path) -> Result<()> {
    match std::fs::remove_dir_all(folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(error).with_context(|| format!("{}: cannot be removed", folder.display()))
        }
        _ => Ok(()),
    }
}

/// Copies the files of a folder to a new one.
pub fn copy(from: &Path, to: &Path) -> Result<()> {
    remove(to)?;
    let copied = || -> std::io::Result<()> {
        std::fs::create_dir_all(to)?;
        for entry in std::fs::read_dir(from)? {
            let entry = entry?;
            std::fs::copy(entry.path(), to.join(entry.file_name()))?;
        }
        Ok(())
    };
    copied().or_else(|error| {
        // Half a bundle is of no use to anyone.
        remove(to)?;
        Err(error).with_context(|| format!("{}: cannot be written", to.display()))
    })
}

/// Copies the folder next to `out` and lets it take that place.
pub fn publish(draft: &Path, out: &Path) -> Result<()> {
    let beside = |end: &str| {
        let mut name = out.file_name().unwrap_or_default().to_os_string();
        name.push(end);
        out.with_file_name(name)
    };
    let (fresh, old) = (beside(".new"), beside(".old"));
    remove(&old)?;
    copy(draft, &fresh)?;
    let moved = || -> std::io::Result<()> {
        if out.exists() {
            std::fs::rename(out, &old)?;
        }
        std::fs::rename(&fresh, out)
    };
    moved().with_context(|| format!("{}: cannot take its place", fresh.display()))?;
    if old.exists() {
        std::fs::remove_dir_all(&old)
            .with_context(|| format!("{}: cannot be removed", old.display()))?;
    }
    Ok(())
}
