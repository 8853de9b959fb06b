//! Tools that a step could lose: quick balls, balls that leap, needles, pointed hulls, and balls that begin in the tissue. Places are at least
//! [`BORDER_MM`] from what tools do not touch, nearer ones are rows of their own, and the way in is clear of the tissue at rest.

use anyhow::Result;
use contact::{Body, Shape, Vector};
use tissue::schemes::SplitMix;
use tissue::solver::Tool;

use super::hand::{Site, at, between, sites, tool};
use super::met::Met;
use super::run::Hands;
use super::truth;
use super::way::Way;
use crate::stress::Row;

/// Places of each row.
const PLACES: usize = 100;
/// Steps in which a tool comes near that does not leap, and steps that it stays at the end of its way.
const LEAD: f32 = 2.0;
const HELD: usize = 4;
/// From the nearest node that tools do not touch, mm.
const BORDER_MM: f32 = 8.0;
/// A tool that begins its way deeper in the tissue at rest is not clear of it, mm.
const CLEAR_MM: f64 = 0.3;

pub(super) fn rows(hands: &mut Hands) -> Result<Vec<Row>> {
    let [places, near] = spread(hands)?;
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
        let ways = ways(hands, &places, ball, quick(speed), false)?;
        rows.push(jabs(hands, &name, &ways, true)?);
    }
    let leaps = ways(hands, &places, ball, leap, true)?;
    let name = "balls that leap 12 to 39 mm in a step";
    rows.push(jabs(hands, name, &leaps, true)?);
    let needles = ways(hands, &places, needle, slow, false)?;
    rows.push(jabs(hands, "needles of 0.5 mm", &needles, true)?);
    rows.push(truth::row(hands, "needles of 0.5 mm", &needles)?);
    let points = ways(hands, &places, cone, slow, false)?;
    let name = "hulls with a point, half angle 17 degrees";
    rows.push(jabs(hands, name, &points, true)?);
    rows.push(buried(hands, &places)?);
    let border = format!("nearer than {BORDER_MM} mm to what tools do not touch");
    let balls = ways(hands, &near, ball, quick(200.0), false)?;
    let name = format!("balls at 200 mm/s, {border}");
    rows.push(jabs(hands, &name, &balls, false)?);
    let needles = ways(hands, &near, needle, slow, false)?;
    let name = format!("needles of 0.5 mm, {border}");
    rows.push(jabs(hands, &name, &needles, false)?);
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

/// Places whose surroundings are free, and those near to what tools do not touch.
fn spread(hands: &Hands) -> Result<[Vec<Site>; 2]> {
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
    let is_free =
        |site: &Site| (border.iter()).all(|node| place(node).distance(site.at) >= BORDER_MM);
    let found = sites(hands.bench, 4 * most(hands))?;
    let (free, near) = found.into_iter().partition(is_free);
    Ok([free, near])
}

/// Places of a row.
fn most(hands: &Hands) -> usize {
    PLACES / if hands.bench.quick { 10 } else { 1 }
}

/// Tools that come from clear of the tissue to 2 to 6 mm deep, `way` mm a step, and stay there.
fn ways(
    hands: &mut Hands,
    places: &[Site],
    make: impl Fn(&mut SplitMix) -> Tool,
    way: impl Fn(&mut SplitMix) -> f32,
    leaps: bool,
) -> Result<Vec<Way>> {
    let mut random = SplitMix(42);
    let mut ways = Vec::new();
    let still = vec![[0.0; 3]; hands.field.len()];
    for site in places {
        if ways.len() == most(hands) {
            break;
        }
        let (tool, way) = (make(&mut random), way(&mut random));
        let depth = between(&mut random, 2.0, 6.0);
        let start = match leaps {
            true => (way - depth).max(2.0),
            // A hand comes from farther than it goes within a step.
            false => (way - depth).max(2.0) + LEAD * way,
        };
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
            poses.push((at(&tool, site, -height)?, height));
        }
        ways.push(Way {
            tool,
            poses,
            leaps,
            begins_in_tissue: false,
        });
    }
    Ok(ways)
}

/// A row of tools on their ways.
fn jabs(hands: &mut Hands, name: &str, ways: &[Way], all_held: bool) -> Result<Row> {
    let mut met = Met::default();
    for way in ways {
        met.place(hands, way)?;
    }
    Ok(met.row(hands, name, all_held))
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
        let poses = vec![(deep, f32::NEG_INFINITY); 4 * HELD];
        let way = Way {
            tool: ball,
            poses,
            leaps: true,
            begins_in_tissue: true,
        };
        met.place(hands, &way)?;
    }
    Ok(met.row(hands, "balls that begin beneath the surface", false))
}
