//! Where tools may touch: the samples near them and on their ways, those that are pushed, and those that are held.

use ::contact::{Placed, SKIN_MM, SPACING_MM, Vector};

use super::gauge::Gauge;
use super::surface::Surface;
use super::tie_set::TieSet;
use super::ways::ToolWays;
use crate::contact::past::Past;
use crate::contact::rows::WHAT;
use crate::contact::rows::{Pair, Row};
use crate::contact::state::State;
use crate::contact::ties::{NO_TOOL, Points};
use crate::contact::tool::MAX_TOOLS;
use crate::error::Result;
use crate::memory::{self, HeldBytes};

use crate::contact::rows::MOST_ROWS;

/// How a problem looks for rows.
#[derive(Clone, Copy)]
pub struct Look {
    /// The part of the tools' ways that they have gone.
    pub part: f32,
    /// All that the tools may reach as they move.
    pub wide: bool,
    /// Rows at most, and those of ties.
    pub most: usize,
}

/// The rows of a problem.
/// Made with room for the rows of two solves when the problem is, and filled anew by each look.
#[derive(HeldBytes)]
pub struct NearRows {
    /// What the last look found, ascending by tool and sample, then the ties.
    pub(in crate::contact) rows: Vec<Row>,
    /// Rows that a solve had no room for: their forces go.
    pub(in crate::contact) shed: Vec<Row>,
    /// Samples that the last look found.
    pub found: usize,
}

impl NearRows {
    /// Room for the rows of two solves.
    pub fn new() -> Result<NearRows> {
        Ok(NearRows {
            rows: memory::room(2 * MOST_ROWS, WHAT)?,
            shed: memory::room(2 * MOST_ROWS, WHAT)?,
            found: 0,
        })
    }

    /// Whether the last look of the step found rows, and all their nodes are where `is_there` says.
    pub fn lie(&self, points: Points<'_>, is_there: impl Fn(u32) -> bool) -> bool {
        let lies = |row: &Row| {
            points
                .at(row.sample)
                .entries()
                .all(|(node, _)| is_there(node))
        };
        !self.rows.is_empty() && self.rows.iter().all(lies)
    }

    /// Fills the rows: samples near the tools, those that are pushed, and those that are held; at the end of the
    /// way also those that the tools have passed; and those of ties. A thin tool that has pierced the surface since comes out where it did.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn look(
        &mut self,
        surface: &mut Surface,
        ways: &mut ToolWays,
        (tied, next): (&TieSet, &Past),
        state: State<'_>,
        look: Look,
    ) -> Result<()> {
        let Look { part, wide, most } = look;
        for index in 0..ways.tools.len() {
            // A tip finer than the spacing of the samples goes in between them: it is looked for as a point.
            let body = &ways.tools[index].body;
            if body.sinks_between(SPACING_MM) {
                let at = ways.pose(index, part);
                let tip = surface.tip(body, &at, state);
                ways.buried[index] = tip.or(ways.buried[index]);
            }
        }
        // From here on the ways are read only: rows are measured by them.
        let ways = &*ways;
        let mut placed: [Option<Placed>; MAX_TOOLS] = [const { None }; MAX_TOOLS];
        for (index, (tool, from)) in ways.tools.iter().zip(&ways.before).enumerate() {
            // At the end of the way samples that the tool has passed are behind it, as far as it came.
            let motion = match wide || part >= 1.0 {
                true => tool.body.motion(from, &tool.pose),
                false => 0.0,
            };
            let depth = ways.buried[index].map_or(0.0, |buried| buried.depth);
            // The skin is widened by how far the tool has come, or lies in the tissue: samples that
            // it has passed are that far behind its surface.
            placed[index] = Some(Placed {
                body: &tool.body,
                pose: ways.pose(index, part),
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
            is_wall: false,
        };
        let Surface {
            samples, search, ..
        } = surface;
        for (index, placed) in placed.iter().flatten().enumerate() {
            let found = search.find(samples, std::slice::from_ref(placed), |node| {
                state.position(node)
            });
            let tool = index as u32;
            self.found += found.len();
            let anchors = next.tools[index].grasp.anchors();
            memory::reserve(&mut self.rows, found.len() + anchors.len() + 1, WHAT)?;
            let pair = Pair {
                body: placed.body,
                friction: 0.0,
                from: &ways.before[index],
                now: &placed.pose,
                anchor: None,
                put: ways.put[index],
                swept: ways.swept[index],
                way_out: ways.buried[index].map(|buried| buried.out),
                is_wall: false,
            };
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
            let own = own.chain(ways.buried[index].map(|buried| buried.row));
            self.rows
                .extend(own.map(|sample| row(tool, sample, Vector::ZERO, false)));
        }
        memory::reserve(&mut self.rows, next.forces.len(), WHAT)?;
        let pushed = next.forces.iter().filter(|force| force.tool != NO_TOOL);
        self.rows
            .extend(pushed.map(|force| row(force.tool, force.sample, force.force, false)));
        // Those with a force come first of their equals, and stay; then those that are held.
        self.rows
            // `dedup_by_key` keeps the first of its equals, so a row keeps the force that it had.
            .sort_unstable_by_key(|row| (row.tool, row.sample, row.force == Vector::ZERO, row.far));
        self.rows.dedup_by_key(|row| (row.tool, row.sample));
        for row in &mut self.rows {
            let sample = samples.at(row.sample);
            row.point = sample.gather(|node| state.position(node));
            row.outward = samples.outward(row.sample, |node| state.position(node));
            row.is_wall = samples.is_on_wall(row.sample);
        }
        // A sample beyond the skin is a row only where the tool has come as near on its way.
        let gauge = Gauge {
            samples,
            ways,
            tied,
            next,
        };
        if !wide && self.rows.iter().any(|row| row.far) {
            let moving = gauge.moving(state, part);
            self.rows
                .retain(|row| !row.far || moving.contact(row, part).gap <= SKIN_MM);
        }
        // One solve costs the square of its rows: a tool as large as the organ leaves what lies less deep to the next solve.
        if self.rows.len() > most {
            memory::fit(&mut self.shed, self.rows.len() - most, WHAT)?;
            // Forces of rows that are left out are taken off the tissue, not forgotten on it:
            // `shed` names them.
            self.keep_deepest(gauge, state, part, most);
        }
        tied.add_rows((ways, next), state, &mut self.rows)
    }

    /// Keeps `most` rows: those with a force first, then those deepest inside of their tool. Where they are fewer than [`MOST_ROWS`] those at nodes
    /// come first instead, which hold the tissue between them too, and forces of the others are shed.
    fn keep_deepest(&mut self, gauge: Gauge<'_>, state: State<'_>, part: f32, most: usize) {
        let moving = gauge.moving(state, part);
        for row in &mut self.rows {
            row.gap = moving.contact(row, part).gap;
        }
        // Which ones is all that is asked: they are sorted below.
        self.rows.select_nth_unstable_by(most, |a, b| {
            let late = |row: &Row| match most < MOST_ROWS {
                true => gauge.samples.at(row.sample).entries().count() > 1 || row.gap > SKIN_MM,
                false => row.force == Vector::ZERO,
            };
            let order = late(a).cmp(&late(b)).then(a.gap.total_cmp(&b.gap));
            order.then((a.sample, a.tool).cmp(&(b.sample, b.tool)))
        });
        let shed = self.rows[most..].iter();
        self.shed
            .extend(shed.filter(|row| row.force != Vector::ZERO));
        self.rows.truncate(most);
        self.rows.sort_unstable_by_key(|row| (row.tool, row.sample));
    }
}

#[cfg(test)]
mod tests {
    use ::contact::Samples;

    use super::*;

    /// What a step decodes for the contact depends on it: a row that lies elsewhere would be measured where its nodes have not been put.
    #[test]
    fn rows_lie_where_all_of_their_nodes_do() {
        let places = [
            [0.0f32, 0.0, 0.0],
            [2.0, 0.0, 0.0],
            [0.0, 2.0, 0.0],
            [2.0, 2.0, 0.0],
        ];
        let faces = [[0, 1, 2], [1, 3, 2]];
        let samples = Samples::new(&places, faces, &[], SPACING_MM);
        let ties = TieSet::default();
        let mut near = NearRows::new().unwrap();
        let lies = |near: &NearRows, is_there: &dyn Fn(u32) -> bool| {
            near.lie(ties.points(&samples), is_there)
        };
        assert!(
            !lies(&near, &|_| true),
            "a look that found nothing says nothing"
        );
        let row = |sample: u32| Row {
            tool: 0,
            sample,
            force: Vector::ZERO,
            far: false,
            gap: 0.0,
            point: Vector::ZERO,
            outward: Vector::ZERO,
            is_wall: false,
        };
        for sample in 0..samples.len() as u32 {
            near.rows = vec![row(0), row(sample)];
            assert!(lies(&near, &|_| true));
            let own = |sample| -> Vec<u32> {
                samples.at(sample).entries().map(|entry| entry.0).collect()
            };
            for node in [own(0), own(sample)].concat() {
                assert!(
                    !lies(&near, &|other| other != node),
                    "sample {sample}, node {node}"
                );
            }
        }
    }
}
