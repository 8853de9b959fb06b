//! Which of several bodies is wanted: their names, sizes and places, and what is too small to be one.

use super::found_body::{FoundBody, LISTED};
use super::labels::Group;
use super::{ImportError, ImportOptions};
use std::path::Path;

/// A body below this part of all is a speck, which a repair drops.
const SPECK: f64 = 0.01;

/// Names that are looked for, at most.
const NAMES: usize = 40;

/// The names of a file's parts, by place.
#[derive(Default)]
pub struct Names(Vec<(String, Group)>);

impl Names {
    /// Of a file, `scale` millimetres a unit; none where it cannot be read.
    pub fn of(path: &Path, scale: f64) -> Self {
        let labels = super::read_labels(path).unwrap_or_default();
        let names = labels.names().into_iter().take(NAMES);
        let groups = names.filter_map(|name| {
            let group = labels.group(name, path, scale).ok()?;
            Some((name.to_owned(), group))
        });
        Self(groups.collect())
    }

    /// Of the face or tetrahedron with this centroid, mm; empty where it has none.
    pub fn at(&self, centroid: [f64; 3]) -> String {
        let named = |group: &Group| group.holds_tet(centroid) || group.holds_by_face(centroid);
        let mut found = self.0.iter().filter(|(_, group)| named(group));
        found.next().map_or(String::new(), |(name, _)| name.clone())
    }
}

/// Which of several bodies to keep: the wanted one, or the only one that is no speck; their places are ascending.
///
/// # Errors
/// [`ImportError::Bodies`] lists them.
pub fn choose(
    bodies: &[FoundBody],
    options: &ImportOptions,
    notes: &mut Vec<String>,
) -> Result<usize, ImportError> {
    let refused = |why: String| ImportError::Bodies {
        why,
        bodies: bodies.to_vec(),
    };
    if let Some(part) = &options.part {
        let named =
            |body: &FoundBody| !body.name.is_empty() && body.name.eq_ignore_ascii_case(part);
        let mut found = (0..bodies.len()).filter(|&at| named(&bodies[at]));
        let number = part
            .parse::<usize>()
            .ok()
            .filter(|n| (1..=bodies.len()).contains(n));
        return match (found.next(), found.next(), number) {
            (Some(at), None, _) => Ok(at),
            (_, _, Some(number)) => Ok(number - 1),
            (Some(_), Some(_), _) => Err(refused(format!(
                "several are called `{part}`: give a number"
            ))),
            _ => Err(refused(format!("none is --part {part}"))),
        };
    }
    let all: f64 = bodies.iter().map(|body| body.volume_mm3).sum();
    let specks = |body: &&FoundBody| body.volume_mm3 < SPECK * all;
    let count = bodies.len() - bodies.iter().filter(specks).count();
    if count > 1 || bodies.len() > 1 && !options.repair {
        return Err(refused(
            "choose one with --part NUMBER or --part NAME".to_owned(),
        ));
    }
    for body in bodies.iter().filter(specks).take(LISTED) {
        notes.push(format!("a speck was left out: {body}"));
    }
    (0..bodies.len())
        .max_by(|&a, &b| bodies[a].volume_mm3.total_cmp(&bodies[b].volume_mm3))
        .ok_or_else(|| refused("the file holds no body".to_owned()))
}
