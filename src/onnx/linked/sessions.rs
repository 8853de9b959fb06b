//! The sessions of a model on the CPU, made once and shared by its scenes: weights and what ONNX Runtime makes of them
//! lie in memory once, however many scenes there are. Each scene binds tensors of its own. A device's session is its
//! scene's alone, because a captured CUDA graph belongs to one set of tensors.

use std::collections::HashMap;
use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

use ort::session::Session;

use crate::onnx::ProviderChoice;

/// A graph's file and the threads of its session.
type Key = (String, usize);
/// A session and what runs it.
type Entry = (Arc<Session>, ProviderChoice);

/// Sessions by graph and threads.
#[derive(Clone, Default)]
pub(in crate::onnx) struct Sessions(Arc<Mutex<HashMap<Key, Entry>>>);

impl Sessions {
    /// The session of a graph with this many threads, if there is one.
    pub fn find(&self, key: &Key) -> Option<Entry> {
        let entries = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        entries.get(key).cloned()
    }

    /// Keeps a session for the next stage that asks.
    pub fn keep(&self, key: Key, session: &Arc<Session>, choice: &ProviderChoice) {
        let mut entries = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        entries.insert(key, (Arc::clone(session), choice.clone()));
    }
}

impl fmt::Debug for Sessions {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let entries = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        out.debug_list().entries(entries.keys()).finish()
    }
}
