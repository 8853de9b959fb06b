//! The only place that knows `ort`: finding the library, environment, providers, sessions.

mod engine_cache;
mod gpu;
mod graph;
mod locate;
mod memory;
mod placement;
mod plugin;
mod providers;
mod runtime;
mod sessions;
mod stage;
mod status;
mod version;
mod wish;

pub use providers::providers_json;
pub use runtime::Runtime;
pub(super) use sessions::Sessions;
pub use stage::Stage;
