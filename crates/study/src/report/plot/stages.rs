//! Where a step's time goes: a bar a configuration, a colour a stage.

use std::fmt::Write;

use picture::plot::{colour, escape};
use picture::plot::{label, legend};

/// Mean time of each stage of one configuration, ms.
pub struct Stages {
    pub name: String,
    pub stages: Vec<(String, f64)>,
}

pub fn stage_breakdown(rows: &[Stages]) -> String {
    const LEFT: f64 = 230.0;
    const WIDTH: f64 = 540.0;
    let totals: Vec<f64> = rows
        .iter()
        .map(|row| row.stages.iter().map(|stage| stage.1).sum())
        .collect();
    let mut body = String::new();
    let mut names: Vec<String> = Vec::new();
    for (index, row) in rows.iter().enumerate() {
        let y = 8.0 + 30.0 * index as f64;
        let _ = write!(
            body,
            "<text class=\"tick\" x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text>",
            LEFT - 8.0,
            y + 14.0,
            escape(&row.name)
        );
        let mut x = LEFT;
        for (name, value) in &row.stages {
            let at = names
                .iter()
                .position(|known| known == name)
                .unwrap_or_else(|| {
                    names.push(name.clone());
                    names.len() - 1
                });
            // Each bar is its own whole: shares, with the total next to it.
            let wide = value / totals[index].max(1e-12) * WIDTH;
            let _ = write!(
                body,
                "<rect x=\"{x:.1}\" y=\"{y}\" width=\"{wide:.1}\" height=\"20\" fill=\"{}\"><title>{}: {} ms</title></rect>",
                colour(at),
                escape(name),
                label(*value)
            );
            if wide > 46.0 {
                let _ = write!(
                    body,
                    "<text class=\"inbar\" x=\"{:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
                    x + wide / 2.0,
                    y + 14.0,
                    label(*value)
                );
            }
            x += wide;
        }
        let _ = write!(
            body,
            "<text class=\"tick\" x=\"{}\" y=\"{}\">{} ms</text>",
            LEFT + WIDTH + 8.0,
            y + 14.0,
            label(totals[index])
        );
    }
    let entries: Vec<(String, &str)> = names
        .into_iter()
        .enumerate()
        .map(|(index, name)| (name, colour(index)))
        .collect();
    let height = 16.0 + 30.0 * rows.len() as f64;
    legend(&entries)
        + &format!(
            "<svg viewBox=\"0 0 860 {height}\" width=\"860\" height=\"{height}\" role=\"img\">{body}</svg>"
        )
}
