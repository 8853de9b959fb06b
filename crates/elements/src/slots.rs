//! Passes over a chunk's slots: where nodes are, and where the step takes them. Nodes are `[x, y, z, w]`.

use lanes::{NodeLanes, WIDTH};

/// Floating-point operations of one node in `place` and `advance`, a fused multiply-add counted as two.
pub const FLOPS_PER_NODE: usize = 3 + 3 * 6;

/// Slots are padded to a multiple of this, a register's worth at most.
pub const PADDED: usize = 4;

/// `positions = rest + displacement`, `count` nodes rounded up to [`PADDED`]; the fourth component of `rest` is zero.
#[inline(always)]
pub unsafe fn place<L: NodeLanes>(
    count: usize,
    rest: *const [f32; 4],
    displacement: *const [f32; 4],
    positions: *mut [f32; 4],
) {
    // SAFETY: the caller's.
    unsafe {
        for at in (0..4 * count.next_multiple_of(PADDED)).step_by(L::COUNT) {
            let sum = L::load(rest.cast::<f32>().add(at));
            sum.add(L::load(displacement.cast::<f32>().add(at)))
                .store(positions.cast::<f32>().add(at));
        }
    }
}

/// `d <- beta d + g f`, `u <- u + d` for `count` nodes rounded up to [`PADDED`], with `g` the fourth component of `d`.
///
/// The fourth components, gain and dilatation, stay.
#[inline(always)]
/// `g` is zero at a node that is held, which then keeps its place.
pub unsafe fn advance<L: NodeLanes>(
    count: usize,
    beta: f32,
    force: *const [f32; 4],
    increment: *mut [f32; 4],
    displacement: *mut [f32; 4],
) {
    // SAFETY: the caller's.
    unsafe {
        // One and nought in the fourth place keep whole vectors going.
        let beta: [f32; WIDTH] = std::array::from_fn(|k| if k % 4 == 3 { 1.0 } else { beta });
        let moves: [f32; WIDTH] = std::array::from_fn(|k| if k % 4 == 3 { 0.0 } else { 1.0 });
        let (beta, moves) = (L::load(beta.as_ptr()), L::load(moves.as_ptr()));
        for at in (0..4 * count.next_multiple_of(PADDED)).step_by(L::COUNT) {
            let force = L::load(force.cast::<f32>().add(at));
            let before = L::load(increment.cast::<f32>().add(at));
            let gain = before.fourth().mul(moves);
            let after = gain.mul_add(force, before.mul(beta));
            after.store(increment.cast::<f32>().add(at));
            let target = displacement.cast::<f32>().add(at);
            after.mul_add(moves, L::load(target)).store(target);
        }
    }
}
