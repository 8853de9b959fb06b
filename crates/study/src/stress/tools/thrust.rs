//! A blade that presses and then leaps on: the tissue has to come along, beside the same blade that presses as deep slowly.

use anyhow::Result;
use contact::{Body, Shape, Vector};
use gauge::Sorted;
use tissue::solver::Tool;
use upt::flag;

use super::hand::{Site, at, sites, tool};
use super::run::Hands;
use crate::stress::Row;

const PLACES: usize = 20;
/// How far the blade presses before it leaps, and how far it goes in a step as long as it is slow, mm.
const PRESS_MM: f32 = 3.0;
const SLOW_MM: f32 = 0.2;
/// Leaps, mm.
const LEAPS: [f32; 3] = [4.0, 6.0, 9.0];
/// Steps after which the forces are compared, and how far apart they may be.
const AFTER: usize = 40;
const APART: f64 = 0.4;
/// Below this the slow press has slid off, mN.
const LEAST_MN: f64 = 5.0;
/// The blade begins where it lies no deeper than this in the tissue at rest, mm.
const CLEAR_MM: f64 = 0.3;

pub(super) fn rows(hands: &mut Hands) -> Result<Vec<Row>> {
    let count = PLACES / if hands.bench.quick { 10 } else { 1 };
    let places = sites(hands.bench, count)?;
    let leaps = LEAPS.into_iter();
    leaps.map(|leap| row(hands, &places, leap)).collect()
}

/// 3 mm thick, flat on the tissue.
fn blade() -> Tool {
    let shape = Shape::Spatula {
        half_extents: [6.0, 1.5, 8.0],
        radius: 1.5,
    };
    tool(shape, 0.0)
}

fn row(hands: &mut Hands, places: &[Site], leap: f32) -> Result<Row> {
    let blade = blade();
    let (mut compared, mut good, mut silent, mut apart) = (0, 0, 0, Vec::new());
    for site in places {
        let top = top(hands, &blade, site)?;
        let slow = press(hands, &blade, site, top, leap, SLOW_MM)?;
        if slow.force < LEAST_MN {
            continue;
        }
        let quick = press(hands, &blade, site, top, leap, leap)?;
        let off = (quick.force / slow.force - 1.0).abs();
        compared += 1;
        good += usize::from(off <= APART);
        silent += usize::from(quick.silent > 0);
        apart.push(off);
    }
    let name = format!("a blade of 3 mm that presses {PRESS_MM} mm and leaps {leap} mm on");
    let subject = &hands.bench.subject;
    if apart.is_empty() {
        return Ok(Row::left(
            subject,
            &name,
            "the slow press slides off in all places",
        ));
    }
    let apart = Sorted::of(apart);
    let text = format!(
        "force of the slow press within {:.0} % in {good} of {compared} places ({:.1} % in the median, {:.0} at most); no contact and no flag in {silent}",
        100.0 * APART,
        100.0 * apart.median(),
        100.0 * apart.largest()
    );
    let is_good = silent == 0 && 10 * good >= 9 * compared;
    Ok(Row::new(subject, &name, text, is_good))
}

/// Depth at which the blade just touches the tissue at rest.
fn top(hands: &mut Hands, blade: &Tool, site: &Site) -> Result<f32> {
    let still = vec![[0.0; 3]; hands.field.len()];
    let body = [Body::new(&blade.shape)?];
    let mut depth = -20.0;
    while depth < 0.0 {
        let pose = at(blade, site, depth + 0.5)?;
        if hands.yard.penetration(&still, &body, &[pose.pose]) > CLEAR_MM {
            break;
        }
        depth += 0.5;
    }
    Ok(depth)
}

/// How a press ended.
struct Pressed {
    /// mN.
    force: f64,
    /// Steps with tissue in the blade, without contact and without a flag.
    silent: usize,
}

/// Slowly to [`PRESS_MM`], then on by `leap`, `way` mm a step, and held there.
fn press(
    hands: &mut Hands,
    blade: &Tool,
    site: &Site,
    top: f32,
    leap: f32,
    way: f32,
) -> Result<Pressed> {
    hands.driver.reset()?;
    hands.driver.take(std::slice::from_ref(blade))?;
    let slow = (1..).map(|step| SLOW_MM * step as f32);
    let mut depths: Vec<f32> = slow.take_while(|depth| *depth <= PRESS_MM).collect();
    let parts = (leap / way).ceil() as usize;
    depths.extend((1..=parts).map(|part| PRESS_MM + (way * part as f32).min(leap)));
    depths.extend(std::iter::repeat_n(PRESS_MM + leap, AFTER));
    let mut pressed = Pressed {
        force: 0.0,
        silent: 0,
    };
    let body = [Body::new(&blade.shape)?];
    for depth in depths {
        let pose = at(blade, site, top + depth)?;
        let made = hands.driver.step(&[pose], &mut hands.field)?;
        let felt = &made.felt[0];
        pressed.force = Vector::from(felt.force.map(|x| x as f32)).length().into();
        let told = made.flags & (flag::DEEP | flag::UNSOLVED) != 0;
        let is_silent = depth > 1.0 && felt.contacts == 0 && !told;
        let mut lies_in = || hands.yard.penetration(&hands.field, &body, &[pose.pose]) > CLEAR_MM;
        pressed.silent += usize::from(is_silent && lies_in());
    }
    Ok(pressed)
}
