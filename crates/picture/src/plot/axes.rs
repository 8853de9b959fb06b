//! Axes: linear and logarithmic scales, ticks, grid, and marks in data coordinates.

use std::fmt::Write;

use super::escape;

/// Maps data to pixels along one axis.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    log: bool,
    low: f64,
    high: f64,
}

impl Scale {
    /// From `low` to `high`, widened to whole ticks.
    pub fn linear(low: f64, high: f64) -> Self {
        let high = if high > low { high } else { low + 1.0 };
        let step = tick_step(low, high);
        Self {
            log: false,
            low: (low / step).floor() * step,
            high: (high / step).ceil() * step,
        }
    }

    /// Whole decades would waste space: the range of the positive values, with a margin.
    pub fn log(values: impl Iterator<Item = f64>) -> Self {
        let (mut low, mut high) = (f64::INFINITY, 0.0f64);
        for value in values.filter(|value| *value > 0.0 && value.is_finite()) {
            low = low.min(value);
            high = high.max(value);
        }
        if high <= 0.0 {
            return Self {
                log: true,
                low: 0.1,
                high: 10.0,
            };
        }
        Self {
            log: true,
            low: low / 1.6,
            high: high * 1.9,
        }
    }

    /// Share of the axis, 0 at its low end; values outside are clamped.
    pub fn share(&self, value: f64) -> f64 {
        let share = if self.log {
            (value.max(self.low).ln() - self.low.ln()) / (self.high.ln() - self.low.ln())
        } else {
            (value - self.low) / (self.high - self.low)
        };
        share.clamp(0.0, 1.0)
    }

    pub fn low(&self) -> f64 {
        self.low
    }

    pub fn high(&self) -> f64 {
        self.high
    }

    /// Tick values and their labels.
    fn ticks(&self) -> Vec<(f64, String)> {
        if !self.log {
            let step = tick_step(self.low, self.high);
            let count = ((self.high - self.low) / step).round() as usize;
            return (0..=count)
                .map(|index| self.low + index as f64 * step)
                .map(|value| (value, label(value)))
                .collect();
        }
        let decades = (self.high / self.low).log10();
        let factors: &[f64] = if decades > 4.0 {
            &[1.0]
        } else if decades > 1.5 {
            &[1.0, 3.0]
        } else {
            &[1.0, 2.0, 5.0]
        };
        let mut ticks = Vec::new();
        for power in self.low.log10().floor() as i32..=self.high.log10().ceil() as i32 {
            for factor in factors {
                let value = factor * 10f64.powi(power);
                if (self.low..=self.high).contains(&value) {
                    ticks.push((value, label(value)));
                }
            }
        }
        ticks
    }
}

/// 1, 2 or 5 times a power of ten, for about six ticks.
fn tick_step(low: f64, high: f64) -> f64 {
    let rough = (high - low) / 6.0;
    let power = 10f64.powf(rough.log10().floor());
    let factor = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .find(|factor| factor * power >= rough)
        .unwrap_or(10.0);
    factor * power
}

/// A number without needless zeros.
pub fn label(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let magnitude = value.abs();
    if !(1e-3..1e5).contains(&magnitude) {
        return format!("{value:.0e}");
    }
    let digits = (2 - magnitude.log10().floor() as i32).clamp(0, 6) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// A plot under construction. The plot area is inset from the picture by fixed margins.
pub struct Axes {
    x: Scale,
    y: Scale,
    width: f64,
    height: f64,
    body: String,
}

const LEFT: f64 = 70.0;
const RIGHT: f64 = 16.0;
const TOP: f64 = 14.0;
const BOTTOM: f64 = 46.0;

impl Axes {
    pub fn new(width: f64, height: f64, x: Scale, y: Scale, x_label: &str, y_label: &str) -> Self {
        let mut axes = Self {
            x,
            y,
            width,
            height,
            body: String::new(),
        };
        let (right, bottom) = (width - RIGHT, height - BOTTOM);
        for (value, text) in x.ticks() {
            let at = axes.px(value);
            let _ = write!(
                axes.body,
                "<line class=\"grid\" x1=\"{at:.1}\" y1=\"{TOP}\" x2=\"{at:.1}\" y2=\"{bottom}\"/>"
            );
            axes.text(at, bottom + 16.0, "middle", "tick", &text);
        }
        for (value, text) in y.ticks() {
            let at = axes.py(value);
            let _ = write!(
                axes.body,
                "<line class=\"grid\" x1=\"{LEFT}\" y1=\"{at:.1}\" x2=\"{right}\" y2=\"{at:.1}\"/>"
            );
            axes.text(LEFT - 7.0, at + 4.0, "end", "tick", &text);
        }
        let _ = write!(
            axes.body,
            "<path class=\"frame\" d=\"M{LEFT} {TOP}V{bottom}H{right}\"/>"
        );
        axes.text(
            0.5 * (LEFT + right),
            height - 8.0,
            "middle",
            "label",
            x_label,
        );
        let (ly, middle) = (14.0, 0.5 * (TOP + bottom));
        let _ = write!(
            axes.body,
            "<text class=\"label\" text-anchor=\"middle\" transform=\"translate({ly} {middle}) rotate(-90)\">{}</text>",
            escape(y_label)
        );
        axes
    }

    pub fn px(&self, value: f64) -> f64 {
        LEFT + self.x.share(value) * (self.width - LEFT - RIGHT)
    }

    pub fn py(&self, value: f64) -> f64 {
        self.height - BOTTOM - self.y.share(value) * (self.height - TOP - BOTTOM)
    }

    /// Raw text at pixel coordinates.
    pub fn text(&mut self, x: f64, y: f64, anchor: &str, class: &str, text: &str) {
        let _ = write!(
            self.body,
            "<text class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{}</text>",
            escape(text)
        );
    }

    /// A line through data points.
    pub fn line(&mut self, points: &[(f64, f64)], stroke: &str, width: f64, dashed: bool) {
        let path: Vec<String> = points
            .iter()
            .map(|(x, y)| format!("{:.1} {:.1}", self.px(*x), self.py(*y)))
            .collect();
        let dash = if dashed {
            " stroke-dasharray=\"5 4\""
        } else {
            ""
        };
        let _ = write!(
            self.body,
            "<path d=\"M{}\" fill=\"none\" stroke=\"{stroke}\" stroke-width=\"{width}\" stroke-linejoin=\"round\"{dash}/>",
            path.join("L")
        );
    }

    /// The area between two curves over the same abscissae.
    pub fn area(&mut self, points: &[(f64, f64, f64)], fill: &str) {
        let up = points
            .iter()
            .map(|(x, low, _)| format!("{:.1} {:.1}", self.px(*x), self.py(*low)));
        let back = points
            .iter()
            .rev()
            .map(|(x, _, high)| format!("{:.1} {:.1}", self.px(*x), self.py(*high)));
        let path: Vec<String> = up.chain(back).collect();
        let _ = write!(
            self.body,
            "<path d=\"M{}Z\" fill=\"{fill}\" fill-opacity=\"0.16\"/>",
            path.join("L")
        );
    }

    /// A disc with a tooltip.
    pub fn disc(&mut self, x: f64, y: f64, radius: f64, fill: &str, hollow: bool, tip: &str) {
        let inside = if hollow { "#fff" } else { fill };
        let _ = write!(
            self.body,
            "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{radius}\" fill=\"{inside}\" stroke=\"{fill}\" stroke-width=\"2\"><title>{}</title></circle>",
            self.px(x),
            self.py(y),
            escape(tip)
        );
    }

    /// The plot as an SVG file of its own, on white, with a row of coloured names above it.
    pub fn standalone(mut self, keys: &[(&str, &str)]) -> String {
        const STYLE: &str = ".grid{stroke:#eceff2}.frame{stroke:#9aa5b1;fill:none}\
            text{font:12px 'DejaVu Sans',sans-serif;fill:#44505c}.label{font-size:13px;fill:#1d2733}";
        // Height of the row, and the width of a letter at the label's size.
        const ROW: f64 = 26.0;
        const LETTER: f64 = 7.6;
        let mut x = LEFT;
        for (name, fill) in keys {
            let _ = write!(
                self.body,
                "<rect x=\"{x:.0}\" y=\"-11\" width=\"14\" height=\"4\" fill=\"{fill}\"/>"
            );
            self.text(x + 20.0, -5.0, "start", "label", name);
            x += 20.0 + LETTER * name.chars().count() as f64 + 22.0;
        }
        let height = self.height + ROW;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 -{ROW} {0} {height}\" width=\"{0}\" height=\"{height}\">\
             <style>{STYLE}</style><rect y=\"-{ROW}\" width=\"{0}\" height=\"{height}\" fill=\"#fff\"/>{1}</svg>\n",
            self.width, self.body
        )
    }

    pub fn finish(self) -> String {
        format!(
            "<svg viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" role=\"img\">{2}</svg>",
            self.width, self.height, self.body
        )
    }
}

/// A legend above a plot: coloured keys with names.
pub fn legend(entries: &[(String, &str)]) -> String {
    let keys: Vec<String> = entries
        .iter()
        .map(|(name, colour)| {
            format!(
                "<span><i style=\"background:{colour}\"></i>{}</span>",
                escape(name)
            )
        })
        .collect();
    format!("<div class=\"legend\">{}</div>", keys.join(""))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_numbers_inside_the_axis() {
        let scale = Scale::linear(0.0, 8.0);
        let labels: Vec<String> = scale.ticks().into_iter().map(|tick| tick.1).collect();
        assert_eq!(labels, ["0", "2", "4", "6", "8"]);
        let scale = Scale::log([0.004, 3.0, f64::NAN, 0.0].into_iter());
        for (value, _) in scale.ticks() {
            assert!((0.0..=1.0).contains(&scale.share(value)) && value >= scale.low());
        }
        assert_eq!(scale.share(0.0), 0.0);
    }

    #[test]
    fn labels_have_no_needless_zeros() {
        assert_eq!(label(0.03), "0.03");
        assert_eq!(label(100.0), "100");
        assert_eq!(label(2.5), "2.5");
        assert_eq!(label(1e-6), "1e-6");
    }
}
