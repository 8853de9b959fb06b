//! libupt: real-time soft tissue for game engines.
