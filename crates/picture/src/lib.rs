//! Pictures without a graphics card: plots as SVG, and organs, shaded and coloured, as PNG.

pub mod plot;
pub mod render;
