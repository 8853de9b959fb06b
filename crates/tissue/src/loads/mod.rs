//! What moves the tissue in a case: a scheme of prescribed contact, or tools. Both are rows of a table of specifications
//! ([`crate::schemes::TABLE`], [`crate::programmes::TABLE`]), which the command line, the documentation, the plots and
//! Python read: this is where it leaves the crate, as JSON and as Markdown.

mod page;

pub use page::{programmes_table, replace, schemes_table};

use serde::Serialize;

use crate::programmes::{self, ToolProgramme};
use crate::schemes::{self, FRAME_S, FRAMES, Group, Scheme};

/// Both tables, one row a line, as `training/upt_training/loads.json` and `upt loads --json` have them. Units are in the
/// names of the fields.
///
/// # Errors
/// None that a table of numbers and words has; those of `serde_json`.
pub fn json() -> serde_json::Result<String> {
    let section = serde_json::to_string(schemes::PAPER_SECTION)?;
    Ok(format!(
        "{{\n\"frame_s\": {FRAME_S},\n\"face_area_mm2\": {},\n\"paper_section\": {section},\n\"schemes\": [\n{}\n],\n\"programmes\": [\n{}\n]\n}}\n",
        crate::contact::FACE_AREA_MM2,
        lines(&schemes::TABLE)?,
        lines(&programmes::TABLE)?
    ))
}

fn lines(rows: &[impl Serialize]) -> serde_json::Result<String> {
    let rows: Result<Vec<String>, _> = rows.iter().map(serde_json::to_string).collect();
    Ok(rows?.join(",\n"))
}

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
        match self {
            Load::Scheme(scheme) => match scheme.specification().group {
                Group::Trained | Group::Withheld | Group::Hard => true,
                Group::Probe | Group::Static => false,
            },
            Load::Tools(_) => true,
        }
    }
}
