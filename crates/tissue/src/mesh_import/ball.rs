//! A ball, the simplest region.

use std::str::FromStr;

/// A ball `x,y,z,r`, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    pub centre: [f64; 3],
    pub radius: f64,
}

impl Ball {
    pub(super) fn holds(&self, point: [f64; 3]) -> bool {
        let squared: f64 = (0..3).map(|k| (point[k] - self.centre[k]).powi(2)).sum();
        squared <= self.radius * self.radius
    }
}

impl FromStr for Ball {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Vec<f64> = text
            .split(',')
            .map(|part| part.trim().parse::<f64>().ok().filter(|x| x.is_finite()))
            .collect::<Option<_>>()
            .unwrap_or_default();
        match numbers[..] {
            [x, y, z, radius] if radius > 0.0 => Ok(Self {
                centre: [x, y, z],
                radius,
            }),
            _ => Err(format!(
                "`{text}` is not a ball; write x,y,z,r in mm with r above 0"
            )),
        }
    }
}
