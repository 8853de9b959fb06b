//! The files of a bundle: read once, size and SHA-256 checked against the manifest.

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use super::maker;
use super::manifest::Manifest;
use super::tensors::TensorFile;
use crate::error::{Error, Result};
use crate::memory;
use crate::options::Precision;

/// Larger manifests are none.
const LARGEST_MANIFEST: u64 = 16 << 20;

/// An opened bundle folder.
#[derive(Debug)]
pub struct BundleFiles {
    folder: PathBuf,
    /// The manifest, checked.
    pub manifest: Manifest,
    /// The command that made the bundle, where the manifest says.
    made_with: Option<String>,
    /// SHA-256 of `bundle.json`, which holds the hashes of all other files: the identity of the bundle.
    pub hash: [u8; 32],
}

impl BundleFiles {
    /// Reads `bundle.json` and checks that each listed file exists with its size.
    pub fn open(folder: &Path) -> Result<BundleFiles> {
        let path = folder.join("bundle.json");
        let length = fs::metadata(&path).map_or(0, |found| found.len());
        if length > LARGEST_MANIFEST {
            return Err(Error::bundle(
                "bundle.json",
                format!("has {length} bytes; at most {LARGEST_MANIFEST} are allowed"),
            ));
        }
        let bytes = read_regular(&path)?;
        let manifest = Manifest::parse(&bytes).map_err(|error| {
            // The part of the manifest that can be read may still name it.
            let fields = serde_json::from_slice(&bytes).unwrap_or_default();
            maker::name(error, maker::of(&fields).as_deref())
        })?;
        let made_with = maker::of(&serde_json::from_slice(&bytes).unwrap_or_default());
        for (name, entry) in &manifest.files {
            let path = folder.join(name);
            let found = fs::metadata(&path).map_err(|error| Error::io(&path, error))?;
            if !found.is_file() {
                return Err(not_regular(&path));
            }
            if found.len() != entry.bytes {
                let problem = format!(
                    "has {} bytes, bundle.json field `files.{name}.bytes` says {}; fetch or make the bundle again",
                    found.len(),
                    entry.bytes
                );
                let error = Error::bundle(name, problem);
                return Err(maker::name(error, made_with.as_deref()));
            }
        }
        Ok(BundleFiles {
            folder: folder.to_owned(),
            manifest,
            made_with,
            hash: Sha256::digest(&bytes).into(),
        })
    }

    /// Adds the tool that made the bundle to an error about one of its files.
    pub fn name_maker(&self, error: Error) -> Error {
        maker::name(error, self.made_with.as_deref())
    }

    /// Whether the manifest lists `name`.
    pub fn has(&self, name: &str) -> bool {
        self.manifest.files.contains_key(name)
    }

    /// The bytes of a listed file, hash checked.
    pub fn read(&self, name: &str) -> Result<Vec<u8>> {
        let entry = self.manifest.files.get(name).ok_or_else(|| {
            Error::bundle(
                "bundle.json",
                format!("field `files`: `{name}` is not listed"),
            )
        })?;
        let path = self.folder.join(name);
        let bytes = read_regular(&path)?;
        let digest = hex(&Sha256::digest(&bytes));
        if !digest.eq_ignore_ascii_case(&entry.sha256) {
            return Err(Error::bundle(
                name,
                format!(
                    "SHA-256 is {digest}, bundle.json field `files.{name}.sha256` says {}; fetch or make the bundle again",
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

fn not_regular(path: &Path) -> Error {
    Error::io(
        path,
        "is not a regular file; a bundle and a mesh are made of plain files",
    )
}

/// The bytes of a regular file. Anything else (a pipe, a device, a folder) is refused without waiting for it.
pub(crate) fn read_regular(path: &Path) -> Result<Vec<u8>> {
    let failed = |error: std::io::Error| Error::io(path, error);
    let mut options = fs::OpenOptions::new();
    options.read(true);
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt;
        // A pipe that nobody writes to would be waited for.
        options.custom_flags(libc::O_NONBLOCK);
    }
    let mut file = options.open(path).map_err(failed)?;
    let found = file.metadata().map_err(failed)?;
    if !found.is_file() {
        return Err(not_regular(path));
    }
    let size = usize::try_from(found.len()).unwrap_or(usize::MAX);
    let mut bytes = memory::room(size, &format!("the file {}", path.display()))?;
    file.read_to_end(&mut bytes).map_err(|error| {
        match error.kind() == std::io::ErrorKind::OutOfMemory {
            true => Error::OutOfMemory(format!("no memory for the file {}", path.display())),
            false => failed(error),
        }
    })?;
    Ok(bytes)
}

/// Lower-case hex.
pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
