//! What a near set and iterations in it cost, counted: the same on every machine, for steps whose work is bounded.

use super::near::NearSet;

/// Work of a near set for each of its nodes, and of its factor, with the columns that a contact asks of it, for each node of the core; in multiplications of contact
/// solves, of which a millisecond makes some four million.
const SET_WORK: u64 = 14_000;
const FACTOR_WORK: u64 = 100_000;
/// Of a base, of a direction with its contact, and of a part of one that is tried, for each node of the set.
const BASE_WORK: u64 = 4_000;
const DIRECTION_WORK: u64 = 4_000;
const TRY_WORK: u64 = 2_400;

impl NearSet {
    /// Work of making it, and of its factor.
    pub(super) fn making_work(&self) -> u64 {
        SET_WORK * self.places.nodes.len() as u64 + self.factor_work()
    }

    pub(super) fn factor_work(&self) -> u64 {
        FACTOR_WORK * self.places.core as u64
    }

    pub(super) fn base_work(&self) -> u64 {
        BASE_WORK * self.places.nodes.len() as u64
    }

    pub(super) fn direction_work(&self) -> u64 {
        DIRECTION_WORK * self.places.nodes.len() as u64
    }

    pub(super) fn try_work(&self) -> u64 {
        TRY_WORK * self.places.nodes.len() as u64
    }
}
