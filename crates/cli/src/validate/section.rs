//! A part of the page, and the words that its tables share.

/// What a case gives: its name in the page's markers, its text, and its plots by file name.
pub struct Section {
    pub name: &'static str,
    pub text: String,
    pub plots: Vec<(String, String)>,
}

/// `bar reached` or `bar missed`.
pub fn verdict(reached: bool) -> &'static str {
    if reached { "reached" } else { "**missed**" }
}
