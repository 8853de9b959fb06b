//! Files as bytes: pipes, devices and folders are refused, since reading them may wait or go on for ever.

use std::fs::File;
use std::io::{Error, ErrorKind, Read, Result};
use std::path::Path;

/// The whole content of a file.
///
/// # Errors
/// Of the system; `InvalidInput` for what is no regular file, `OutOfMemory` for one that memory does not hold.
pub fn read(path: &Path) -> Result<Vec<u8>> {
    // Before it is opened: opening a pipe waits for its other end.
    if !std::fs::metadata(path)?.is_file() {
        return Err(Error::new(
            ErrorKind::InvalidInput,
            "not a regular file but a folder, a pipe or a device; give a file",
        ));
    }
    let file = File::open(path)?;
    let length = file.metadata()?.len();
    let mut bytes = Vec::new();
    usize::try_from(length)
        .ok()
        .and_then(|length| bytes.try_reserve_exact(length).ok())
        .ok_or_else(|| Error::from(ErrorKind::OutOfMemory))?;
    // No more than was said, whatever became of the file since.
    file.take(length).read_to_end(&mut bytes)?;
    Ok(bytes)
}
