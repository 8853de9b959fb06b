//! Reference soft tissue.
