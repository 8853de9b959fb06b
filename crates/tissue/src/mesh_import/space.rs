//! Which way the axes of a file run: 3D Slicer writes `SPACE=LPS` (x to the patient's left, y to the back) or `SPACE=RAS` (to the right
//! and the front) into the first lines of STL, OBJ, PLY and VTK files.

use super::ImportError;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Bytes at a file's beginning in which its space is named.
const HEAD: u64 = 4096;

/// Turns positions of `path` into the space of `beside`, where both files name their spaces and these differ.
pub fn turn(positions: &mut [[f64; 3]], path: &Path, beside: &Path) -> Result<(), ImportError> {
    if let (Some(own), Some(other)) = (is_lps(path)?, is_lps(beside)?)
        && own != other
    {
        // Half a turn about z.
        for [x, y, _] in positions {
            (*x, *y) = (-*x, -*y);
        }
    }
    Ok(())
}

/// Whether a file's space is LPS; none where it names neither.
fn is_lps(path: &Path) -> Result<Option<bool>, ImportError> {
    let mut head = Vec::new();
    File::open(path)
        .and_then(|file| file.take(HEAD).read_to_end(&mut head))
        .map_err(|error| ImportError::format(path, &error.to_string()))?;
    let holds = |word: &[u8]| head.windows(word.len()).any(|part| part == word);
    Ok(match (holds(b"SPACE=LPS"), holds(b"SPACE=RAS")) {
        (true, false) => Some(true),
        (false, true) => Some(false),
        _ => None,
    })
}
