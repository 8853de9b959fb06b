//! Tools beside the reference solver: how deep each lies where both go the same way.

use anyhow::Result;

use super::met::Met;
use super::run::Hands;
use super::way::Way;
use crate::stress::Row;

/// Places of a row: the solver takes seconds at each.
const PLACES: usize = 100;
/// A tool may lie so many times as deep as the solver's, or this deep, mm.
const TIMES: f64 = 2.0;
const LEAST_MM: f64 = 0.3;

/// The first of the ways that the solver can go: under a fine tip its elements may invert. Good if no tool lies deeper than it may.
pub(super) fn row(hands: &mut Hands, name: &str, ways: &[Way]) -> Result<Row> {
    let most = if hands.bench.quick { 1 } else { PLACES };
    let (mut places, mut ended) = (0, 0);
    let (mut held, mut worst, mut true_worst) = (0, 0.0f64, 0.0f64);
    for way in ways {
        if places == most {
            break;
        }
        let Some(true_mm) = way.true_depth(hands)? else {
            ended += 1;
            continue;
        };
        places += 1;
        let own_mm = Met::default().place(hands, way)?;
        held += usize::from(own_mm <= (TIMES * true_mm).max(LEAST_MM));
        worst = worst.max(own_mm);
        true_worst = true_worst.max(true_mm);
    }
    let text = format!(
        "at most {TIMES} times as deep as in the truth, or {LEAST_MM} mm, in {held} of {places} places; {worst:.2} mm at most, the truth {true_worst:.2} mm; the solver's elements inverted in {ended} more"
    );
    let name = format!("{name}, beside the truth");
    let good = held == places && held > 0;
    Ok(Row::new(&hands.bench.subject, &name, text, good))
}
