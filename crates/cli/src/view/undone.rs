//! Bodies before strokes, for undo.

/// Strokes that can be undone, and the bytes that bodies before them hold: the last one stays, however large.
const MOST_UNDONE: usize = 16;
const MOST_UNDONE_BYTES: usize = 64 << 20;

/// What all strokes so far have done.
#[derive(Clone, Copy, Debug, Default)]
pub struct Account {
    pub area_mm2: f32,
    pub removed_mm3: f32,
    pub copies: u32,
}

/// A body before a stroke.
pub struct Before {
    pub snapshot: Vec<u8>,
    pub account: Account,
    /// By element: it was coagulated.
    pub hard: Vec<bool>,
}

impl Before {
    fn bytes(&self) -> usize {
        self.snapshot.len() + self.hard.len()
    }
}

/// Adds a body, and forgets the oldest beyond what may be kept.
pub fn keep(undone: &mut Vec<Before>, before: Before) {
    undone.push(before);
    let bytes = |undone: &[Before]| undone.iter().map(Before::bytes).sum::<usize>();
    while undone.len() > 1 && (undone.len() > MOST_UNDONE || bytes(undone) > MOST_UNDONE_BYTES) {
        undone.remove(0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_before_strokes_hold_no_more_than_their_room() {
        let before = |bytes: usize| Before {
            snapshot: vec![0; bytes],
            account: Account::default(),
            hard: Vec::new(),
        };
        let kept = |bytes: usize, count: usize| {
            let mut undone = Vec::new();
            (0..count).for_each(|_| keep(&mut undone, before(bytes)));
            undone.len()
        };
        assert_eq!(kept(1000, 20), MOST_UNDONE);
        assert_eq!(kept(MOST_UNDONE_BYTES / 3, 9), 3);
        assert_eq!(kept(MOST_UNDONE_BYTES + 1, 2), 1);
    }
}
