//! Tools that are in the tissue at once: balls that leap into it, balls that begin in it, and three tools at random deep poses, with the
//! time that their worst step takes.

use anyhow::Result;
use contact::{Pose, Rotation, Shape, Vector};
use tissue::schemes::SplitMix;
use tissue::solver::{Tool, ToolPose};
use upt::flag;

use super::hand::{Site, any, at, between, moved, sites, tool};
use super::run::Hands;
use crate::stress::Row;

/// Places of a leap or of a ball that begins in the tissue.
const PLACES: usize = 100;
/// What is deeper after a step is told, mm.
const MOST_MM: f64 = 1.0;
/// Steps that a ball stays after it.
const HELD: usize = 4;
/// Steps of three deep tools.
const DEEP_STEPS: usize = 1000;

pub(super) fn rows(hands: &mut Hands) -> Result<Vec<Row>> {
    Ok(vec![leaps(hands)?, buried(hands)?, deep(hands)?])
}

/// What a ball met at all its places.
#[derive(Default)]
struct Met {
    places: usize,
    /// With contact in each of the steps that are looked at, and with contact or a flag.
    found: usize,
    told: usize,
    /// At the end deeper than [`MOST_MM`], and those of them without a flag.
    deep: usize,
    silent: usize,
    worst_mm: f64,
    error: Option<String>,
}

impl Met {
    /// The ball goes through poses; in the steps `told_in` it must be told of.
    fn place(
        &mut self,
        hands: &mut Hands,
        ball: &Tool,
        poses: &[ToolPose],
        told_in: std::ops::Range<usize>,
    ) -> Result<()> {
        hands.driver.reset()?;
        hands.driver.take(std::slice::from_ref(ball))?;
        self.places += 1;
        let body = [contact::Body::new(&ball.shape)?];
        let (mut found, mut told, mut depth, mut flags) = (true, true, 0.0, 0);
        for (step, pose) in poses.iter().enumerate() {
            let made = match hands.driver.step(&[*pose], &mut hands.field) {
                Ok(made) => made,
                Err(error) => {
                    self.error = Some(format!("{error:#}"));
                    return Ok(());
                }
            };
            let touches = made.felt.iter().any(|felt| felt.contacts > 0);
            if told_in.contains(&step) {
                found &= touches;
                told &= touches || made.flags & flag::DEEP != 0;
            }
            flags = made.flags;
            depth = hands.yard.penetration(&hands.field, &body, &[pose.pose]);
        }
        self.found += usize::from(found);
        self.told += usize::from(told);
        self.deep += usize::from(depth > MOST_MM);
        self.silent += usize::from(depth > MOST_MM && flags & flag::DEEP == 0);
        self.worst_mm = self.worst_mm.max(depth);
        Ok(())
    }

    fn row(self, hands: &Hands, name: &str) -> Row {
        let mut text = format!(
            "{} places: contact in {}, contact or a flag in {}; at the end deeper than {MOST_MM} mm in {} ({} without a flag), {:.2} mm at most",
            self.places, self.found, self.told, self.deep, self.silent, self.worst_mm
        );
        if let Some(error) = &self.error {
            text += &format!("; error: {error}");
        }
        let good = self.error.is_none() && self.told == self.places && self.silent == 0;
        Row::new(&hands.bench.subject, name, text, good)
    }
}

fn ball(random: &mut SplitMix) -> Tool {
    let radius = between(random, 1.0, 5.0);
    tool(Shape::Sphere { radius }, between(random, 0.0, 0.3))
}

fn spread(hands: &Hands) -> Result<Vec<Site>> {
    let count = if hands.bench.quick {
        PLACES / 10
    } else {
        PLACES
    };
    sites(hands.bench, count)
}

/// From clear of the tissue to 2 to 8 mm deep, 12 to 24 mm at once.
fn leaps(hands: &mut Hands) -> Result<Row> {
    let mut random = SplitMix(42);
    let mut met = Met::default();
    for site in spread(hands)? {
        let ball = ball(&mut random);
        let deep = at(&ball, &site, between(&mut random, 2.0, 8.0))?;
        let away = moved(&deep, -site.inward * between(&mut random, 12.0, 24.0));
        let mut poses = vec![away];
        poses.resize(1 + HELD, deep);
        met.place(hands, &ball, &poses, 1..1 + HELD)?;
    }
    Ok(met.row(hands, "balls that leap 12 to 24 mm in a step"))
}

/// From the first step on wholly beneath the surface.
fn buried(hands: &mut Hands) -> Result<Row> {
    let mut random = SplitMix(43);
    let mut met = Met::default();
    for site in spread(hands)? {
        let ball = ball(&mut random);
        let Shape::Sphere { radius } = ball.shape else {
            continue;
        };
        let deep = at(&ball, &site, 2.0 * radius + between(&mut random, 0.5, 3.0))?;
        // Once it is out, the tissue may swing off it for a step.
        met.place(hands, &ball, &vec![deep; 4 * HELD], 0..1)?;
    }
    Ok(met.row(hands, "balls that begin beneath the surface"))
}

/// Three tools at new deep poses in every step, with much friction: the time of the worst step.
fn deep(hands: &mut Hands) -> Result<Row> {
    let mut random = SplitMix(44);
    let spread = sites(hands.bench, 24)?;
    let steps = hands.bench.steps(DEEP_STEPS);
    hands.driver.reset()?;
    let (mut times, mut contact, mut refused) = (Vec::new(), 0.0f64, 0usize);
    while times.len() + refused < steps {
        let tools: Vec<Tool> = (0..3)
            .map(|_| {
                let friction = between(&mut random, 0.6, 1.2);
                Tool {
                    friction,
                    tear_off_mn: 0.0,
                    ..any(&mut random)
                }
            })
            .collect();
        hands.driver.take(&tools)?;
        for _ in 0..10 {
            let mut poses = Vec::new();
            for tool in &tools {
                let site = spread[(random.unit() * spread.len() as f64) as usize];
                let mut pose = at(tool, &site, between(&mut random, 2.0, 20.0))?;
                let mut draw = || between(&mut random, -0.5, 0.5);
                let turn = Rotation::from_scaled_axis(Vector::new(draw(), draw(), draw()));
                pose.pose = Pose::from_parts(pose.pose.translation, turn * pose.pose.rotation);
                poses.push(pose);
            }
            match hands.driver.step(&poses, &mut hands.field) {
                Ok(step) => {
                    times.push(step.ms);
                    contact = contact.max(step.contact_ms);
                }
                Err(_) => refused += 1,
            }
        }
    }
    times.sort_by(f64::total_cmp);
    let finite = hands.field.as_flattened().iter().all(|u| u.is_finite());
    let at = |share: f64| {
        times
            .get((share * (times.len() as f64 - 1.0)) as usize)
            .copied()
            .unwrap_or(0.0)
    };
    let text = format!(
        "{} steps, {refused} refused by the guard; a step takes {:.1} ms in the median, {:.1} ms at p99, {:.1} ms at most, its contact {contact:.1} ms at most",
        steps,
        at(0.5),
        at(0.99),
        at(1.0),
    );
    let name = "three tools at random deep poses, friction 0.6 to 1.2";
    Ok(Row::new(&hands.bench.subject, name, text, finite))
}
