//! From cases to limits: sizes, depth, speed and number of the tools.

use contact::Samples;
use serde::Serialize;
use serde_json::{Value, json};

use yardstick::CaseFigures;
use yardstick::cases::ToolCase;

/// One case, in the terms of the limits.
#[derive(Clone, Debug, Serialize)]
pub struct Tried {
    pub case: String,
    pub programme: String,
    /// Smallest and largest of half the smallest extent of its tools, mm.
    pub size_mm: [f32; 2],
    /// Largest displacement of a node that a tool pushes, mm.
    pub depth_mm: f32,
    /// Of the fastest point of a tool that touches, mm/s.
    pub speed_mm_s: f32,
    /// Tools that push at once.
    pub count: usize,
    pub mse_mm2: f64,
    /// The worst of its tools.
    pub force_error: Option<f64>,
    pub good: bool,
}

impl Tried {
    /// None where no tool touches.
    pub fn of(
        case: &ToolCase,
        samples: &Samples,
        figures: &CaseFigures,
        good: bool,
    ) -> Option<Self> {
        let mut tried = Self {
            case: case.name.clone(),
            programme: case.programme.clone(),
            size_mm: [f32::INFINITY, 0.0],
            depth_mm: 0.0,
            speed_mm_s: 0.0,
            count: 0,
            mse_mm2: figures.mse_mm2,
            force_error: figures.force_error.iter().copied().reduce(f64::max),
            good,
        };
        for frame in 1..case.poses.len() {
            tried.add(case, samples, frame);
        }
        (tried.count > 0).then_some(tried)
    }

    fn add(&mut self, case: &ToolCase, samples: &Samples, frame: usize) {
        let tracks = case.tracks();
        let tools = case.bodies.len();
        let mut count = 0;
        for (tool, body) in case.bodies.iter().enumerate() {
            if tracks.contacts[frame * tools + tool] == 0 {
                continue;
            }
            count += 1;
            let [low, high] = self.size_mm;
            self.size_mm = [low.min(body.size()), high.max(body.size())];
            let [from, to] = [frame - 1, frame].map(|frame| &case.poses[frame][tool].pose);
            let speed = body.motion(from, to) / case.trajectory.header.dt_s as f32;
            self.speed_mm_s = self.speed_mm_s.max(speed);
        }
        self.count = self.count.max(count);
        for node in case.pushed_nodes(frame, samples) {
            let u = case.trajectory.frame(frame)[node as usize];
            let length = u.iter().map(|x| x * x).sum::<f32>().sqrt();
            self.depth_mm = self.depth_mm.max(length);
        }
    }
}

/// The tools that a bundle is good for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    pub size_mm: [f32; 2],
    pub depth_mm: f32,
    pub speed_mm_s: f32,
    pub count: usize,
}

impl Limits {
    pub fn holds(&self, case: &Tried) -> bool {
        case.size_mm[0] >= self.size_mm[0]
            && case.size_mm[1] <= self.size_mm[1]
            && case.depth_mm <= self.depth_mm
            && case.speed_mm_s <= self.speed_mm_s
            && case.count <= self.count
    }

    /// The limits that hold the most good cases, with a share of worse ones that is at most `share`; none where nothing is good.
    /// Limits are values of good cases.
    pub fn widest(cases: &[Tried], share: f64) -> Option<Self> {
        let good: Vec<&Tried> = cases.iter().filter(|case| case.good).collect();
        let values = |value: fn(&Tried) -> f32| {
            let mut values: Vec<f32> = good.iter().map(|case| value(case)).collect();
            values.sort_by(f32::total_cmp);
            values.dedup();
            values
        };
        let counts = values(|case| case.count as f32);
        let (lows, highs) = (
            values(|case| case.size_mm[0]),
            values(|case| case.size_mm[1]),
        );
        let (depths, speeds) = (values(|case| case.depth_mm), values(|case| case.speed_mm_s));
        let mut best: Option<(usize, Self)> = None;
        for &count in counts.iter().rev() {
            for &low in &lows {
                for &high in highs.iter().rev() {
                    for &depth_mm in depths.iter().rev() {
                        for &speed_mm_s in speeds.iter().rev() {
                            let limits = Self {
                                size_mm: [low, high],
                                depth_mm,
                                speed_mm_s,
                                count: count as usize,
                            };
                            let [inside, bad] = limits.count(cases);
                            // Speeds descend: fewer cases from here on.
                            if best.is_some_and(|(most, _)| inside - bad <= most) {
                                break;
                            }
                            if bad as f64 <= share * inside as f64 {
                                best = Some((inside - bad, limits));
                                break;
                            }
                        }
                    }
                }
            }
        }
        best.map(|(_, limits)| limits)
    }

    /// Cases inside, and those of them that are not good.
    pub fn count(&self, cases: &[Tried]) -> [usize; 2] {
        let inside = cases.iter().filter(|case| self.holds(case));
        inside.fold([0, 0], |[all, bad], case| {
            [all + 1, bad + usize::from(!case.good)]
        })
    }

    /// The manifest's entry. Outwards to whole tenths, so that the cases stay inside.
    pub fn entry(&self, corrections: u32) -> Value {
        let tenth = |value: f32, round: fn(f64) -> f64| round(f64::from(value) * 10.0) / 10.0;
        json!({
            "corrections": corrections,
            "size_mm": [tenth(self.size_mm[0], f64::floor), tenth(self.size_mm[1], f64::ceil)],
            "depth_mm": tenth(self.depth_mm, f64::ceil),
            "speed_mm_s": tenth(self.speed_mm_s, f64::ceil),
            "max_tools": self.count,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn case(size: f32, depth_mm: f32, speed_mm_s: f32, good: bool) -> Tried {
        Tried {
            case: String::new(),
            programme: String::new(),
            size_mm: [size, size],
            depth_mm,
            speed_mm_s,
            count: 1,
            mse_mm2: 0.0,
            force_error: None,
            good,
        }
    }

    #[test]
    fn limits_end_before_the_case_that_is_too_deep() {
        let cases = [
            case(2.0, 3.0, 10.0, true),
            case(6.0, 9.0, 50.0, true),
            case(4.0, 12.0, 20.0, false),
            case(4.0, 11.0, 80.0, true),
        ];
        let limits = Limits::widest(&cases, 0.0).unwrap();
        assert_eq!(limits.size_mm, [2.0, 6.0]);
        assert_eq!((limits.depth_mm, limits.speed_mm_s), (11.0, 80.0));
        assert_eq!(limits.count(&cases), [3, 0]);
        // Thin tools alone are bad: the range of sizes leaves them out.
        let thin = [
            case(1.0, 3.0, 10.0, false),
            case(2.0, 3.0, 10.0, true),
            case(1.5, 2.0, 5.0, false),
        ];
        assert_eq!(Limits::widest(&thin, 0.0).unwrap().size_mm, [2.0, 2.0]);
        assert_eq!(Limits::widest(&thin[..1], 0.0), None);
    }

    #[test]
    fn a_share_of_worse_cases_may_lie_inside() {
        let mut cases: Vec<Tried> = (1..=20).map(|i| case(4.0, i as f32, 10.0, true)).collect();
        cases[9].good = false;
        assert_eq!(Limits::widest(&cases, 0.0).unwrap().depth_mm, 9.0);
        assert_eq!(Limits::widest(&cases, 0.05).unwrap().depth_mm, 20.0);
    }
}
