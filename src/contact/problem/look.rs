//! Where tools may touch: the samples near them, those that are pushed, and those that are held.

use ::contact::{Placed, SKIN_MM, Vector, pose};

use super::{Problem, WHAT};
use crate::contact::past::Force;
use crate::contact::rows::{Moving, Row, State, outward};
use crate::contact::tool::MAX_TOOLS;
use crate::error::Result;
use crate::memory;

/// Samples that one solve may have: what a tool as large as the organ touches beyond these is left to the next solve.
pub(super) const MOST_ROWS: usize = 256;

impl Problem {
    /// Fills `rows`: samples near the tools at part `part` of their way, those that are pushed, and those that are held. `wide`
    /// looks as far as the tools move.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub(super) fn look(&mut self, state: State<'_>, part: f32, wide: bool) -> Result<()> {
        let mut placed: [Option<Placed>; MAX_TOOLS] = [const { None }; MAX_TOOLS];
        for (place, (tool, from)) in placed.iter_mut().zip(self.tools.iter().zip(&self.before)) {
            let motion = match wide {
                true => tool.body.motion(from, &tool.pose),
                false => 0.0,
            };
            *place = Some(Placed {
                body: &tool.body,
                pose: pose::between(from, &tool.pose, part),
                skin: SKIN_MM + motion,
            });
        }
        self.rows.clear();
        let row = |tool: u32, sample: u32, force: Vector| Row {
            tool,
            sample,
            force,
            point: Vector::ZERO,
            outward: Vector::ZERO,
        };
        for (index, placed) in placed.iter().flatten().enumerate() {
            let found = self
                .search
                .find(&self.samples, std::slice::from_ref(placed), |node| {
                    state.position(node)
                });
            let anchors = self.next.tools[index].grasp.anchors();
            memory::reserve(&mut self.rows, found.len() + anchors.len(), WHAT)?;
            let samples = found.iter().map(|c| c.sample);
            let samples = samples.chain(anchors.iter().map(|anchor| anchor.sample));
            self.rows
                .extend(samples.map(|sample| row(index as u32, sample, Vector::ZERO)));
        }
        memory::reserve(&mut self.rows, self.next.forces.len(), WHAT)?;
        let pushed = self.next.forces.iter();
        self.rows
            .extend(pushed.map(|force| row(force.tool, force.sample, force.force)));
        // Those with a force come first of their equals, and stay.
        self.rows
            .sort_unstable_by_key(|row| (row.tool, row.sample, row.force == Vector::ZERO));
        self.rows.dedup_by_key(|row| (row.tool, row.sample));
        for row in &mut self.rows {
            let sample = self.samples.rows()[row.sample as usize];
            row.point = sample.gather(|node| state.position(node));
            row.outward = outward(&self.samples, row.sample, state);
        }
        if self.rows.len() > MOST_ROWS {
            self.keep_nearest(part);
        }
        Ok(())
    }

    /// Keeps [`MOST_ROWS`] rows: those with a force first, then those deepest inside of their tool.
    fn keep_nearest(&mut self, part: f32) {
        let depth = |row: &Row| match self.tools.get(row.tool as usize) {
            Some(tool) => {
                let from = &self.before[row.tool as usize];
                let pose = pose::between(from, &tool.pose, part);
                tool.body.nearest_at(&pose, row.point).distance
            }
            None => f32::MAX,
        };
        let rank = |row: &Row| (row.force == Vector::ZERO, depth(row), row.sample);
        self.rows.sort_unstable_by(|a, b| {
            let ((a0, a1, a2), (b0, b1, b2)) = (rank(a), rank(b));
            a0.cmp(&b0).then(a1.total_cmp(&b1)).then(a2.cmp(&b2))
        });
        self.rows.truncate(MOST_ROWS);
        self.rows.sort_unstable_by_key(|row| (row.tool, row.sample));
    }

    /// How deep the deepest sample lies inside of a tool at its end, the way that it has to come out, mm; 0 where none does.
    pub(super) fn deepest(&mut self, index: usize, state: State<'_>) -> f32 {
        let tool = &self.tools[index];
        let placed = Placed {
            body: &tool.body,
            pose: tool.pose,
            skin: 0.0,
        };
        let search = &mut self.search;
        search.find(&self.samples, &[placed], |node| state.position(node));
        let moving = Moving {
            tools: &self.tools,
            before: &self.before,
            put: &self.put,
            held: &self.next.tools,
            samples: &self.samples,
            state,
            part: 1.0,
        };
        let depths = self.search.found().iter().map(|candidate| {
            let (tool, sample) = (index as u32, candidate.sample);
            let place = self
                .next
                .forces
                .binary_search_by_key(&(tool, sample), Force::key);
            let row = Row {
                tool,
                sample,
                force: place.map_or(Vector::ZERO, |at| self.next.forces[at].force),
                point: candidate.point,
                outward: outward(&self.samples, sample, state),
            };
            // What no tool touches, because it is reached from within, lies in it all the same.
            (-moving.contact(&row, 1.0).gap).max(-candidate.distance)
        });
        depths.fold(0.0, f32::max)
    }
}
