//! Running one method through all cases: errors, times, stages, and the frames that pictures show.

use std::time::Instant;

use anyhow::Result;
use tissue::mesh::Mesh;

use super::cases::Cases;
use super::method::{Method, Stepper};
use super::row::{Measurement, PRIOR_ALONE, Pictured, Row, mean_and_deviation};
use gauge::{Resident, Sorted};
use yardstick::errors::{CaseErrors, StepErrors, step_errors};

/// What a measurement is asked to do.
pub struct Plan<'a> {
    pub mesh: &'a Mesh,
    pub cases: &'a Cases,
    /// Cases and steps (1-based frames) whose displacement is kept for pictures.
    pub pictured: &'a [(usize, usize)],
    /// Steps of each case at most; the reference solver needs only a few to be timed.
    pub step_limit: usize,
    /// Cases at most.
    pub case_limit: usize,
    pub hausdorff: bool,
}

/// Measures one method. `reference` holds the float32 path's frames of the first case, when this is
/// a fast path whose deviation is asked for; `keep` receives this method's own frames of that case.
pub fn measure(
    method: &Method,
    plan: &Plan<'_>,
    reference: Option<&[Vec<[f32; 3]>]>,
    keep: &mut Option<Vec<Vec<[f32; 3]>>>,
    progress: &dyn Fn(usize, usize),
) -> Result<Measurement> {
    let header = &plan.cases.list[0].trajectory.header;
    let resident = Resident::now();
    let started = Instant::now();
    let mut stepper = Stepper::new(method, plan.mesh, header)?;
    let load_s = started.elapsed().as_secs_f64();

    let count = plan.mesh.node_count();
    let mut field = vec![[0.0f32; 3]; count];
    let mut cases: Vec<CaseErrors> = Vec::new();
    let mut latencies = Vec::new();
    let mut first_step_ms = 0.0;
    let mut stages: Vec<(&'static str, f64)> = Vec::new();
    let mut pictured = Vec::new();
    let mut deviation = 0.0f64;
    for (index, case) in plan.cases.list.iter().take(plan.case_limit).enumerate() {
        stepper.reset()?;
        let trajectory = &case.trajectory;
        let mut steps: Vec<StepErrors> = Vec::new();
        for frame in 1..trajectory
            .frame_count()
            .min(plan.step_limit.saturating_add(1))
        {
            let (nodes, vectors) = trajectory.contact(frame);
            let elapsed = stepper.step(nodes, vectors, &mut field)?;
            if index == 0 && frame == 1 {
                first_step_ms = elapsed;
            } else {
                latencies.push(elapsed);
            }
            for (at, (name, ms)) in stepper.stages()?.into_iter().enumerate() {
                if stages.len() <= at {
                    stages.push((name, 0.0));
                }
                stages[at].1 += ms;
            }
            steps.push(step_errors(
                &plan.mesh.positions,
                trajectory.frame(frame),
                &field,
                header_site(trajectory),
                plan.hausdorff,
            ));
            if plan.pictured.contains(&(index, frame)) {
                pictured.push(Pictured {
                    case: index,
                    step: frame,
                    displacement: field.clone(),
                });
            }
            if index == 0 {
                if let Some(truth) = reference.and_then(|frames| frames.get(frame - 1)) {
                    deviation = deviation.max(largest_difference(truth, &field));
                }
                if let Some(frames) = keep {
                    frames.push(field.clone());
                }
            }
            progress(index, frame);
        }
        cases.push(CaseErrors::over(steps));
    }
    let timed = (latencies.len() + 1) as f64;
    let mut row = describe(method, plan.mesh);
    row.boundary = header.boundary.clone();
    row.cases = cases.len() as u64;
    row.decoded = match &stepper {
        Stepper::Surrogate(surrogate) => surrogate.decoded() as u64,
        _ => count as u64,
    };
    row.load_s = load_s;
    row.first_step_ms = first_step_ms;
    row.memory_mb = match stepper.memory_mb()? {
        Some(told) => told,
        None => resident.growth_mb(),
    };
    let is_surrogate = matches!(method, Method::Surrogate { .. });
    row.deviation = is_surrogate.then_some(if reference.is_some() { deviation } else { 0.0 });
    fill_errors(&mut row, &cases);
    fill_times(&mut row, &latencies);
    Ok(Measurement {
        row,
        curve: curve(&cases),
        latencies: thinned(latencies),
        stages: stages
            .into_iter()
            .map(|(name, sum)| (name.to_owned(), sum / timed))
            .collect(),
        pictured,
    })
}

fn header_site(trajectory: &tissue::trajectory::Trajectory) -> [f64; 3] {
    trajectory.header.site
}

/// The row's description of the method; figures are filled in later.
pub fn describe(method: &Method, mesh: &Mesh) -> Row {
    let mut row = Row {
        provider: "cpu".into(),
        precision: "f32".into(),
        region: "all".into(),
        nodes: mesh.node_count() as u64,
        ..Row::default()
    };
    let named = |row: &mut Row, bundle: &yardstick::bundle_folder::BundleFolder| {
        row.bundle = bundle.name.clone();
        row.bundle_sha256 = bundle.sha256.clone();
    };
    match method {
        Method::Surrogate {
            bundle,
            provider,
            precision,
            region,
            threads,
            corrections,
        } => {
            row.method = "surrogate".into();
            named(&mut row, bundle);
            row.provider = provider.name().into();
            row.precision = precision.name().into();
            row.region = region.name().into();
            row.corrections = *corrections;
            row.threads = *threads;
        }
        Method::PaperSplit { bundle, threads } => {
            row.method = "paper split in ONNX Runtime".into();
            named(&mut row, bundle);
            row.threads = *threads;
        }
        Method::Prior {
            bundle, threads, ..
        } => {
            row.method = PRIOR_ALONE.into();
            named(&mut row, bundle);
            row.threads = *threads;
        }
        Method::Zero => {
            row.method = "predict zero".into();
            row.threads = 1;
        }
        #[cfg(feature = "linear")]
        Method::Linear { threads, .. } => {
            row.method = "linear elastic".into();
            row.threads = *threads;
        }
        Method::CoarseTled { threads, .. } => {
            row.method = "coarse TLED".into();
            row.threads = *threads;
        }
        Method::Tled { threads } => {
            row.method = "TLED".into();
            row.threads = *threads;
        }
    }
    row
}

fn fill_errors(row: &mut Row, cases: &[CaseErrors]) {
    let over = |value: fn(&StepErrors) -> f64| {
        let values: Vec<f64> = cases.iter().map(|case| value(&case.overall)).collect();
        mean_and_deviation(&values)
    };
    (row.mse_mm2, row.mse_std) = over(|errors| errors.mse_mm2);
    (row.relative_l2, _) = over(|errors| errors.relative_l2);
    let (mean, deviation) = over(|errors| errors.hausdorff_mm);
    row.hausdorff_mm = mean.is_finite().then_some(mean);
    row.hausdorff_std = deviation.is_finite().then_some(deviation);
    (row.max_mm, row.max_std) = over(|errors| errors.max_mm);
}

fn fill_times(row: &mut Row, latencies: &[f64]) {
    let sorted = Sorted::of(latencies);
    row.ms_p50 = sorted.median();
    row.ms_p95 = sorted.quantile(0.95);
    row.ms_p99 = sorted.quantile(0.99);
    row.ms_max = sorted.largest();
}

/// Smallest, mean and largest MSE over the cases at each step.
fn curve(cases: &[CaseErrors]) -> Vec<[f64; 3]> {
    let longest = cases.iter().map(|case| case.steps.len()).max().unwrap_or(0);
    (0..longest)
        .map(|step| {
            let values: Vec<f64> = cases
                .iter()
                .filter_map(|case| case.steps.get(step))
                .map(|errors| errors.mse_mm2)
                .collect();
            let low = values.iter().copied().fold(f64::INFINITY, f64::min);
            let high = values.iter().copied().fold(0.0, f64::max);
            [low, values.iter().sum::<f64>() / values.len() as f64, high]
        })
        .collect()
}

/// At most 4,000 values, evenly taken, so that a stored row stays small.
fn thinned(values: Vec<f64>) -> Vec<f64> {
    let stride = values.len().div_ceil(4000).max(1);
    values.into_iter().step_by(stride).collect()
}

fn largest_difference(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    a.as_flattened()
        .iter()
        .zip(b.as_flattened())
        .map(|(a, b)| f64::from((a - b).abs()))
        .fold(0.0, f64::max)
}
