//! The table and the plot.

use std::fmt::Write;

use contact::Vector;

use super::play::Track;
use super::truth::{FRAME_S, Forces, resample};
use crate::table::{Column, Table};
use gauge::Resident;
use picture::plot::{Axes, Scale, colour};

/// Samples of a mean, ms.
const MEAN: usize = 11;
/// Memory that may grow after the first rounds, MB: the allocator's own.
const LEAK_MB: f64 = 32.0;

/// A gesture over all its rounds.
pub struct Row {
    name: &'static str,
    /// Largest force, N.
    peak: f32,
    /// Largest change of the force within a millisecond, N.
    jump: f32,
    given_j: f64,
    bare_j: f64,
    damped: usize,
    touching: usize,
    against: Option<Against>,
}

/// Against the solver, over the first round: squares summed over all samples and tools, N².
#[derive(Clone, Copy, Default)]
struct Against {
    /// Of the solver's force.
    size: f64,
    /// Of the error of the force, and of the last step's force held.
    off: f64,
    held: f64,
    /// The first of means over [`MEAN`] samples: impulses of the solver's contact left out.
    mean_off: f64,
    /// Of the solver's own force about its means.
    noise: f64,
    /// Largest change within a millisecond: rendered and the solver's, N.
    jumps: [f32; 2],
}

impl Against {
    fn join(self, other: &Against) -> Against {
        Against {
            size: self.size + other.size,
            off: self.off + other.off,
            held: self.held + other.held,
            mean_off: self.mean_off + other.mean_off,
            noise: self.noise + other.noise,
            jumps: [0, 1].map(|k| self.jumps[k].max(other.jumps[k])),
        }
    }

    fn row(&self, name: &str) -> [String; 7] {
        let percent = |square: f64| format!("{:.1} %", 100.0 * (square / self.size).sqrt());
        let [felt, real] = self.jumps;
        [
            name.into(),
            percent(self.off),
            percent(self.mean_off),
            percent(self.noise),
            percent(self.held),
            format!("{:.2} / {:.2}", 1e3 * felt, 1e3 * real),
            format!("{:.2}", felt / real),
        ]
    }
}

/// All gestures together.
#[derive(Default)]
pub struct Account {
    calls: Calls,
    seconds: f64,
    /// Memory after the second round, and how much more there is now, MB.
    settled: Option<Resident>,
    growth_mb: f64,
    given_j: f64,
    not_finite: usize,
    stuck: usize,
}

/// Times of calls in classes of 2 %: a day of them is not kept one by one.
#[derive(Default)]
struct Calls {
    classes: Vec<u64>,
    count: u64,
    missed: u64,
    largest: f64,
}

impl Calls {
    const STEP: f64 = 1.02;

    fn add(&mut self, us: f64) {
        let class = (us.max(1e-3) / 1e-3).log(Self::STEP) as usize;
        if class >= self.classes.len() {
            self.classes.resize(class + 1, 0);
        }
        self.classes[class] += 1;
        self.count += 1;
        self.missed += u64::from(us > 1000.0);
        self.largest = self.largest.max(us);
    }

    /// µs.
    fn quantile(&self, part: f64) -> f64 {
        let mut left = (part * self.count as f64) as u64;
        for (class, count) in self.classes.iter().enumerate() {
            if left < *count {
                return 1e-3 * Self::STEP.powf(class as f64 + 0.5);
            }
            left -= count;
        }
        self.largest
    }
}

impl Account {
    pub fn add(&mut self, track: &Track) {
        for &us in &track.calls_us {
            self.calls.add(us);
        }
        self.seconds += track.ticks.last().map_or(0.0, |tick| tick.time_s);
        self.given_j += track.given_j;
        self.not_finite += track.not_finite;
        self.stuck += usize::from(track.stuck);
    }

    /// All gestures have been played once more.
    pub fn end_round(&mut self, round: u64) {
        // The first rounds fill buffers that stay.
        match (&self.settled, round) {
            (None, 1..) => self.settled = Some(Resident::now()),
            (Some(settled), _) => self.growth_mb = settled.growth_mb(),
            _ => {}
        }
    }

    /// A force that is no number, or that stays, or memory that is not given back.
    pub fn is_bad(&self) -> bool {
        self.not_finite + self.stuck > 0 || self.growth_mb > LEAK_MB
    }
}

/// Force of a tool by millisecond.
fn forces(track: &Track, tool: usize, count: usize) -> Vec<Vector> {
    let at = |k: usize| resample(track, k as f64 * FRAME_S, |tick| tick.tools[tool].1);
    (0..count).map(at).collect()
}

/// Each sample's mean with its neighbours.
fn means(forces: &[Vector]) -> Vec<Vector> {
    let half = MEAN / 2;
    let at = |k: usize| {
        let near = &forces[k.saturating_sub(half)..(k + half + 1).min(forces.len())];
        near.iter().sum::<Vector>() / near.len() as f32
    };
    (0..forces.len()).map(at).collect()
}

fn largest_change(forces: &[Vector]) -> f32 {
    let pairs = forces.windows(2);
    pairs
        .map(|pair| (pair[1] - pair[0]).length())
        .fold(0.0, f32::max)
}

impl Row {
    pub fn new(name: &'static str) -> Row {
        Row {
            name,
            peak: 0.0,
            jump: 0.0,
            given_j: 0.0,
            bare_j: 0.0,
            damped: 0,
            touching: 0,
            against: None,
        }
    }

    pub fn add(&mut self, track: &Track) {
        let last = track.ticks.last().map_or(0.0, |tick| tick.time_s);
        let count = (last / FRAME_S) as usize;
        for tool in 0..track.ticks.first().map_or(0, |tick| tick.tools.len()) {
            let forces = forces(track, tool, count);
            self.jump = self.jump.max(largest_change(&forces));
            let sizes = forces.iter().map(|force| force.length());
            self.peak = sizes.fold(self.peak, f32::max);
        }
        self.given_j += track.given_j;
        self.damped += track.damped;
        self.touching += track.touching;
    }

    /// The same gesture without the controller.
    pub fn add_bare(&mut self, track: &Track) {
        self.bare_j += track.given_j;
    }

    /// Compares with the solver.
    pub fn compare(&mut self, track: &Track, truth: &Forces) {
        let square = |v: Vector| f64::from(v.length_squared());
        let mut sums = Against::default();
        for tool in 0..truth[0].len() {
            let felt = forces(track, tool, truth.len());
            let real: Vec<Vector> = truth.iter().map(|frame| frame[tool]).collect();
            for (k, (felt, real)) in felt.iter().zip(&real).enumerate() {
                let told = resample(track, k as f64 * FRAME_S, |tick| tick.tools[tool].2);
                sums.off += square(*felt - *real);
                sums.held += square(told - *real);
                sums.size += square(*real);
            }
            let means = [means(&felt), means(&real)];
            for ((felt, mean), real) in means[0].iter().zip(&means[1]).zip(&real) {
                sums.mean_off += square(*felt - *mean);
                sums.noise += square(*real - *mean);
            }
            sums.jumps[0] = sums.jumps[0].max(largest_change(&felt));
            sums.jumps[1] = sums.jumps[1].max(largest_change(&real));
        }
        self.against = Some(sums);
    }
}

fn simulated(seconds: f64) -> String {
    match seconds {
        0.0..7200.0 => format!("{:.1} minutes", seconds / 60.0),
        _ => format!("{:.1} hours", seconds / 3600.0),
    }
}

const COLUMNS: [Column<Row>; 6] = [
    ("gesture", |row| row.name.into()),
    ("largest force, mN", |row| format!("{:.0}", 1e3 * row.peak)),
    ("largest change in 1 ms, mN", |row| {
        format!("{:.2}", 1e3 * row.jump)
    }),
    ("energy given, µJ", |row| {
        format!("{:.3}", 1e6 * row.given_j)
    }),
    ("without the controller (first round), µJ", |row| {
        format!("{:.3}", 1e6 * row.bare_j)
    }),
    ("damped, part of touching", |row| {
        let damped = row.damped as f64 / row.touching.max(1) as f64;
        format!("{:.1} %", 100.0 * damped)
    }),
];

/// The tables as Markdown.
pub fn markdown(rows: &[Row], account: &Account, compared: bool) -> String {
    let mut text = Table::of(&[0], &COLUMNS, rows).markdown();
    if compared {
        let mut table = Table::new(
            &[0],
            "against the solver; force error, relative L2; of means over 11 ms; the solver's own noise about those; \
             the last step's force held; largest change in 1 ms: rendered / solver, mN; ratio",
        );
        let mut all = Against::default();
        for row in rows {
            if let Some(against) = &row.against {
                table.push(against.row(row.name));
                all = all.join(against);
            }
        }
        table.push(all.row("all gestures together"));
        text += &format!("\n{}", table.markdown());
    }
    let calls = &account.calls;
    let _ = write!(
        text,
        "\n{} calls: p50 {:.0} µs, p99 {:.0} µs, p99.9 {:.0} µs, largest {:.0} µs; {} took longer than 1 ms. Simulated: {}. Energy given in all: {:.4} mJ. \
         Forces that are no numbers: {}. Gestures that end with a force: {}. Memory grew by {:.1} MB.\n",
        calls.count,
        calls.quantile(0.5),
        calls.quantile(0.99),
        calls.quantile(0.999),
        calls.largest,
        calls.missed,
        simulated(account.seconds),
        1e3 * account.given_j,
        account.not_finite,
        account.stuck,
        account.growth_mb
    );
    text
}

/// Force on the first tool over time at 1 kHz: rendered, the solver's, and the last step's held.
pub fn plot(track: &Track, truth: &Forces) -> String {
    let time = |k: usize| k as f64 * FRAME_S;
    let line = |of: &dyn Fn(usize) -> Vector| -> Vec<(f64, f64)> {
        let size = |k: usize| (time(k), 1e3 * f64::from(of(k).length()));
        (0..truth.len()).map(size).collect()
    };
    let felt = line(&|k| resample(track, time(k), |tick| tick.tools[0].1));
    let told = line(&|k| resample(track, time(k), |tick| tick.tools[0].2));
    let real = line(&|k| truth[k][0]);
    let all = felt.iter().chain(&told).chain(&real);
    let most = all.map(|point| point.1).fold(0.0, f64::max);
    let mut axes = Axes::new(
        900.0,
        360.0,
        Scale::linear(0.0, time(truth.len())),
        Scale::linear(0.0, most),
        "time, s",
        "force on the tool, mN",
    );
    axes.line(&told, "#b9c1c9", 1.0, false);
    axes.line(&real, colour(1), 2.0, false);
    axes.line(&felt, colour(0), 1.2, false);
    axes.standalone(&[
        ("rendered at 1 kHz", colour(0)),
        ("reference solver", colour(1)),
        ("last step's force", "#b9c1c9"),
    ])
}

#[cfg(test)]
mod tests {
    use super::super::play::Tick;
    use super::*;

    fn track(force: impl Fn(f64) -> f32) -> Track {
        let tick = |k: usize| {
            let time_s = 1.1e-3 * k as f64;
            let felt = Vector::new(0.0, force(time_s), 0.0);
            Tick {
                time_s,
                tools: vec![(Vector::ZERO, felt, Vector::ZERO)],
            }
        };
        Track {
            ticks: (0..100).map(tick).collect(),
            calls_us: vec![10.0; 100],
            ..Track::default()
        }
    }

    #[test]
    fn a_force_that_is_a_tenth_too_large_is_ten_per_cent_off() {
        let truth: Forces = (0..100)
            .map(|k| vec![Vector::new(0.0, 1e-3 * k as f32, 0.0)])
            .collect();
        let mut row = Row::new("ramp");
        row.compare(&track(|t| 1.1 * t as f32), &truth);
        let against = row.against.as_ref().unwrap();
        let error = (against.off / against.size).sqrt();
        assert!((error - 0.1).abs() < 1e-3, "{error}");
        assert!((against.jumps[0] / against.jumps[1] - 1.1).abs() < 1e-2);
        let mut account = Account::default();
        account.add(&track(|t| t as f32));
        let mut again = Row::new("again");
        again.against = row.against;
        let text = markdown(&[row, again], &account, true);
        assert!(text.contains("| ramp | 10.0 % |"), "{text}");
        // Twice the same gesture is as far off as one of them.
        assert!(
            text.contains("| all gestures together | 10.0 % |"),
            "{text}"
        );
        assert!(!account.is_bad());
    }
}
