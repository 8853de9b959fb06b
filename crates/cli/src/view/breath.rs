//! The organ breathes: what holds it goes up and down, and a ball hangs on it by a bed of ties, as a gall bladder does on the liver.
//!
//! The library has all of it in the organ's frame, which goes with what holds it; the page's tool is in the world.

use anyhow::Result;
use upt::{Vector, ffi};

use super::protocol::Tool;
use host::{Scene, instrument};

/// How far the support goes up, mm, and how long a breath takes, s.
const HEIGHT_MM: f64 = 15.0;
const BREATH_S: f64 = 4.0;
/// The ball, over the longest side of the organ, and at most, mm.
const RADIUS: [f32; 2] = [0.05, 9.0];
/// Stiffness (N/m) and strength (mN) of the whole bed.
const STIFFNESS: f32 = 300.0;
const STRENGTH: f32 = 400.0;

/// The ball and its bed, in the organ's frame.
struct Hanging {
    ball: ffi::upt_instrument,
    ties: Vec<ffi::upt_tie>,
}

/// See the module; by default nothing breathes.
#[derive(Default)]
pub struct Breath {
    /// Since when, s on the session's clock.
    since: Option<f64>,
    hanging: Option<Hanging>,
    pub torn: u32,
}

/// What a step has of it.
pub struct Breathing {
    pub instruments: Vec<ffi::upt_instrument>,
    support: f32,
}

impl Breath {
    /// From now on, of a surface at rest with its triangles. The ball hangs at the node of the domain that the page shows lowest at first; a body that has been cut has none.
    pub fn begin(
        scene: &mut Scene,
        now: f64,
        (rest, faces): (&[[f32; 3]], &[u32]),
        domain: &[u32],
    ) -> Result<Self> {
        let side = |k: usize| {
            let along = rest.iter().map(|place| place[k]);
            [
                along.clone().fold(f32::MAX, f32::min),
                along.fold(f32::MIN, f32::max),
            ]
        };
        let sides = [0, 1, 2].map(side);
        let longest = sides
            .iter()
            .fold(0.0f32, |most, [low, high]| most.max(high - low));
        let touched = (0..rest.len()).filter(|at| domain[*at] != 0);
        let sum: Vector = touched.clone().map(|at| Vector::from(rest[at])).sum();
        let middle = sum / touched.clone().count().max(1) as f32;
        let center = Vector::from(sides.map(|[low, high]| 0.5 * (low + high)));
        let up = up_on_the_page(middle - center);
        let height = |at: &usize| Vector::from(rest[*at]).dot(up);
        let lowest = touched.min_by(|a, b| height(a).total_cmp(&height(b)));
        let radius = (RADIUS[0] * longest).min(RADIUS[1]);
        let hanging = match lowest {
            Some(at) => hang(scene, rest[at], outward(rest, faces, at as u32), radius)?,
            None => None,
        };
        Ok(Self {
            since: Some(now),
            hanging,
            torn: 0,
        })
    }

    /// How far up the support is, mm.
    pub fn height(&self, now: f64) -> f32 {
        let Some(since) = self.since else { return 0.0 };
        let phase = std::f64::consts::TAU * (now - since).max(0.0) / BREATH_S;
        (0.5 * HEIGHT_MM * (1.0 - phase.cos())) as f32
    }

    /// A tool of the world in the organ's frame.
    pub fn in_frame(&self, tool: Option<Tool>, now: f64) -> Option<Tool> {
        let mut tool = tool?;
        tool.position[2] -= self.height(now);
        Some(tool)
    }

    /// The instruments with the ball before them, and where the support is.
    pub fn with(&self, instruments: Vec<ffi::upt_instrument>, now: f64) -> Breathing {
        let ball = self.hanging.iter().map(|own| own.ball);
        Breathing {
            instruments: ball.chain(instruments).collect(),
            support: self.height(now),
        }
    }

    /// Which of the instruments is the tool.
    pub fn place_of_tool(&self) -> usize {
        usize::from(self.hanging.is_some())
    }

    /// The input of a step.
    pub fn input(&self, breathing: &Breathing) -> ffi::upt_input {
        let mut input = ffi::upt_input::of_instruments(&breathing.instruments);
        if self.since.is_some() {
            input.support_position = [0.0, 0.0, breathing.support];
            input.support_rotation = [0.0, 0.0, 0.0, 1.0];
        }
        if let Some(own) = &self.hanging {
            (input.ties, input.tie_count) = (own.ties.as_ptr(), own.ties.len() as u64);
        }
        input
    }

    /// Counts the ties that have torn.
    pub fn read(&mut self, scene: &Scene) -> Result<()> {
        if let Some(own) = &self.hanging {
            let readings = scene.tie_readings(own.ties.len())?;
            self.torn = readings
                .iter()
                .map(|reading| u32::from(reading.broken))
                .sum();
        }
        Ok(())
    }

    /// Where the ball is in the world, and its radius; zeros: there is none.
    pub fn ball(&self, now: f64) -> [f32; 4] {
        let Some(own) = &self.hanging else {
            return [0.0; 4];
        };
        let [x, y, z] = own.ball.position;
        [x, y, z + self.height(now), own.ball.radius]
    }
}

/// What is up on the page, which looks at the organ against a direction.
fn up_on_the_page(towards_the_eye: Vector) -> Vector {
    let eye = towards_the_eye.normalize_or_zero();
    let up = Vector::Z - eye * eye.z;
    up.try_normalize().unwrap_or(Vector::Y)
}

/// The way out of the tissue at a node of its surface.
fn outward(rest: &[[f32; 3]], faces: &[u32], node: u32) -> Vector {
    let own = faces.chunks_exact(3).filter(|face| face.contains(&node));
    let sum = own.fold(Vector::ZERO, |sum, face| {
        let [a, b, c] = [0, 1, 2].map(|k| Vector::from(rest[face[k] as usize]));
        sum + (b - a).cross(c - a)
    });
    sum.normalize_or_zero()
}

/// A ball outside of a place, and its bed; none where the body has been cut.
fn hang(
    scene: &mut Scene,
    place: [f32; 3],
    outward: Vector,
    radius: f32,
) -> Result<Option<Hanging>> {
    let ball = ffi::upt_instrument {
        shape: ffi::UPT_SHAPE_SPHERE,
        position: (Vector::from(place) + outward * (1.1 * radius)).to_array(),
        radius,
        ..instrument()
    };
    let Some(mut ties) = scene.bed(place, 1.6 * radius, [STIFFNESS, STRENGTH])? else {
        return Ok(None);
    };
    for tie in &mut ties {
        tie.to = ffi::UPT_END_INSTRUMENT;
        (tie.place.iter_mut().zip(ball.position)).for_each(|(own, ball)| *own -= ball);
    }
    Ok(Some(Hanging { ball, ties }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_breath_comes_back() {
        let still = Breath::default();
        assert_eq!(still.height(3.0), 0.0);
        let breath = Breath {
            since: Some(1.0),
            ..Breath::default()
        };
        let heights = [1.0, 3.0, 5.0].map(|now| breath.height(now));
        assert!(heights[0] == 0.0 && (heights[1] - 15.0).abs() < 1e-4);
        assert!(heights[2].abs() < 1e-4);
        let input = breath.input(&breath.with(Vec::new(), 3.0));
        assert_eq!(
            (input.support_position[2], input.tie_count),
            (heights[1], 0)
        );
    }

    #[test]
    fn up_on_the_page_is_up_as_far_as_the_eye_lets_it() {
        assert_eq!(up_on_the_page(Vector::new(3.0, 0.0, 0.0)), Vector::Z);
        let up = up_on_the_page(Vector::new(1.0, 0.0, 1.0));
        assert!((up - Vector::new(-1.0, 0.0, 1.0).normalize()).length() < 1e-6);
        assert_eq!(up_on_the_page(Vector::Z), Vector::Y);
    }
}
