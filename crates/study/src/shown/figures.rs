//! Rows of what was shown: a way of drawing frames over the cases of a programme, or over all.

use gauge::median;
use serde::Serialize;

use super::host::{LATE, PRESENT, Shown, WAYS};
use yardstick::cases::ToolCase;

/// Programme of the row over all.
pub const ALL: &str = "all";

/// One case in one way.
#[derive(Clone, Debug, Serialize)]
pub struct WayFigures {
    pub way: String,
    /// Over the frames without those of slip-offs.
    pub mse_mm2: f64,
    /// Of the steps that are shown, at their own moments.
    pub step_mse_mm2: f64,
    pub worst_frame_mm2: f64,
    pub penetration_mm: f64,
    pub jump_mm: f64,
    pub unlike_mm: f64,
    pub latency_ms: f64,
}

/// One case.
#[derive(Clone, Debug, Serialize)]
pub struct CaseFigures {
    pub case: String,
    pub programme: String,
    pub dataset: String,
    pub frames: usize,
    pub true_penetration_mm: f64,
    /// In the order of the ways.
    pub ways: Vec<WayFigures>,
}

/// A dataset's row: what a host shows over what it showed before, medians over the cases.
#[derive(Clone, Debug, Serialize)]
pub struct DatasetRow {
    pub dataset: String,
    pub cases: usize,
    pub over_late: f64,
    pub over_step: f64,
}

/// A row of the table.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    pub way: String,
    pub programme: String,
    pub cases: usize,
    /// Medians over the cases.
    pub mse_mm2: f64,
    pub step_mse_mm2: f64,
    pub over_late: f64,
    pub over_step: f64,
    pub latency_ms: f64,
    /// Median and worst of the cases' largest.
    pub jump_median_mm: f64,
    pub jump_mm: f64,
    pub unlike_median_mm: f64,
    pub unlike_mm: f64,
    pub penetration_median_mm: f64,
    pub penetration_mm: f64,
    /// The truth's own, worst.
    pub true_penetration_mm: f64,
}

impl CaseFigures {
    pub fn of(case: &ToolCase, shown: &Shown) -> Self {
        let counted = || shown.frames.iter().filter(|frame| !frame.slips);
        let count = counted().count().max(1) as f64;
        let steps = shown.step_mse_mm2.len().max(1) as f64;
        let step_mse_mm2 = shown.step_mse_mm2.iter().sum::<f64>() / steps;
        let ways = (0..WAYS.len()).map(|way| {
            let largest = |value: fn(&super::host::Drawn) -> f64| {
                counted().map(|f| value(&f.drawn[way])).fold(0.0, f64::max)
            };
            WayFigures {
                way: WAYS[way].into(),
                mse_mm2: counted().map(|f| f.drawn[way].mse_mm2).sum::<f64>() / count,
                step_mse_mm2,
                worst_frame_mm2: largest(|d| d.mse_mm2),
                penetration_mm: largest(|d| d.penetration_mm),
                jump_mm: largest(|d| d.jump_mm),
                unlike_mm: largest(|d| d.unlike_mm),
                latency_ms: shown.latency_ms[way],
            }
        });
        Self {
            case: case.name.clone(),
            programme: case.programme.clone(),
            dataset: case.dataset.clone(),
            frames: shown.frames.len(),
            true_penetration_mm: counted().map(|f| f.true_penetration_mm).fold(0.0, f64::max),
            ways: ways.collect(),
        }
    }

    /// The presented frames of the same case by a scene with steps of another length.
    pub fn add(&mut self, case: &ToolCase, shown: &Shown, length: &str) {
        let mut own = Self::of(case, shown).ways.swap_remove(PRESENT);
        own.way = format!("{}, {length}", WAYS[PRESENT]);
        self.ways.push(own);
    }
}

/// Of those that are numbers.
fn finite_median(values: impl Iterator<Item = f64>) -> f64 {
    median(values.filter(|v| v.is_finite()))
}

fn row(way: usize, programme: &str, cases: &[&CaseFigures]) -> Row {
    let each = |value: fn(&WayFigures) -> f64| cases.iter().map(move |case| value(&case.ways[way]));
    let mse = |way: usize| move |case: &&CaseFigures| case.ways[way].mse_mm2;
    let own = mse(way);
    let over = |other: &dyn Fn(&&CaseFigures) -> f64| {
        finite_median(cases.iter().map(|c| own(c) / other(c)))
    };
    Row {
        way: cases[0].ways[way].way.clone(),
        programme: programme.into(),
        cases: cases.len(),
        mse_mm2: finite_median(each(|w| w.mse_mm2)),
        over_late: over(&mse(LATE)),
        step_mse_mm2: finite_median(each(|w| w.step_mse_mm2)),
        over_step: over(&|case| case.ways[way].step_mse_mm2),
        latency_ms: finite_median(each(|w| w.latency_ms)),
        jump_median_mm: finite_median(each(|w| w.jump_mm)),
        jump_mm: each(|w| w.jump_mm).fold(0.0, f64::max),
        unlike_median_mm: finite_median(each(|w| w.unlike_mm)),
        unlike_mm: each(|w| w.unlike_mm).fold(0.0, f64::max),
        penetration_median_mm: finite_median(each(|w| w.penetration_mm)),
        penetration_mm: each(|w| w.penetration_mm).fold(0.0, f64::max),
        true_penetration_mm: cases
            .iter()
            .map(|case| case.true_penetration_mm)
            .fold(0.0, f64::max),
    }
}

/// One way by dataset, where there are more than one.
pub fn by_dataset(figures: &[CaseFigures], way: usize) -> Vec<DatasetRow> {
    let mut names: Vec<&str> = figures.iter().map(|case| case.dataset.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    if names.len() < 2 {
        return Vec::new();
    }
    let rows = names.into_iter().map(|name| {
        let own: Vec<&CaseFigures> = figures.iter().filter(|case| case.dataset == name).collect();
        let all = row(way, ALL, &own);
        DatasetRow {
            dataset: name.into(),
            cases: all.cases,
            over_late: all.over_late,
            over_step: all.over_step,
        }
    });
    rows.collect()
}

/// The ways over all cases, then over those of each programme.
pub fn rows(figures: &[CaseFigures]) -> Vec<Row> {
    let mut programmes: Vec<&str> = Vec::new();
    for case in figures {
        if !programmes.contains(&case.programme.as_str()) {
            programmes.push(&case.programme);
        }
    }
    let all: Vec<&CaseFigures> = figures.iter().collect();
    let Some(first) = figures.first() else {
        return Vec::new();
    };
    let ways = 0..first.ways.len();
    let mut rows: Vec<Row> = ways.clone().map(|way| row(way, ALL, &all)).collect();
    for programme in programmes {
        let own: Vec<&CaseFigures> = all
            .iter()
            .copied()
            .filter(|case| case.programme == programme)
            .collect();
        rows.extend(ways.clone().map(|way| row(way, programme, &own)));
    }
    rows
}
