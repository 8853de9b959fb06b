//! Tables and pictures of what was shown.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use tissue::mesh::Mesh;
use tissue::schemes::FRAME_S;

use super::figures::{ALL, DatasetRow, Row};
use super::host::{LAST, LATE, PRESENT, Shown, WAYS};
use super::timing::Time;
use super::truth::Truth;
use crate::table::{Column, Table};
use crate::tools::section;
use picture::plot::{Axes, Scale, label};
use yardstick::cases::{ToolCase, ToolCases};

const COLOURS: [&str; 3] = ["#c2553f", "#b08a2e", "#8fb3d3"];
/// Of frames with the bundle's frame step.
const FRAMES: &str = "#1f5f9f";
/// Programmes of the error over time and of the strip.
const PLOTTED: &str = "probe";
const PICTURED: &str = "stroke";

const OVERALL: [Column<Row>; 9] = [
    ("shown", |row| row.way.clone()),
    ("MSE, mm²", |row| label(row.mse_mm2)),
    ("over one step late", |row| ratio(row.over_late)),
    ("the steps' own MSE, mm²", |row| label(row.step_mse_mm2)),
    ("over the steps' own", |row| ratio(row.over_step)),
    ("latency, ms", |row| format!("{:.0}", row.latency_ms)),
    ("jump at an arrival, mm: median / worst", |row| {
        [row.jump_median_mm, row.jump_mm]
            .map(millimetres)
            .join(" / ")
    }),
    (
        "frame to frame against the truth, mm: median / worst",
        |row| {
            [row.unlike_median_mm, row.unlike_mm]
                .map(millimetres)
                .join(" / ")
        },
    ),
    ("tool inside, mm: median / worst", |row| {
        [row.penetration_median_mm, row.penetration_mm]
            .map(label)
            .join(" / ")
    }),
];

const BY_PROGRAMME: [Column<Row>; 8] = [
    ("programme", |row| row.programme.clone()),
    ("cases", |row| row.cases.to_string()),
    ("MSE, mm²", |row| label(row.mse_mm2)),
    ("over one step late", |row| ratio(row.over_late)),
    ("over the steps' own", |row| ratio(row.over_step)),
    ("latency, ms", |row| format!("{:.0}", row.latency_ms)),
    ("frame to frame against the truth, mm", |row| {
        millimetres(row.unlike_mm)
    }),
    ("tool inside, mm", |row| label(row.penetration_mm)),
];

const BY_DATASET: [Column<DatasetRow>; 4] = [
    ("dataset", |row| row.dataset.clone()),
    ("cases", |row| row.cases.to_string()),
    ("over one step late", |row| ratio(row.over_late)),
    ("over the steps' own", |row| ratio(row.over_step)),
];

const CALLS: [Column<Time>; 5] = [
    ("present call in contact", |time| time.region.to_string()),
    ("nodes", |time| time.nodes.to_string()),
    ("calls", |time| time.calls.to_string()),
    ("median, ms", |time| label(time.median_ms)),
    ("99 %, ms", |time| label(time.p99_ms)),
];

/// The rows over all, the ratios by programme and by dataset with the bundle's frame step, and the times.
pub fn markdown(lead: &str, rows: &[Row], datasets: &[DatasetRow], times: &[Time]) -> String {
    let overall = || rows.iter().filter(|row| row.programme == ALL);
    let shown = overall().nth(WAYS.len()).map_or("", |row| row.way.as_str());
    let presented = |row: &&Row| row.programme != ALL && row.way == shown;
    let mut out = format!(
        "\n{lead}\n\n{}",
        Table::of(&[0], &OVERALL, overall()).markdown()
    );
    if let Some(row) = rows.first() {
        out += &format!(
            "\nDeepest point of the truth in a tool: {} mm. By programme, {shown}:\n\n",
            label(row.true_penetration_mm)
        );
    }
    out += &Table::of(&[0], &BY_PROGRAMME, rows.iter().filter(presented)).markdown();
    if !datasets.is_empty() {
        out += &format!("\n{}", Table::of(&[0], &BY_DATASET, datasets).markdown());
    }
    out + "\n" + &Table::of(&[0], &CALLS, times).markdown()
}

/// Rounding is no motion.
fn millimetres(value: f64) -> String {
    if value < 1e-4 {
        "0".into()
    } else {
        label(value)
    }
}

fn ratio(value: f64) -> String {
    match value {
        small if small < 0.95 => format!("1/{:.1}", 1.0 / small),
        other => format!("{other:.1}"),
    }
}

/// Error over time and a strip of frames of one case, with the bundle's step and with its frame step; their paths.
pub fn pictures(
    folder: &Path,
    bundle: &str,
    (mesh, cases, truths): (&Mesh, &ToolCases, &[Truth]),
    shown: [&[Shown]; 2],
) -> Result<Vec<PathBuf>> {
    let first = |name: &str| {
        let own = cases.list.iter().position(|c| c.programme == name);
        own.unwrap_or(0)
    };
    let (plotted, drawn) = (first(PLOTTED), first(PICTURED));
    let mut paths = Vec::new();
    for (name, text) in [
        (
            "error",
            error(shown.map(|all| &all[plotted]), &truths[plotted]),
        ),
        (
            "strip",
            strip(
                mesh,
                &cases.list[drawn],
                &truths[drawn],
                shown.map(|all| &all[drawn]),
            ),
        ),
    ] {
        let path = folder.join(format!("{bundle}-shown-{name}.svg"));
        std::fs::write(&path, text).with_context(|| format!("{}", path.display()))?;
        paths.push(path);
    }
    Ok(paths)
}

/// Root of the mean squared error of each frame, over time.
fn error([whole, short]: [&Shown; 2], truth: &Truth) -> String {
    let rms = |shown: &Shown, way: usize| -> Vec<(f64, f64)> {
        let frames = shown.frames.iter();
        frames
            .map(|frame| (frame.seconds, frame.drawn[way].mse_mm2.sqrt()))
            .collect()
    };
    let lines = [
        ("one step late", rms(whole, LATE), COLOURS[LATE]),
        ("last state", rms(whole, LAST), COLOURS[LAST]),
        (
            "present, the bundle's step",
            rms(whole, PRESENT),
            COLOURS[PRESENT],
        ),
        ("present, its frame step", rms(short, PRESENT), FRAMES),
    ];
    let points = lines.iter().flat_map(|(_, line, _)| line);
    let top = points.map(|at| at.1).fold(0.0, f64::max);
    let mut axes = Axes::new(
        860.0,
        300.0,
        Scale::linear(0.0, truth.seconds()),
        Scale::linear(0.0, top),
        "time, s",
        "RMS error of a frame, mm",
    );
    for (_, line, colour) in &lines {
        axes.line(line, colour, 1.8, false);
    }
    axes.standalone(&lines.each_ref().map(|(name, _, colour)| (*name, *colour)))
}

/// Frames one under the other for each way: the tool where it is, the true surface, and what is shown.
fn strip(mesh: &Mesh, case: &ToolCase, truth: &Truth, [whole, short]: [&Shown; 2]) -> String {
    let ways = [
        ("one step late", whole, LATE, COLOURS[LATE]),
        ("present, frame step", short, PRESENT, FRAMES),
    ];
    let (width, height, title) = (416.0, 272.0, 24.0);
    let mut body = String::new();
    for (row, (name, shown, way, colour)) in ways.into_iter().enumerate() {
        for (column, (frame, fields)) in shown.pictured.iter().enumerate() {
            let seconds = *frame as f64 / truth.parts as f64 * FRAME_S;
            let (x, y) = (column as f64 * width, row as f64 * (height + title));
            body += &format!(
                "<text x=\"{:.0}\" y=\"{:.0}\">{name}, {seconds:.2} s</text><g transform=\"translate({x:.0} {:.0})\"><svg width=\"{width}\" height=\"{height}\">{}</svg></g>",
                x + 8.0,
                y + 16.0,
                y + title,
                section::drawing(mesh, case, *frame, &fields[way], colour)
            );
        }
    }
    let (w, h) = (
        whole.pictured.len() as f64 * width,
        ways.len() as f64 * (height + title),
    );
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {w} {h}\" width=\"{w}\" height=\"{h}\">\
         <style>text{{font:13px 'DejaVu Sans',sans-serif;fill:#1d2733}}</style>\
         <rect width=\"{w}\" height=\"{h}\" fill=\"#fff\"/>{body}</svg>\n"
    )
}
