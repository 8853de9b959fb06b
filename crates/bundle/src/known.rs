//! What this library knows of a manifest. A bundle that asks for more is refused, instead of running other dynamics than
//! it was made with (`docs/reference/formats.md`, "Versions").
//!
//! REQ-004: A bundle that needs a newer library is refused and says so.

use serde_json::Value;

use super::faults::{FILE, bad};
use field::error::{Error, Result};

/// What `requires` may name: each changes what a step gives, and a library without it must refuse the bundle. A new one is
/// one line here, next to its keys in [`KEYS`].
const REQUIREMENTS: &[&str] = &[
    "anchors",
    "corrections",
    "gravity_at_rest",
    "law",
    "laws",
    "relaxation",
    "release",
    "unlearned",
    "vibration",
];

/// The keys of each object of `bundle.json`. What lies below `provenance` and `errors` is for people, `files` is a list.
const KEYS: &[(&str, &[&str])] = &[
    (
        "",
        &[
            "format",
            "version",
            "requires",
            "kind",
            "name",
            "description",
            "license",
            "dt_s",
            "length_unit",
            "force_unit",
            "boundary",
            "body",
            "material",
            "mesh",
            "envelope",
            "precisions",
            "prior",
            "supports",
            "regions",
            "laws",
            "gravity_at_rest_m_s2",
            "corrections",
            "upt",
            "reduced",
            "rest_displacement_mm",
            "provenance",
            "errors",
            "files",
            "manifest_sha256",
        ],
    ),
    (
        "material",
        &[
            "young_pa",
            "poisson",
            "density_kg_m3",
            "damping_per_s",
            "law",
            "relaxation",
        ],
    ),
    (
        "material.law",
        &[
            "name",
            "c01_share",
            "terms",
            "c2_over_c1",
            "c3_over_c1",
            "beta",
            "k1_over_mu",
            "k2",
            "matrix",
        ],
    ),
    (
        "material.law.matrix",
        &[
            "name",
            "c01_share",
            "terms",
            "c2_over_c1",
            "c3_over_c1",
            "beta",
        ],
    ),
    ("mesh", &["file", "nodes", "mesh_sha256"]),
    (
        "envelope",
        &[
            "max_push_mm",
            "max_push_rate_mm",
            "contact_area_mm2",
            "max_sites",
            "displacement_bound_mm",
            "tools",
        ],
    ),
    (
        "envelope.tools",
        &[
            "corrections",
            "size_mm",
            "depth_mm",
            "speed_mm_s",
            "max_tools",
        ],
    ),
    ("prior", &["file", "release", "residual", "vibration"]),
    (
        "corrections",
        &[
            "file",
            "recommended",
            "target_mm",
            "substeps",
            "calibration",
            "frame_step_s",
            "whole",
        ],
    ),
    (
        "upt",
        &[
            "features",
            "base",
            "normalisation",
            "coordinates",
            "graph",
            "dims",
            "weights",
            "anchors",
        ],
    ),
    ("upt.normalisation", &["mean", "std"]),
    ("upt.coordinates", &["offset", "scale"]),
    (
        "upt.graph",
        &[
            "radius_mm",
            "max_degree",
            "supernodes",
            "seed",
            "domain_fraction",
        ],
    ),
    (
        "upt.dims",
        &[
            "encoder",
            "query",
            "latent_tokens",
            "decoder",
            "decoder_heads",
            "decoder_mlp",
        ],
    ),
    (
        "reduced",
        &["modes", "response_modes", "inputs", "bound", "fade"],
    ),
    ("reduced.bound", &["relative", "decay"]),
    ("reduced.fade", &["start_push_mm", "end_push_mm"]),
];

/// Keys of an entry of `files`.
const FILE_KEYS: &[&str] = &["bytes", "sha256"];

/// What a bundle of a later library, or a misspelt key, is answered with.
fn newer(field: &str) -> Error {
    Error::Version(format!(
        "{FILE}: `{field}` is unknown here: the bundle needs a newer libupt, or the name is misspelt"
    ))
}

/// Refuses an object with other keys than these.
fn only(object: &Value, path: &str, keys: &[&str]) -> Result<()> {
    let Some(object) = object.as_object() else {
        return Ok(()); // Another type is told of by its reader.
    };
    match object.keys().find(|key| !keys.contains(&key.as_str())) {
        None => Ok(()),
        Some(key) if path.is_empty() => Err(newer(key)),
        Some(key) => Err(newer(&format!("{path}.{key}"))),
    }
}

/// Refuses keys and requirements that this library does not know.
pub(super) fn check(manifest: &Value) -> Result<()> {
    for (path, keys) in KEYS {
        let pointer = match path.is_empty() {
            true => String::new(),
            false => format!("/{}", path.replace('.', "/")),
        };
        if let Some(object) = manifest.pointer(&pointer) {
            only(object, path, keys)?;
        }
    }
    for (name, entry) in manifest["files"].as_object().into_iter().flatten() {
        only(entry, &format!("files.{name}"), FILE_KEYS)?;
    }
    let requires = match &manifest["requires"] {
        Value::Null => return Ok(()),
        Value::Array(list) => list,
        _ => return Err(bad("requires", "must be a list of names")),
    };
    for (at, name) in requires.iter().enumerate() {
        match name.as_str() {
            Some(name) if REQUIREMENTS.contains(&name) => {}
            Some(name) => return Err(newer(&format!("requires: {name}"))),
            None => return Err(bad(&format!("requires[{at}]"), "must be a name")),
        }
    }
    Ok(())
}
