//! Frames of tissue that relaxes.

use super::*;
use fixture::relaxing;

/// Frames lead from step to step where a tool is held in tissue that relaxes, and after it has gone.
#[test]
fn frames_follow_tissue_that_relaxes() {
    let branches = serde_json::json!([{"share": 0.4, "tau_s": 0.1}, {"share": 0.3, "tau_s": 0.8}]);
    let (_folder, model) = relaxing(branches, 1.0);
    let scene = scene(&model, &corrected());
    let depth = |t: f64| match t {
        t if t <= 6.0 => t,
        t if t <= 24.0 => 6.0,
        _ => -60.0,
    };
    let mut last = step(&scene, &pressing(&scene, 1.0));
    let (mut of_frames, mut of_last) = ([0.0f32; 2], [0.0f32; 2]);
    for t in 2..60 {
        let tools = pressing(&scene, depth(f64::from(t)));
        let shown = present(&scene, DT, &tools);
        let next = step(&scene, &tools);
        let phase = match t {
            10..=24 => 0,
            30.. => 1,
            _ => 2,
        };
        if phase < 2 {
            of_frames[phase] = of_frames[phase].max(farthest(&shown, &next));
            of_last[phase] = of_last[phase].max(farthest(&last, &next));
        }
        last = next;
    }
    for (frames, last) in of_frames.iter().zip(of_last) {
        assert!(
            *frames < 0.9 * last && last < 0.1,
            "{of_frames:?} {of_last:?} mm"
        );
    }
}
