//! Medians of rivals that take turns in one run, and the rows that `cargo xtask bench` collects.
//!
//! `UPT_BENCH_QUICK=1` asks for short runs; `cargo bench --bench kernels -- decoder` for the groups with that name.

// Each bench target uses a part of this module.
#![allow(dead_code)]

pub mod machine;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde::Serialize;

/// Whether a short run is asked for.
pub fn quick() -> bool {
    std::env::var_os("UPT_BENCH_QUICK").is_some()
}

/// The time of one row's measurement, after which a slow one stops with fewer samples.
pub fn budget() -> Duration {
    Duration::from_secs_f64(if quick() { 1.5 } else { 15.0 })
}

/// Whether the command line asks for this group: no name at all, or a part of the group's.
pub fn wanted(group: &str) -> bool {
    std::env::args()
        .skip(1)
        .find(|argument| !argument.starts_with('-'))
        .is_none_or(|part| group.contains(&part))
}

/// Median seconds a call of each rival. They take turns, so that a slow phase of the machine meets all of them; a turn
/// is as many calls as fill some milliseconds.
pub fn medians(rivals: &mut [Box<dyn FnMut() + '_>]) -> Vec<f64> {
    let (turn, turns) = if quick() {
        (Duration::from_millis(1), 9)
    } else {
        (Duration::from_millis(5), 41)
    };
    let timed = |rival: &mut Box<dyn FnMut() + '_>, calls: usize| {
        let start = Instant::now();
        for _ in 0..calls {
            rival();
        }
        start.elapsed().as_secs_f64() / calls as f64
    };
    let calls: Vec<usize> = rivals
        .iter_mut()
        .map(|rival| {
            rival();
            let once = timed(rival, 1).max(1e-9);
            ((turn.as_secs_f64() / once) as usize).clamp(1, 100_000)
        })
        .collect();
    let mut times = vec![Vec::with_capacity(turns); rivals.len()];
    let started = Instant::now();
    for turn in 0..turns {
        if turn >= 5 && started.elapsed() > budget() {
            break;
        }
        for ((rival, times), &calls) in rivals.iter_mut().zip(&mut times).zip(&calls) {
            times.push(timed(rival, calls));
        }
    }
    times.into_iter().map(gauge::median).collect()
}

/// Largest difference, relative to the largest of `want`.
pub fn relative_error(got: &[f32], want: &[f32]) -> f64 {
    assert_eq!(got.len(), want.len(), "rivals' outputs differ in length");
    let largest = want.iter().fold(0.0f64, |a, &x| a.max(f64::from(x).abs()));
    let difference = got
        .iter()
        .zip(want)
        .map(|(&a, &b)| (f64::from(a) - f64::from(b)).abs())
        .fold(0.0, f64::max);
    difference / largest
}

/// Root mean square of the difference, relative to that of `want`: relative L2.
pub fn relative_l2(got: &[f32], want: &[f32]) -> f64 {
    assert_eq!(got.len(), want.len(), "rivals' outputs differ in length");
    let square = |value: f64| value * value;
    let (difference, size) = got.iter().zip(want).fold((0.0, 0.0), |(d, s), (&a, &b)| {
        (
            d + square(f64::from(a) - f64::from(b)),
            s + square(f64::from(b)),
        )
    });
    (difference / size).sqrt()
}

/// A line of the speed tables.
#[derive(Serialize)]
pub struct Row {
    name: String,
    value: f64,
    unit: &'static str,
    against: Option<String>,
    ratio: Option<f64>,
    error: Option<f64>,
    bar: Option<f64>,
    goal: Option<f64>,
}

impl Row {
    pub fn new(name: impl Into<String>, value: f64, unit: &'static str) -> Row {
        Row {
            name: name.into(),
            value,
            unit,
            against: None,
            ratio: None,
            error: None,
            bar: None,
            goal: None,
        }
    }

    /// How many times faster than `rival`.
    pub fn against(self, rival: impl Into<String>, ratio: f64) -> Row {
        Row {
            against: Some(rival.into()),
            ratio: Some(ratio),
            ..self
        }
    }

    /// Relative difference from the plain float32 path.
    pub fn error(self, error: f64) -> Row {
        Row {
            error: Some(error),
            ..self
        }
    }

    /// Upper limits of the value; lower limits where the unit is `times`.
    pub fn limits(self, bar: Option<f64>, goal: Option<f64>) -> Row {
        Row { bar, goal, ..self }
    }

    pub fn print(&self) {
        println!("ROW {}", serde_json::to_string(self).expect("plain values"));
    }
}

/// Tells the library where ONNX Runtime is: `ORT_DYLIB_PATH`, or what `cargo xtask ort` has fetched.
pub fn init_library() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let fetched = root.join("target/ort").join("libonnxruntime.so");
    let path = std::env::var_os("ORT_DYLIB_PATH")
        .map(PathBuf::from)
        .or_else(|| fetched.exists().then_some(fetched));
    upt::init(&upt::InitOptions {
        threads: 0,
        onnxruntime_path: path,
    })
    .expect("first call");
}

/// The bundles in `onnx/` and in the folders that `UPT_BENCH_BUNDLES` and `UPT_LARGE_BUNDLES` name.
pub fn bundles() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folders = [
        Some(root.join("onnx")),
        std::env::var_os("UPT_BENCH_BUNDLES").map(PathBuf::from),
        std::env::var_os("UPT_LARGE_BUNDLES").map(PathBuf::from),
    ];
    let mut bundles: Vec<PathBuf> = folders
        .iter()
        .flatten()
        .filter_map(|folder| std::fs::read_dir(folder).ok())
        .flat_map(|entries| entries.flatten().map(|entry| entry.path()))
        .filter(|path| path.join("bundle.json").exists())
        .collect();
    bundles.sort();
    bundles
}
