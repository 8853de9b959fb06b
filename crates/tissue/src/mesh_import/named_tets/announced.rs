//! How many members the sets of a file announce, counted before any is gathered: in a range, or in sets that name sets, a few bytes announce
//! more than memory holds.

use super::super::error::{Fault, fault};
use super::super::words::short;
use super::model::{Entry, Model, Sets};
use super::sets::MOST_LEVELS;

/// Refuses a set that announces far more members than a file of this many bytes can hold. Those of the sets in it count too, repeated ones
/// each time.
///
/// # Errors
/// The first such set, with its line.
pub fn check(model: &Model, bytes: usize) -> Result<(), Fault> {
    // Ranges with gaps in their numbers are sound, so there is room for them.
    let most = bytes.saturating_mul(16).saturating_add(1 << 20) as u64;
    for scope in &model.scopes {
        for sets in [&scope.node_sets, &scope.element_sets] {
            let mut known = vec![None; sets.list.len()];
            for (at, set) in sets.list.iter().enumerate() {
                let count = announced(sets, at, &mut known, 0);
                if count > most {
                    return fault(format!(
                        "line {}: set `{}` announces {count} members, more than a file of {bytes} bytes can hold; \
                         correct its ranges and the sets that it names, or leave it out",
                        set.line,
                        short(&set.name),
                    ));
                }
            }
        }
    }
    Ok(())
}

/// Members that a set announces; none in sets at more levels than are followed, and in those that name themselves.
fn announced(sets: &Sets<Entry>, at: usize, known: &mut [Option<u64>], level: usize) -> u64 {
    if let Some(count) = known[at] {
        return count;
    }
    if level > MOST_LEVELS {
        return 0;
    }
    known[at] = Some(0);
    let entries = sets.list[at].entries.iter();
    let counts = entries.map(|entry| match entry {
        Entry::Set(name) => match sets.find(name) {
            Some(inner) => announced(sets, inner, known, level + 1),
            None => 0,
        },
        entry => written(entry),
    });
    let count = counts.fold(0, u64::saturating_add);
    known[at] = Some(count);
    count
}

/// Members that an entry announces by itself.
fn written(entry: &Entry) -> u64 {
    match entry {
        Entry::Range(first, last, step) => match last.checked_sub(*first) {
            Some(way) => (way / (*step).max(1)).saturating_add(1),
            None => 0,
        },
        Entry::Of(_, inner) => written(inner),
        _ => 1,
    }
}
