//! A device of one mass that a hand holds by a spring and a damper, with an encoder and a clock that jitters.

use contact::Vector;

/// Length of an inner step, s.
const INNER_S: f64 = 1e-4;
/// The encoder's resolution, mm.
const ENCODER_MM: f32 = 0.01;
/// Part of a period by which a tick comes early or late.
const JITTER: f64 = 0.1;
/// One tick of so many comes a period late: other work on the host.
const LATE: f64 = 1.0 / 200.0;
/// Of the device: mass, kg, and damping, N s/m.
const MASS_KG: f32 = 0.08;
const DAMPING: f32 = 0.1;

/// xorshift.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Random {
        Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    /// In [0, 1).
    pub fn unit(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// The time until the next tick of a clock of 1 kHz, s.
    pub fn tick(&mut self) -> f64 {
        let late = if self.unit() < LATE { 1e-3 } else { 0.0 };
        1e-3 * (1.0 + JITTER * (2.0 * self.unit() - 1.0)) + late
    }
}

/// One device.
pub struct Device {
    /// mm and mm/s.
    pub position: Vector,
    pub velocity: Vector,
    /// Of the hand, N/m and N s/m.
    stiffness: f32,
    damping: f32,
}

impl Device {
    /// At rest where a hand of some stiffness (N/m) holds it.
    pub fn new(position: Vector, stiffness: f32) -> Device {
        Device {
            position,
            velocity: Vector::ZERO,
            stiffness,
            damping: 1.4 * (stiffness * MASS_KG).sqrt(),
        }
    }

    /// What the encoder reads, mm.
    pub fn read(&self) -> Vector {
        (self.position / ENCODER_MM).round() * ENCODER_MM
    }

    /// Lets time pass under a force that is held (N), the hand going to `wanted(part)` of the interval, mm. Gives the energy that
    /// the force gave, J.
    pub fn advance(&mut self, seconds: f64, force: Vector, wanted: impl Fn(f64) -> Vector) -> f64 {
        let steps = (seconds / INNER_S).ceil().max(1.0) as u32;
        let h = (seconds / f64::from(steps)) as f32;
        let mut given = 0.0;
        for step in 1..=steps {
            let part = f64::from(step) / f64::from(steps);
            let hand = (wanted(part) - self.position) * (1e-3 * self.stiffness)
                - self.velocity * (1e-3 * (self.damping + DAMPING));
            self.velocity += (hand + force) * (1e3 * h / MASS_KG);
            let way = self.velocity * h;
            self.position += way;
            given += f64::from(force.dot(way)) * 1e-3;
        }
        given
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_force_moves_the_hand_by_its_spring() {
        let mut device = Device::new(Vector::ZERO, 200.0);
        let force = Vector::new(0.4, 0.0, 0.0);
        let mut given = 0.0;
        for _ in 0..3000 {
            given += device.advance(1e-3, force, |_| Vector::ZERO);
        }
        // 0.4 N on 200 N/m: 2 mm, 0.8 mJ.
        assert!((device.position.x - 2.0).abs() < 1e-3);
        assert!((given - 8e-4).abs() < 1e-6);
    }
}
