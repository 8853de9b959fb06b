//! The only place that knows `ort`: finding the library, environment, providers, sessions.
//!
//! Nothing here is touched, and no library is opened, until a model is opened or the providers are asked for.

mod locate;
mod providers;
mod runtime;
mod stage;

pub use providers::{ProviderChoice, ProviderPlan, providers_json};
pub use runtime::Runtime;
pub use stage::{Stage, StageOptions};
