//! Plots as inline SVG: axes with ticks, their colours.

mod axes;

pub use axes::{Axes, Scale, label, legend};

/// Colours of the methods, in their order of appearance; distinct for the colour-blind.
const COLOURS: [&str; 10] = [
    "#0b6e99", "#d1495b", "#3a7d44", "#8e5ea2", "#e08e1b", "#5a6b7b", "#00a39b", "#a0522d",
    "#7b2d26", "#4f5bd5",
];

/// Colour of the `index`th method.
pub fn colour(index: usize) -> &'static str {
    COLOURS[index % COLOURS.len()]
}

/// Text made safe for HTML and SVG.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}
