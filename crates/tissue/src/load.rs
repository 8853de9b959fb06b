//! What moves the tissue in a case: a scheme of prescribed contact, or tools.

use crate::programmes::ToolProgramme;
use crate::schemes::{FRAMES, Scheme};

/// What moves the tissue in a case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Load {
    /// Contact that is prescribed, or a list of equilibria.
    Scheme(Scheme),
    /// Rigid tools.
    Tools(ToolProgramme),
}

impl Load {
    /// The scheme in files.
    pub fn name(self) -> String {
        match self {
            Load::Scheme(scheme) => scheme.name().into(),
            Load::Tools(programme) => format!("tool-{}", programme.name()),
        }
    }

    /// Frames of a case at most, rest included.
    pub fn frames(self) -> usize {
        match self {
            Load::Scheme(scheme) => scheme.frames(),
            Load::Tools(_) => FRAMES,
        }
    }

    /// The static scheme that it is.
    pub(crate) fn statics(self) -> Option<Scheme> {
        match self {
            Load::Scheme(scheme) if scheme.is_static() => Some(scheme),
            _ => None,
        }
    }

    /// Probes and equilibria serve training and are never held out.
    pub(crate) fn is_tested(self) -> bool {
        self.statics().is_none() && self != Load::Scheme(Scheme::Probe)
    }
}
