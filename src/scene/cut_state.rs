//! What a scene keeps of a body that has been cut.

use std::sync::Arc;

use topology::Body;

use crate::memory::HeldBytes;
use crate::model::Model;

/// See the module. The scene's own model is then that of the cut body.
pub struct CutState {
    /// The model that the scene was made with.
    pub intact: Arc<Model>,
    pub body: Body,
    /// Bytes of the cut body's model.
    pub model_bytes: usize,
}

impl HeldBytes for CutState {
    fn held_bytes(&self) -> usize {
        self.model_bytes + self.body.heap_bytes()
    }
}
