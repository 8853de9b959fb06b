//! Steps of a scene that is being pushed: median, tail, and the part outside kernels and sessions.

use std::time::{Duration, Instant};

use gauge::{Sorted, median};
use upt::Scene;

use super::bare::BareLoop;
use super::cost::Cost;
use super::measure::{Row, budget, quick};
use super::tail::Tail;
use super::windows::Steady;
use super::{patch, pushed};
use upt::{Contact, Kind};

/// Steps of a row, where the time suffices for them.
fn steps(kind: Kind) -> usize {
    match (quick(), kind) {
        (true, Kind::Upt) => 15,
        (true, Kind::Reduced) => 1_000,
        (false, _) => 10_000,
    }
}

/// Time for a row's steps: of a bundle that ships all are taken.
fn time(scene: &Scene) -> Duration {
    match super::ships(scene.model()) && !quick() {
        true => Duration::from_secs(200),
        false => budget(),
    }
}

/// Prints the rows of a scene that shows `region`; the median step, ms.
pub fn measure(
    scene: &Scene,
    region: Option<&[u32]>,
    cost: &Cost,
    name: &str,
    (bar, goal): (Option<f64>, Option<f64>),
) -> upt::Result<f64> {
    const WARM_UP: usize = 5;
    const LEAST: usize = 9;
    let nodes = patch(scene.mesh(), 300);
    let vectors: Vec<Vec<f32>> = (0..7).map(|t| pushed(&nodes, t)).collect();
    let mut out = vec![0.0; 3 * scene.region_count()];
    let (mut times, mut outside, mut bare) = (Vec::new(), Vec::new(), Vec::new());
    let mut idle: Option<BareLoop<'_>> = None;
    let mut slow = Tail::default();
    let started = Instant::now();
    for t in 0..steps(scene.model().info().kind) + WARM_UP {
        if times.len() >= LEAST && started.elapsed() > time(scene) {
            break;
        }
        let contact = Contact::Sparse {
            nodes: &nodes,
            vectors: &vectors[t % 7],
        };
        let start = Instant::now();
        scene.step(contact, Some(&mut out))?;
        let ms = start.elapsed().as_secs_f64() * 1e3;
        if t >= WARM_UP {
            times.push(ms);
            let s = scene.timing();
            // The guard's pass over the field is a kernel too.
            let work =
                s.prior_ms + s.encode_ms + s.aggregate_ms + s.latent_ms + s.decode_ms + s.guard_ms;
            outside.push(100.0 * (ms - work) / ms);
            slow.push(ms, &s);
            let table = scene.model().prior.as_ref();
            let table = table.filter(|_| scene.model().info().kind == Kind::Reduced);
            let idle = idle.get_or_insert_with(|| match (table, cost.of_step(scene, region)) {
                (Some(table), Some([_, bytes])) => BareLoop::over_tables(table, bytes),
                _ => BareLoop::product(ms, scene.stats().threads as usize),
            });
            bare.push(idle.run());
        }
    }
    let steady = Steady::of(&times, &bare);
    let over_median = |values: &Sorted| values.quantile(0.99) / values.median();
    let (times, bare) = (Sorted::of(times), Sorted::of(bare));
    let middle = times.median();
    let rival = idle.as_ref().map_or("", |bare| bare.name());
    Row::new(format!("{name}/step"), middle, "ms")
        .limits(bar, goal)
        .print();
    Row::new(format!("{name}/p99 over median"), over_median(&times), "")
        .limits(Some(1.5), Some(1.2))
        .print();
    Row::new(
        format!("{name}/p99 over median, {rival}"),
        over_median(&bare),
        "",
    )
    .print();
    if let Some(ratio) = steady.p99 {
        let name = format!("{name}/p99 over median while that loop was steady");
        Row::new(name, ratio, "")
            .limits(Some(1.5), Some(1.2))
            .print();
    }
    println!(
        "{name}: {} steps; the loop was steady in {} of {} windows",
        times.len(),
        steady.counted,
        steady.windows
    );
    Row::new(
        format!("{name}/outside kernels and sessions"),
        median(&outside),
        "%",
    )
    .limits(Some(5.0), Some(2.0))
    .print();
    println!("{name}: {}", slow.text());
    let (s, stats) = (scene.timing(), scene.stats());
    println!(
        "{name}: check {:.3} prior {:.3} encode {:.3} aggregate {:.3} latent {:.3} decode {:.3} guard {:.3} ms, {} nodes, {} in contact, {:.1} MB",
        s.check_ms,
        s.prior_ms,
        s.encode_ms,
        s.aggregate_ms,
        s.latent_ms,
        s.decode_ms,
        s.guard_ms,
        stats.decoded_node_count,
        stats.contact_count,
        stats.memory_bytes as f64 / 1e6
    );
    Ok(middle)
}
