//! The files of a bundle: read once, size and SHA-256 checked against the manifest.
//!
//! Opening reads the manifest alone and asks for the size of each file it lists, which finds a copy
//! that was cut short without reading it. The hash is checked where a file is read, so that no
//! bytes reach a parser that are not those of the manifest. The manifest's own hash stands for the
//! whole bundle: it holds all others.

use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use super::maker;
use super::manifest::Manifest;
use super::place::Place;
use super::tensors::TensorFile;
use crate::limits::Precision;
use field::error::{Error, Result};

/// The manifest's file.
const MANIFEST: &str = "bundle.json";
/// Larger manifests are none.
/// It is asked before the file is read: a wrong file of that name is not taken into memory first.
const LARGEST_MANIFEST: u64 = 16 << 20;

/// An opened bundle.
#[derive(Debug)]
pub struct BundleFiles {
    /// Where the files lie.
    place: Place,
    /// The manifest, checked.
    pub manifest: Manifest,
    /// The command that made the bundle, where the manifest says.
    made_with: Option<String>,
    /// SHA-256 of `bundle.json`, which holds the hashes of all other files: the identity of the bundle.
    pub hash: [u8; 32],
}

impl BundleFiles {
    /// Reads `bundle.json` of a folder and checks that each listed file exists with its size.
    pub fn open(folder: &Path) -> Result<BundleFiles> {
        BundleFiles::at(Place::folder(folder))
    }

    /// The same, wherever the files lie.
    pub fn at(mut place: Place) -> Result<BundleFiles> {
        let length = place.length(MANIFEST).unwrap_or(0);
        if length > LARGEST_MANIFEST {
            return Err(Error::bundle(
                MANIFEST,
                format!("has {length} bytes; at most {LARGEST_MANIFEST} are allowed"),
            ));
        }
        let bytes = place.read(MANIFEST)?;
        let manifest = Manifest::parse(&bytes).map_err(|error| {
            // The part of the manifest that can be read may still name it.
            let fields = serde_json::from_slice(&bytes).unwrap_or_default();
            maker::name(error, maker::of(&fields).as_deref())
        })?;
        let made_with = maker::of(&serde_json::from_slice(&bytes).unwrap_or_default());
        // From here on a file that the folder lacks is looked for in the body's.
        if let Some(body) = &manifest.body {
            place.take_body(body);
        }
        for (name, entry) in &manifest.files {
            let length = place.length(name).map_err(|error| match &manifest.body {
                Some(body) => missing(error, name, body),
                None => error,
            })?;
            if length != entry.bytes {
                let lies = place.of_body(name);
                let problem = format!(
                    "{lies}has {length} bytes, bundle.json field `files.{name}.bytes` says {}; fetch or make the bundle again",
                    entry.bytes
                );
                let error = Error::bundle(name, problem);
                return Err(maker::name(error, made_with.as_deref()));
            }
        }
        Ok(BundleFiles {
            place,
            manifest,
            made_with,
            hash: Sha256::digest(&bytes).into(),
        })
    }

    /// Adds the tool that made the bundle to an error about one of its files.
    pub fn name_maker(&self, error: Error) -> Error {
        maker::name(error, self.made_with.as_deref())
    }

    /// Where a listed file lies: in the bundle's folder or in its body's; none for a bundle in memory.
    pub fn path(&self, name: &str) -> Option<PathBuf> {
        self.place.path(name)
    }

    /// Whether the manifest lists `name`.
    pub fn has(&self, name: &str) -> bool {
        self.manifest.files.contains_key(name)
    }

    /// The bytes of a listed file, hash checked.
    ///
    /// # Errors
    /// [`Error::Bundle`] for a file that is not listed or has another hash, [`Error::Io`] where it
    /// cannot be read.
    pub fn read(&self, name: &str) -> Result<Vec<u8>> {
        let entry = self.manifest.files.get(name).ok_or_else(|| {
            Error::bundle(
                "bundle.json",
                format!("field `files`: `{name}` is not listed"),
            )
        })?;
        let bytes = self.place.read(name)?;
        let digest = hex(&Sha256::digest(&bytes));
        if !digest.eq_ignore_ascii_case(&entry.sha256) {
            return Err(Error::bundle(
                name,
                format!(
                    "{}SHA-256 is {digest}, bundle.json field `files.{name}.sha256` says {}; fetch or make the bundle again",
                    self.place.of_body(name),
                    entry.sha256
                ),
            ));
        }
        Ok(bytes)
    }

    /// The file of the graph `name` in a precision: `latent.onnx`, `latent.f16.onnx`, `latent.int8.onnx`. bfloat16 is
    /// an arithmetic of the native kernels and has no graphs of its own.
    ///
    /// # Errors
    /// [`Error::Unsupported`] when the manifest does not list the variant.
    pub fn graph_file(&self, name: &str, precision: Precision) -> Result<String> {
        let variant = match precision {
            Precision::F32 | Precision::Bf16 => return Ok(format!("{name}.onnx")),
            Precision::F16 => "f16",
            Precision::Int8 => "int8",
        };
        let file = format!("{name}.{variant}.onnx");
        let stated = &self.manifest.precisions;
        if stated.iter().any(|one| one == variant) && self.has(&file) {
            return Ok(file);
        }
        Err(Error::Unsupported(format!(
            "precision {variant}: {} has no {file} (bundle.json field `precisions` is [{}]); export it with \
             `python -m upt_training export --{variant}`, or open the bundle with float32",
            self.manifest.name,
            stated.join(", ")
        )))
    }

    /// A listed safetensors file.
    pub fn tensors(&self, name: &str) -> Result<TensorFile> {
        TensorFile::parse(name, self.read(name)?)
    }
}

/// Says where a file that a bundle with a body lacks may lie.
fn missing(error: Error, name: &str, body: &str) -> Error {
    match error {
        Error::Io { path, cause } => Error::Io {
            path,
            cause: format!(
                "{cause}; {MANIFEST} field `files` lists `{name}`, and field `body` takes what the bundle lacks from the folder `{body}` beside it: \
                 keep both side by side, or copy the bundle's files together"
            ),
        },
        other => other,
    }
}

/// Lower-case hex.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
