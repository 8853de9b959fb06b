//! Progress of long work on a terminal; nothing elsewhere.

use std::borrow::Cow;

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use yardstick::{Counter, Listener, Watch};

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

/// Shows lines and bars on stderr, unless `quiet`.
pub fn watch(quiet: bool) -> Watch {
    match quiet {
        true => Watch::default(),
        false => Watch::new(Terminal(MultiProgress::new())),
    }
}

struct Terminal(MultiProgress);

struct Shown(ProgressBar);

impl Listener for Terminal {
    fn start(&self, what: &str, count: Option<u64>) -> Box<dyn Counter> {
        let bar = match count {
            Some(count) => bar(false, count, what.to_owned()),
            None => {
                let bar = ProgressBar::new_spinner().with_message(what.to_owned());
                let style = ProgressStyle::with_template("{spinner} {msg}: {pos} ({elapsed})");
                style.map_or(bar.clone(), |style| bar.with_style(style))
            }
        };
        Box::new(Shown(self.0.add(bar)))
    }

    fn tell(&self, line: &str) {
        self.0.suspend(|| eprintln!("{line}"));
    }
}

impl Counter for Shown {
    fn set(&self, done: u64) {
        self.0.set_position(done);
    }
}

impl Drop for Shown {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
