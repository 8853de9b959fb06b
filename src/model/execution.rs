//! What a model's scenes run on.

use crate::kernels::Isa;
use crate::onnx::{ProviderChoice, ProviderPlan, Runtime};
use crate::options::Precision;

/// Chosen when the bundle is opened; the model of a cut body has that of the intact one.
#[derive(Clone)]
pub(crate) struct Execution {
    /// ONNX Runtime; none where the bundle has no graph.
    pub runtime: Option<&'static Runtime>,
    /// Providers to try for a graph, in order.
    pub plan: ProviderPlan,
    /// What runs the latent stage, and why others do not.
    pub choice: ProviderChoice,
    /// Of a scene that asks for none.
    pub threads: usize,
    /// Of all kernels of its scenes.
    pub isa: Isa,
    /// Of a scene's native decoder that asks for none.
    pub precision: Precision,
}
