//! The same bits on every processor: which kernels a model takes for them, and which bundles cannot have them.
//!
//! REQ-094: A model that is opened as portable computes steps with the same bits on every processor.

use crate::bundle::{Manifest, ManifestKind};
use crate::error::{Error, Result};
use crate::kernels::Isa;
use crate::options::ModelOptions;

/// The set of all kernels of a model.
///
/// # Errors
/// [`Error::Unsupported`] for a network, which ONNX Runtime computes as this machine does it best.
pub(super) fn set_of(options: &ModelOptions, manifest: &Manifest) -> Result<Isa> {
    if !options.portable {
        return Ok(Isa::detect());
    }
    if manifest.kind == ManifestKind::Upt || manifest.reduced.is_some() {
        return Err(Error::Unsupported(format!(
            "portable: {} has a network, whose bits depend on the machine; open a reduced bundle without one, or leave portable off",
            manifest.name
        )));
    }
    Ok(Isa::portable())
}
