//! Progress of long work on a terminal; nothing elsewhere.

use std::borrow::Cow;

use indicatif::{ProgressBar, ProgressStyle};

/// A counter for work of unknown length.
pub fn spinner(quiet: bool, message: &'static str) -> ProgressBar {
    if quiet {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new_spinner().with_message(message);
    if let Ok(style) = ProgressStyle::with_template("{spinner} {msg}: {pos} ({elapsed})") {
        bar.set_style(style);
    }
    bar
}

/// A bar with time left.
pub fn bar(quiet: bool, length: u64, message: impl Into<Cow<'static, str>>) -> ProgressBar {
    if quiet {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(length).with_message(message);
    if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} {eta}") {
        bar.set_style(style);
    }
    bar
}

/// A bar over so many cases.
pub fn cases(count: usize, label: &str) -> ProgressBar {
    bar(false, count as u64, label.to_owned())
}
