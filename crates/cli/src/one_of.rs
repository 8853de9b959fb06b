//! Values of an option that are the cases of an enumeration, by their names.

use clap::builder::{PossibleValuesParser, TypedValueParser};

/// Takes one of `all`.
pub fn one_of<T: Copy + Send + Sync + 'static>(
    all: &'static [T],
    name: fn(T) -> &'static str,
) -> impl TypedValueParser<Value = T> {
    let names = all.iter().map(|value| name(*value));
    PossibleValuesParser::new(names).try_map(move |text| {
        let found = all.iter().find(|value| name(**value) == text);
        found.copied().ok_or("no such value")
    })
}
