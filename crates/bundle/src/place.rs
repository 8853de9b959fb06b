//! Where a bundle's files lie: in a folder, in part in that of its body beside it, or in memory, for hosts that have no files or keep theirs in
//! archives.
//!
//! REQ-003: Only regular files are read, in the bundle's own folder and in the one beside it that its manifest names as its body.

use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use field::error::{Error, Result};
use field::memory;

/// Where a bundle's files lie.
#[derive(Debug)]
pub enum Place {
    /// A folder, and for what it lacks that of the body.
    Folder {
        /// The bundle's own.
        own: PathBuf,
        /// The body's, where the manifest names one.
        body: Option<PathBuf>,
    },
    /// Name and bytes. A file is read once, and leaves the list then.
    Memory(Mutex<BTreeMap<String, Vec<u8>>>),
}

impl Place {
    /// A bundle's folder.
    pub fn folder(own: &Path) -> Place {
        Place::Folder {
            own: own.to_owned(),
            body: None,
        }
    }

    /// Takes what the bundle's folder lacks from the folder `body` beside it. Files in memory are one list.
    pub(super) fn take_body(&mut self, name: &str) {
        if let Place::Folder { own, body } = self {
            *body = Some(beside(own, name));
        }
    }

    /// For messages about a file that lies in the body's folder: which that is.
    pub(super) fn of_body(&self, name: &str) -> String {
        match (self, self.path(name)) {
            (Place::Folder { own, .. }, Some(path)) if path.parent() != Some(own) => {
                format!("lies in the body's folder as {}; ", path.display())
            }
            _ => String::new(),
        }
    }

    /// Where a file lies, if it lies in a folder.
    pub(super) fn path(&self, name: &str) -> Option<PathBuf> {
        match self {
            Place::Folder { own, body } => Some(within(own, body.as_deref(), name)),
            Place::Memory(_) => None,
        }
    }

    /// Bytes of a file.
    pub(super) fn length(&self, name: &str) -> Result<u64> {
        match self {
            Place::Folder { own, body } => {
                let path = within(own, body.as_deref(), name);
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
            Place::Folder { own, body } => read_regular(&within(own, body.as_deref(), name)),
            Place::Memory(files) => {
                let mut files = files.lock().unwrap_or_else(PoisonError::into_inner);
                files.remove(name).ok_or_else(|| not_given(name))
            }
        }
    }
}

/// The folder `name` beside `own`.
/// By the path's own last part where it has one; `.` and `..` have none, and are left through `..`.
fn beside(own: &Path, name: &str) -> PathBuf {
    match own.file_name() {
        Some(_) => own.with_file_name(name),
        None => own.join("..").join(name),
    }
}

/// A file of the bundle's own folder, and where that has nothing of this name, of the body's.
///
/// Asked without following links: a broken link in the bundle's folder is a fault of this bundle,
/// and not a reason to take the body's file.
fn within(own: &Path, body: Option<&Path>, name: &str) -> PathBuf {
    let path = own.join(name);
    match body {
        Some(body) if fs::symlink_metadata(&path).is_err() => body.join(name),
        _ => path,
    }
}

/// Where the file `name` of a bundle lies whose manifest names `body`, a plain name, as its body.
pub fn file_of(bundle: &Path, body: Option<&str>, name: &str) -> PathBuf {
    let body = body.map(|body| beside(bundle, body));
    within(bundle, body.as_deref(), name)
}

/// Of a bundle in memory.
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
pub fn read_regular(path: &Path) -> Result<Vec<u8>> {
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
    // Asked of the open file and not of its path, under which another file may lie by now.
    let found = file.metadata().map_err(failed)?;
    if !found.is_file() {
        return Err(not_regular(path));
    }
    // Room is asked for first: a size that no memory has is an error, and reading then does not
    // grow the list.
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
