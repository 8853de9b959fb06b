//! What a tool met at its places: at the ends of the steps, in the frames between them, and in a hand at 1 kHz.

use anyhow::Result;
use contact::Body;
use tissue::solver::ToolPose;
use upt::flag;

use super::run::Hands;
use super::way::Way;
use crate::stress::Row;

/// How deep a tool may lie in the tissue, and how deep is the goal, mm.
const MOST_MM: f64 = 1.0;
const GOAL_MM: f64 = 0.3;
/// Frames that are shown between two steps.
const FRAMES: usize = 2;
/// A hand may miss the tissue for so many calls, ms, or for as long as the truth does, where quick tissue flies off; and for more in one place, and one more of so many.
const MISSED: usize = 5;
const HANDS: usize = 100;
/// Part of a step that passes before its state reaches the hand.
const LATENCY: f32 = 0.5;

/// How deep tools lay at the ends of steps, or in frames.
#[derive(Default)]
struct Depths {
    /// Places with no more than [`MOST_MM`], and with no more than [`GOAL_MM`].
    held: usize,
    good: usize,
    worst_mm: f64,
}

impl Depths {
    fn add(&mut self, deepest: f64) {
        self.held += usize::from(deepest <= MOST_MM);
        self.good += usize::from(deepest <= GOAL_MM);
        self.worst_mm = self.worst_mm.max(deepest);
    }

    fn text(&self, places: usize) -> String {
        format!(
            "at most {MOST_MM} mm deep in {} of {places} ({GOAL_MM} mm: {}), {:.2} mm at most",
            self.held, self.good, self.worst_mm
        )
    }
}

/// What a tool met at all its places.
#[derive(Default)]
pub struct Met {
    places: usize,
    /// With contact in each of the steps that are looked at, and with contact or a flag.
    found: usize,
    told: usize,
    /// At the ends of steps, and in frames, where these are asked.
    steps: Depths,
    frames: Depths,
    between: bool,
    /// Met by a hand, and the most calls one after another in which none of them was: quick tissue may fly off for a moment.
    felt: usize,
    most_missed: usize,
    /// Places in which the hand missed it for longer than [`MISSED`], but the truth's tool for as long.
    missed_in_truth: usize,
    /// Deeper than [`MOST_MM`] without a flag.
    silent: usize,
    error: Option<String>,
}

impl Met {
    /// The tool goes its way from tissue at rest. Gives how deep it lay at the ends of steps, mm.
    pub fn place(&mut self, hands: &mut Hands, way: &Way) -> Result<f64> {
        hands.driver.reset()?;
        hands.driver.take(std::slice::from_ref(&way.tool))?;
        self.places += 1;
        match self.follow(hands, way) {
            Ok(deepest) => Ok(deepest),
            Err(error) => {
                self.error = Some(format!("{error:#}"));
                Ok(f64::INFINITY)
            }
        }
    }

    fn follow(&mut self, hands: &mut Hands, way: &Way) -> Result<f64> {
        let body = [Body::new(&way.tool.shape)?];
        let start = way.poses[0].0;
        let (told_in, held_from) = match way.begins_in_tissue {
            true => (0..1, way.poses.len() - 1),
            false => (way.first()..way.poses.len(), way.first()),
        };
        let step_ms = 1e3 * hands.step_s as f32;
        // Frames and hands take corrections.
        let corrects = hands.bench.model.manifest.corrections.is_some();
        let mut hand = match corrects && !way.begins_in_tissue {
            true => Some(hands.driver.hand(&start, LATENCY * step_ms)?),
            false => None,
        };
        self.between |= hand.is_some();
        let mut shown = vec![[0.0; 3]; hands.field.len()];
        let (mut found, mut told, mut silent) = (true, true, false);
        let (mut missed, mut most_missed) = (0, 0);
        let (mut deepest, mut deepest_shown) = (0.0f64, 0.0f64);
        for (step, (at, _)) in way.poses.iter().enumerate() {
            let made = hands.driver.step(&[*at], &mut hands.field)?;
            let touches = made.felt.iter().any(|felt| felt.contacts > 0);
            let is_told = made.flags & flag::DEEP != 0;
            if told_in.contains(&step) {
                found &= touches;
                told &= touches || is_told;
            }
            if step >= held_from {
                let felt = made.felt.iter().map(|felt| felt.penetration_mm);
                let depth = hands.yard.penetration(&hands.field, &body, &[at.pose]);
                let depth = felt.fold(depth, f64::max);
                deepest = deepest.max(depth);
                silent |= depth > MOST_MM && !is_told;
            }
            let Some(hand) = &mut hand else { continue };
            for frame in 1..=FRAMES {
                let after = frame as f32 / FRAMES as f32;
                let (pose, beneath) = way.at(step as f32 + after);
                let now = ToolPose { pose, ..*at };
                let seconds = f64::from(after) * hands.step_s;
                hands.driver.present(seconds, &[now], &mut shown)?;
                if beneath {
                    let depth = hands.yard.penetration(&shown, &body, &[pose]);
                    deepest_shown = deepest_shown.max(depth);
                }
            }
            let calls = step_ms.round() as usize;
            for call in 1..=calls {
                let time = step as f32 + LATENCY + call as f32 / calls as f32;
                let (pose, beneath) = way.at(time);
                let contacts = hand.contacts(f64::from(time) * hands.step_s, &pose)?;
                let arrived = !way.leaps || time > held_from as f32 + LATENCY;
                missed = match contacts > 0 || !beneath || !arrived {
                    true => 0,
                    false => missed + 1,
                };
                most_missed = most_missed.max(missed);
            }
        }
        self.found += usize::from(found);
        self.told += usize::from(told);
        let flies_off = most_missed > MISSED && way.true_miss(hands)? >= Some(most_missed);
        self.missed_in_truth += usize::from(flies_off);
        self.felt += usize::from(most_missed <= MISSED || flies_off);
        self.most_missed = self.most_missed.max(most_missed);
        self.steps.add(deepest);
        self.frames.add(deepest_shown);
        self.silent += usize::from(silent);
        Ok(deepest)
    }

    /// Good if the tool was found, or told of, everywhere; `all_held`: and nowhere deeper than it may be.
    pub fn row(self, hands: &Hands, name: &str, all_held: bool) -> Row {
        let places = self.places;
        let mut text = format!(
            "contact in {} of {places} places, contact or a flag in {}; {}, deeper without a flag in {}",
            self.found,
            self.told,
            self.steps.text(places),
            self.silent
        );
        if self.between {
            text += &format!(
                "; frames: {}; a hand at 1 kHz: contact in {} of {places}, none for {} ms at most",
                self.frames.text(places),
                self.felt,
                self.most_missed
            );
            if self.missed_in_truth > 0 {
                text += &format!(
                    ", in the truth as long in {} of these",
                    self.missed_in_truth
                );
            }
        }
        if let Some(error) = &self.error {
            text += &format!("; error: {error}");
        }
        let all = |count: usize| count == places;
        let met = match all_held {
            true => {
                let missed = places - self.felt;
                let between = all(self.frames.held) && missed <= 1 + places / HANDS;
                all(self.found) && all(self.steps.held) && (between || !self.between)
            }
            false => all(self.told) && self.silent == 0,
        };
        let good = self.error.is_none() && met;
        Row::new(&hands.bench.subject, name, text, good)
    }
}
