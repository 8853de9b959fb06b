//! Where a bundle's files lie: in a folder, or in memory, for hosts that have no files or keep theirs in archives.
//!
//! REQ-003: Only regular files in the bundle's own folder are read.

use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use crate::error::{Error, Result};
use crate::memory;

/// Where a bundle's files lie.
#[derive(Debug)]
pub enum Place {
    /// A folder.
    Folder(PathBuf),
    /// Name and bytes. A file is read once, and leaves the list then.
    Memory(Mutex<BTreeMap<String, Vec<u8>>>),
}

impl Place {
    /// Bytes of a file.
    pub(super) fn length(&self, name: &str) -> Result<u64> {
        match self {
            Place::Folder(folder) => {
                let path = folder.join(name);
                let found = fs::metadata(&path).map_err(|error| Error::io(&path, error))?;
                match found.is_file() {
                    true => Ok(found.len()),
                    false => Err(not_regular(&path)),
                }
            }
            Place::Memory(files) => {
                let files = files.lock().unwrap_or_else(PoisonError::into_inner);
                let bytes = files.get(name).ok_or_else(|| not_given(name))?;
                Ok(bytes.len() as u64)
            }
        }
    }

    /// A file.
    pub(super) fn read(&self, name: &str) -> Result<Vec<u8>> {
        match self {
            Place::Folder(folder) => read_regular(&folder.join(name)),
            Place::Memory(files) => {
                let mut files = files.lock().unwrap_or_else(PoisonError::into_inner);
                files.remove(name).ok_or_else(|| not_given(name))
            }
        }
    }
}

fn not_given(name: &str) -> Error {
    Error::io(name, "is not among the files that were given")
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
