//! A row of the table.

use serde::Serialize;

use crate::bench::{Bench, Run};

/// What a case came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// What must happen happened.
    Good,
    /// It did not.
    Bad,
    /// The case does not apply; `happened` says why.
    Left,
}

/// A row of the table.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    pub subject: String,
    pub case: String,
    pub happened: String,
    pub verdict: Verdict,
}

impl Row {
    pub fn new(subject: &str, case: &str, happened: String, good: bool) -> Self {
        Self {
            subject: subject.into(),
            case: case.into(),
            happened,
            verdict: if good { Verdict::Good } else { Verdict::Bad },
        }
    }

    pub fn left(subject: &str, case: &str, why: &str) -> Self {
        Self {
            verdict: Verdict::Left,
            ..Self::new(subject, case, why.into(), true)
        }
    }
}

impl Bench {
    pub(crate) fn row(&self, case: &str, run: &Run, good: bool) -> Row {
        Row::new(&self.subject, case, run.text(), good)
    }
}
