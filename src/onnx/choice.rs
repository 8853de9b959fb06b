//! Which provider runs a session, and why others do not.

use std::collections::BTreeMap;

use crate::options::Provider;

/// What runs a session and why providers before it in the list do not.
#[derive(Debug, Clone)]
pub struct ProviderChoice {
    /// What runs.
    pub provider: Provider,
    /// Nodes of the session's graph by ONNX Runtime's name of the provider that runs them: a GPU provider may leave
    /// some to the CPU. Empty where the library does not say.
    pub nodes: BTreeMap<String, usize>,
    /// Where the stage's tensors lie: `host`, `device`, or `bound anew in each run` where device memory is not to be had.
    pub memory: &'static str,
    /// Provider and reason, for each that was asked for and not taken.
    pub refused: Vec<(Provider, String)>,
}

impl ProviderChoice {
    /// The CPU, which nobody refused.
    pub(super) fn cpu() -> ProviderChoice {
        ProviderChoice {
            provider: Provider::Cpu,
            nodes: BTreeMap::new(),
            memory: "host",
            refused: Vec::new(),
        }
    }
}
