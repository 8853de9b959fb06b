//! Where tools may touch: the samples near them and on their ways, those that are pushed, and those that are held.

use ::contact::{Placed, SKIN_MM, SPACING_MM, Vector, pose};

use super::{ContactProblem, WHAT};
use crate::contact::buried::Buried;
use crate::contact::rows::{Moving, Pair, Row, outward};
use crate::contact::state::State;
use crate::contact::ties::NO_TOOL;
use crate::contact::tool::MAX_TOOLS;
use crate::error::Result;
use crate::memory;

pub(super) use crate::contact::rows::MOST_ROWS;

impl ContactProblem {
    /// Fills `rows`: samples near the tools at part `part` of their way, those that are pushed, and those that are held; at the end of the
    /// way also those that the tools have passed; `most` rows at most, and those of ties. `wide` takes all that the tools may reach as they move.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub(super) fn look(
        &mut self,
        state: State<'_>,
        part: f32,
        wide: bool,
        most: usize,
    ) -> Result<()> {
        let mut placed: [Option<Placed>; MAX_TOOLS] = [const { None }; MAX_TOOLS];
        for (index, (tool, from)) in self.tools.iter().zip(&self.before).enumerate() {
            // A tip finer than the spacing of the samples goes in between them: it is looked for as a point.
            if tool.body.sinks_between(SPACING_MM) {
                let at = pose::between(from, &tool.pose, part);
                let tip = Buried::tip(&tool.body, &at, &self.samples, state);
                self.buried[index] = tip.or(self.buried[index]);
            }
            // At the end of the way samples that the tool has passed are behind it, as far as it came.
            let motion = match wide || part >= 1.0 {
                true => tool.body.motion(from, &tool.pose),
                false => 0.0,
            };
            let depth = self.buried[index].map_or(0.0, |buried| buried.depth);
            placed[index] = Some(Placed {
                body: &tool.body,
                pose: pose::between(from, &tool.pose, part),
                skin: SKIN_MM + motion.max(depth),
            });
        }
        self.rows.clear();
        self.found = 0;
        self.shed.clear();
        // Gap, place and normal follow below, when each sample stands there once.
        let row = |tool: u32, sample: u32, force: Vector, far: bool| Row {
            tool,
            sample,
            force,
            far,
            gap: 0.0,
            point: Vector::ZERO,
            outward: Vector::ZERO,
        };
        for (index, placed) in placed.iter().flatten().enumerate() {
            let found = self
                .search
                .find(&self.samples, std::slice::from_ref(placed), |node| {
                    state.position(node)
                });
            let tool = index as u32;
            self.found += found.len();
            let anchors = self.next.tools[index].grasp.anchors();
            memory::reserve(&mut self.rows, found.len() + anchors.len() + 1, WHAT)?;
            let pair = Pair {
                body: placed.body,
                friction: 0.0,
                from: &self.before[index],
                now: &placed.pose,
                anchor: None,
                put: self.put[index],
                swept: self.swept[index],
                way_out: self.buried[index].map(|buried| buried.out),
            };
            let samples = &self.samples;
            let found = found.iter().filter(|found| {
                let start = || {
                    samples
                        .at(found.sample)
                        .gather(|node| state.position_before(node))
                };
                // Beyond the skin a sample counts only if the tool's way grazes it.
                wide || found.distance <= SKIN_MM || pair.may_reach(found.point, start())
            });
            self.rows
                .extend(found.map(|c| row(tool, c.sample, Vector::ZERO, c.distance > SKIN_MM)));
            let own = anchors.iter().map(|anchor| anchor.sample);
            let own = own.chain(self.buried[index].map(|buried| buried.row));
            self.rows
                .extend(own.map(|sample| row(tool, sample, Vector::ZERO, false)));
        }
        memory::reserve(&mut self.rows, self.next.forces.len(), WHAT)?;
        let pushed = self
            .next
            .forces
            .iter()
            .filter(|force| force.tool != NO_TOOL);
        self.rows
            .extend(pushed.map(|force| row(force.tool, force.sample, force.force, false)));
        // Those with a force come first of their equals, and stay; then those that are held.
        self.rows
            .sort_unstable_by_key(|row| (row.tool, row.sample, row.force == Vector::ZERO, row.far));
        self.rows.dedup_by_key(|row| (row.tool, row.sample));
        for row in &mut self.rows {
            let sample = self.samples.at(row.sample);
            row.point = sample.gather(|node| state.position(node));
            row.outward = outward(&self.samples, row.sample, state);
        }
        if !wide && self.rows.iter().any(|row| row.far) {
            let mut rows = std::mem::take(&mut self.rows);
            let moving = self.moving(state, part);
            rows.retain(|row| !row.far || moving.contact(row, part).gap <= SKIN_MM);
            self.rows = rows;
        }
        if self.rows.len() > most {
            memory::fit(&mut self.shed, self.rows.len() - most, WHAT)?;
            self.keep_deepest(state, part, most);
        }
        self.look_at_ties(state)
    }

    /// The tools at part `part` of their way.
    pub(super) fn moving<'a>(&'a self, state: State<'a>, part: f32) -> Moving<'a> {
        Moving {
            tools: &self.tools,
            before: &self.before,
            put: &self.put,
            swept: &self.swept,
            buried: &self.buried,
            held: &self.next.tools,
            samples: &self.samples,
            state,
            part,
            pulling: self.pulling(),
        }
    }

    /// Keeps `most` rows: those with a force first, then those deepest inside of their tool. Where they are fewer than [`MOST_ROWS`] those at nodes
    /// come first instead, which hold the tissue between them too, and forces of the others are shed.
    fn keep_deepest(&mut self, state: State<'_>, part: f32, most: usize) {
        let mut rows = std::mem::take(&mut self.rows);
        let mut shed_rows = std::mem::take(&mut self.shed);
        let moving = self.moving(state, part);
        let samples = &self.samples;
        for row in &mut rows {
            row.gap = moving.contact(row, part).gap;
        }
        rows.sort_unstable_by(|a, b| {
            let late = |row: &Row| match most < MOST_ROWS {
                true => samples.at(row.sample).entries().count() > 1 || row.gap > SKIN_MM,
                false => row.force == Vector::ZERO,
            };
            let order = late(a).cmp(&late(b)).then(a.gap.total_cmp(&b.gap));
            order.then(a.sample.cmp(&b.sample))
        });
        let shed = rows[most..].iter();
        shed_rows.extend(shed.filter(|row| row.force != Vector::ZERO));
        rows.truncate(most);
        rows.sort_unstable_by_key(|row| (row.tool, row.sample));
        (self.rows, self.shed) = (rows, shed_rows);
    }
}
