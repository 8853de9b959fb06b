//! Colours of a scalar field on tissue, and the shading of a point.

/// A sequence of colours from zero to the largest value shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Palette {
    /// Displacement: tissue, amber, red, dark violet.
    Displacement,
    /// Error: tissue, light blue, blue, black-blue.
    Error,
}

impl Palette {
    fn stops(self) -> &'static [[f32; 3]] {
        match self {
            Palette::Displacement => &[
                [0.93, 0.87, 0.83],
                [0.98, 0.80, 0.50],
                [0.95, 0.55, 0.28],
                [0.80, 0.25, 0.27],
                [0.53, 0.10, 0.38],
                [0.25, 0.05, 0.32],
            ],
            Palette::Error => &[
                [0.93, 0.87, 0.83],
                [0.70, 0.82, 0.86],
                [0.40, 0.66, 0.82],
                [0.16, 0.44, 0.72],
                [0.09, 0.22, 0.52],
                [0.03, 0.06, 0.25],
            ],
        }
    }

    /// sRGB channels in 0..1 for `share`, the value over the largest value shown (clamped).
    pub fn colour(self, share: f32) -> [f32; 3] {
        let stops = self.stops();
        let place = share.clamp(0.0, 1.0) * (stops.len() - 1) as f32;
        let index = (place as usize).min(stops.len() - 2);
        let rest = place - index as f32;
        [0, 1, 2].map(|k| stops[index][k] * (1.0 - rest) + stops[index + 1][k] * rest)
    }

    /// The colour as `#rrggbb`, for legends.
    pub fn hex(self, share: f32) -> String {
        let [r, g, b] = self
            .colour(share)
            .map(|value| (value * 255.0).round() as u8);
        format!("#{r:02x}{g:02x}{b:02x}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_of_a_palette_are_its_first_and_last_stops() {
        for palette in [Palette::Displacement, Palette::Error] {
            assert_eq!(palette.colour(-1.0), palette.stops()[0]);
            assert_eq!(palette.colour(2.0), *palette.stops().last().unwrap());
            assert_eq!(palette.colour(f32::NAN).len(), 3);
        }
        assert_eq!(Palette::Error.hex(0.0), "#edded4");
    }
}
