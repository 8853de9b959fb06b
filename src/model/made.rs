//! What a model makes once, when the first scene asks for it.

use std::sync::{Arc, Mutex, OnceLock};

use crate::corrections::Corrections;

/// Nothing of it is made when the bundle is opened.
#[derive(Default)]
pub(super) struct MadeOnce {
    pub corrections: OnceLock<Box<Corrections>>,
    /// Where tools touch the domain.
    pub samples: OnceLock<Arc<::contact::Samples>>,
    /// The mesh as what can be cut.
    pub rest: OnceLock<Arc<topology::RestMesh>>,
    /// Held while `corrections` are read, so that two scenes do not read them twice.
    pub opening: Mutex<()>,
}
