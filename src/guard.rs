//! The guard: what a decoded state must satisfy before it is published. Finite, bounded, no growth without cause,
//! and by option no inverted element.
//!
//! REQ-020: A state that is not finite or passes the bound is not published; the last good one stays.
//!
//! REQ-021: Inputs that are not numbers are refused, and nothing changes.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::bundle::volume;
use crate::error::Result;
use crate::kernels::Pool;
use crate::stats::flag;

/// Flags that make the guard refuse a state.
pub const REFUSED: u32 = flag::BOUND | flag::NON_FINITE | flag::INVERTED | flag::GROWTH;

/// A step may enlarge the largest displacement, or overshoot the largest imposed one, by this
/// factor ...
const GROWTH_FACTOR: f32 = 1.6;
/// ... and by this much, mm: a body at rest has no size to grow from.
const GROWTH_FLOOR: f32 = 2.0;
/// Elements of a chunk of work.
const CHUNK: usize = 4096;

/// Flags of a state whose largest displacement is `max_now` after one of `max_before`, with `max_push` imposed.
pub fn judge(bound: f32, max_now: f32, max_before: f32, max_push: f32) -> u32 {
    if !max_now.is_finite() {
        return flag::NON_FINITE;
    }
    let mut flags = 0;
    if max_now > bound {
        flags |= flag::BOUND;
    }
    if max_now > GROWTH_FACTOR * max_before.max(max_push) + GROWTH_FLOOR {
        flags |= flag::GROWTH;
    }
    flags
}

/// Whether any of the tetrahedra `[n,4]` has no positive volume in the deformed state.
pub fn inverted(pool: &Pool, positions: &[f32], field: &[f32], tets: &[u32]) -> Result<bool> {
    let found = AtomicBool::new(false);
    let count = tets.len() / 4;
    pool.run(count.div_ceil(CHUNK), &|chunk, _| {
        let mut corners = [0.0f32; 12];
        for tet in
            tets[4 * chunk * CHUNK..(4 * (chunk + 1) * CHUNK).min(tets.len())].chunks_exact(4)
        {
            for (corner, &node) in corners.chunks_exact_mut(3).zip(tet) {
                let at = 3 * node as usize;
                for (x, (p, u)) in corner
                    .iter_mut()
                    .zip(positions[at..].iter().zip(&field[at..]))
                {
                    *x = p + u;
                }
            }
            if volume(&corners, &[0, 1, 2, 3]) <= 0.0 {
                // Which thread finds it does not matter: the answer is one bit.
                found.store(true, Ordering::Relaxed);
            }
        }
    })?;
    Ok(found.into_inner())
}

/// What a refusal says.
pub fn describe(flags: u32, max: f32, bound: f32) -> String {
    let mut reasons = Vec::new();
    if flags & flag::NON_FINITE != 0 {
        reasons.push("a displacement is not finite".to_owned());
    }
    if flags & flag::BOUND != 0 {
        reasons.push(format!(
            "largest displacement {max} mm is beyond the bound {bound} mm"
        ));
    }
    if flags & flag::GROWTH != 0 {
        reasons.push(format!(
            "largest displacement grew to {max} mm without cause"
        ));
    }
    if flags & flag::INVERTED != 0 {
        reasons.push("an element is inverted".to_owned());
    }
    format!("{}; the last good state stays", reasons.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn judge_allows_a_push_and_refuses_growth() {
        assert_eq!(judge(30.0, 15.0, 0.0, 15.0), 0);
        assert_eq!(judge(30.0, 31.0, 29.0, 0.0), flag::BOUND);
        assert_eq!(judge(30.0, 9.0, 1.0, 0.0), flag::GROWTH);
        assert_eq!(judge(30.0, f32::NAN, 1.0, 0.0), flag::NON_FINITE);
    }

    #[test]
    fn an_inverted_element_is_found() {
        let pool = Pool::new(1).unwrap();
        let positions = [0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.];
        let mut field = [0.0; 12];
        assert!(!inverted(&pool, &positions, &field, &[0, 1, 2, 3]).unwrap());
        field[11] = -1.5;
        assert!(inverted(&pool, &positions, &field, &[0, 1, 2, 3]).unwrap());
    }
}
