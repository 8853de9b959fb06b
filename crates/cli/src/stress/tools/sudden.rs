//! Tools that a step could lose: quick balls, balls that leap, needles, pointed hulls, and balls that begin in the tissue. Places are at least
//! [`BORDER_MM`] from what tools do not touch, and the way in is clear of the tissue at rest.

use anyhow::Result;
use contact::{Body, Shape, Vector};
use tissue::schemes::SplitMix;
use tissue::solver::{Tool, ToolPose};
use upt::flag;

use super::hand::{Site, at, between, sites, tool};
use super::run::Hands;
use crate::stress::Row;

/// Places of each row.
const PLACES: usize = 100;
/// How deep a tool may lie in the tissue at the end of a step, and how deep is the goal, mm.
const MOST_MM: f64 = 1.0;
const GOAL_MM: f64 = 0.3;
/// Steps that a tool stays at the end of its way.
const HELD: usize = 4;
/// From the nearest node that tools do not touch, mm.
const BORDER_MM: f32 = 8.0;
/// A tool that begins its way deeper in the tissue at rest is not clear of it, mm.
const CLEAR_MM: f64 = 0.3;

pub(super) fn rows(hands: &mut Hands) -> Result<Vec<Row>> {
    let places = spread(hands)?;
    let step_s = hands.step_s as f32;
    let ball = |random: &mut SplitMix| {
        let radius = between(random, 1.0, 5.0);
        tool(Shape::Sphere { radius }, between(random, 0.0, 0.3))
    };
    let needle = |random: &mut SplitMix| {
        let shape = Shape::Capsule {
            half_length: 30.0,
            radius: 0.25,
        };
        tool(shape, between(random, 0.0, 0.2))
    };
    let cone = |random: &mut SplitMix| tool(pointed_hull(), between(random, 0.0, 0.2));
    let quick = |speed: f32| move |_: &mut SplitMix| speed * step_s;
    let leap = |random: &mut SplitMix| between(random, 12.0, 39.0);
    let slow = |_: &mut SplitMix| 1.0;
    let mut rows = Vec::new();
    for speed in [200.0, 1000.0] {
        let name = format!("balls at {speed} mm/s");
        rows.push(jabs(hands, &places, &name, ball, quick(speed))?);
    }
    let name = "balls that leap 12 to 39 mm in a step";
    rows.push(jabs(hands, &places, name, ball, leap)?);
    rows.push(jabs(hands, &places, "needles of 0.5 mm", needle, slow)?);
    let name = "hulls with a point, half angle 17 degrees";
    rows.push(jabs(hands, &places, name, cone, slow)?);
    rows.push(buried(hands, &places)?);
    Ok(rows)
}

/// A cone of 16 sides on a shaft, its point at its lowest end.
fn pointed_hull() -> Shape {
    let wide = 20.0 * 17.0f32.to_radians().tan();
    let mut points = vec![[0.0, -20.0, 0.0]];
    for side in 0..16 {
        let (sin, cos) = (side as f32 * std::f32::consts::TAU / 16.0).sin_cos();
        points.extend([0.0, 20.0].map(|y| [wide * cos, y, wide * sin]));
    }
    Shape::Hull {
        points,
        margin: 0.0,
    }
}

/// What a tool met at all its places.
#[derive(Default)]
struct Met {
    places: usize,
    /// With contact in each of the steps that are looked at, and with contact or a flag.
    found: usize,
    told: usize,
    /// Never deeper than [`MOST_MM`] at the end of a step in which it must be told of, and never deeper than [`GOAL_MM`].
    held: usize,
    good: usize,
    /// Deeper without a flag.
    silent: usize,
    worst_mm: f64,
    error: Option<String>,
}

impl Met {
    /// The tool goes through poses; in the steps `told_in` it must be told of and held, or only in the last where it begins in the tissue.
    fn place(
        &mut self,
        hands: &mut Hands,
        tool: &Tool,
        poses: &[ToolPose],
        told_in: std::ops::Range<usize>,
        held_from: usize,
    ) -> Result<()> {
        hands.driver.reset()?;
        hands.driver.take(std::slice::from_ref(tool))?;
        self.places += 1;
        let body = [Body::new(&tool.shape)?];
        let (mut found, mut told, mut deepest, mut silent) = (true, true, 0.0f64, false);
        for (step, pose) in poses.iter().enumerate() {
            let made = match hands.driver.step(&[*pose], &mut hands.field) {
                Ok(made) => made,
                Err(error) => {
                    self.error = Some(format!("{error:#}"));
                    return Ok(());
                }
            };
            let touches = made.felt.iter().any(|felt| felt.contacts > 0);
            let is_told = made.flags & flag::DEEP != 0;
            if told_in.contains(&step) {
                found &= touches;
                told &= touches || is_told;
            }
            if step >= held_from {
                let felt = made.felt.iter().map(|felt| felt.penetration_mm);
                let depth = hands.yard.penetration(&hands.field, &body, &[pose.pose]);
                let depth = felt.fold(depth, f64::max);
                deepest = deepest.max(depth);
                silent |= depth > MOST_MM && !is_told;
            }
        }
        self.found += usize::from(found);
        self.told += usize::from(told);
        self.held += usize::from(deepest <= MOST_MM);
        self.good += usize::from(deepest <= GOAL_MM);
        self.silent += usize::from(silent);
        self.worst_mm = self.worst_mm.max(deepest);
        Ok(())
    }

    /// Good if the tool was found, or told of, everywhere; `all_held`: and nowhere deeper than it may be.
    fn row(self, hands: &Hands, name: &str, all_held: bool) -> Row {
        let mut text = format!(
            "contact in {} of {} places, contact or a flag in {}; at most {MOST_MM} mm deep in {} of {} ({GOAL_MM} mm: {}), {:.2} mm at most, deeper without a flag in {}",
            self.found,
            self.places,
            self.told,
            self.held,
            self.places,
            self.good,
            self.worst_mm,
            self.silent
        );
        if let Some(error) = &self.error {
            text += &format!("; error: {error}");
        }
        let met = match all_held {
            true => self.found == self.places && self.held == self.places,
            false => self.told == self.places && self.silent == 0,
        };
        Row::new(
            &hands.bench.subject,
            name,
            text,
            self.error.is_none() && met,
        )
    }
}

/// As many places as there are to be, those whose surroundings are free.
fn spread(hands: &Hands) -> Result<Vec<Site>> {
    let count = if hands.bench.quick {
        PLACES / 10
    } else {
        PLACES
    };
    let mesh = &hands.bench.mesh;
    let of = |rows: &mut dyn Iterator<Item = u32>| {
        let faces = rows.map(|row| mesh.surface[row as usize]);
        let mut nodes: Vec<u32> = faces.flatten().collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    };
    let touched = of(&mut mesh.domain.iter().copied());
    let mut border = of(&mut (0..mesh.surface.len() as u32));
    border.retain(|node| touched.binary_search(node).is_err());
    let place = |node: &u32| Vector::from(mesh.positions[*node as usize]);
    let mut found = sites(hands.bench, 4 * count)?;
    found.retain(|site| (border.iter()).all(|node| place(node).distance(site.at) >= BORDER_MM));
    Ok(found)
}

/// Tools that come from clear of the tissue to 2 to 6 mm deep, `way` mm a step, and stay there.
fn jabs(
    hands: &mut Hands,
    places: &[Site],
    name: &str,
    make: impl Fn(&mut SplitMix) -> Tool,
    way: impl Fn(&mut SplitMix) -> f32,
) -> Result<Row> {
    let mut random = SplitMix(42);
    let mut met = Met::default();
    let most = if hands.bench.quick {
        PLACES / 10
    } else {
        PLACES
    };
    let still = vec![[0.0; 3]; hands.field.len()];
    for site in places {
        if met.places == most {
            break;
        }
        let (tool, way) = (make(&mut random), way(&mut random));
        let depth = between(&mut random, 2.0, 6.0);
        let start = (way - depth).max(2.0);
        let body = [Body::new(&tool.shape)?];
        let mut clear = true;
        for millimetres in 0..=start as usize {
            let pose = at(&tool, site, -(millimetres as f32).max(0.3))?;
            clear &= hands.yard.penetration(&still, &body, &[pose.pose]) < CLEAR_MM;
        }
        if !clear {
            continue;
        }
        let count = ((start + depth) / way).ceil() as usize;
        let heights = (0..=count).map(|step| (start - way * step as f32).max(-depth));
        let mut poses = Vec::new();
        for height in heights.chain(std::iter::repeat_n(-depth, HELD)) {
            poses.push(at(&tool, site, -height)?);
        }
        let below = |step: &usize| start - way * *step as f32 <= -0.6;
        let first = (0..poses.len()).find(below).unwrap_or(count);
        met.place(hands, &tool, &poses, first..poses.len(), first)?;
    }
    Ok(met.row(hands, name, true))
}

/// From the first step on wholly beneath the surface.
fn buried(hands: &mut Hands, places: &[Site]) -> Result<Row> {
    let mut random = SplitMix(43);
    let mut met = Met::default();
    let every = (places.len() / PLACES).max(1);
    for site in places.iter().step_by(every).take(PLACES) {
        let radius = between(&mut random, 1.0, 5.0);
        let ball = tool(Shape::Sphere { radius }, between(&mut random, 0.0, 0.3));
        let deep = at(&ball, site, 2.0 * radius + between(&mut random, 0.5, 3.0))?;
        // Once it is out, the tissue may swing off it for a step.
        let steps = 4 * HELD;
        met.place(hands, &ball, &vec![deep; steps], 0..1, steps - 1)?;
    }
    Ok(met.row(hands, "balls that begin beneath the surface", false))
}
