//! Why a call fails: its status, and the message that `upt_last_error` gives.

use super::constants::upt_status;
use crate::error::Error;

/// A status with its message.
pub(super) struct Failure {
    pub status: upt_status,
    pub message: String,
}

/// What the body of an exported function gives.
pub(super) type Answer = Result<upt_status, Failure>;

/// A failure of the boundary itself (pointers, sizes, handles).
pub(super) fn fail<T>(status: upt_status, message: impl Into<String>) -> Result<T, Failure> {
    Err(Failure {
        status,
        message: message.into(),
    })
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Failure {
            status: error.status(),
            message: error.to_string(),
        }
    }
}
