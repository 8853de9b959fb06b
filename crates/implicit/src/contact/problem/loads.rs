//! What the forces of a solve mean: loads on the tissue's nodes, and what the tools feel of them.

use ::contact::Vector;
use ::contact::grasp::tension;

use super::ContactProblem;
use crate::contact::past::Force;
use crate::contact::state::{State, vector};
use crate::contact::ties::NO_TOOL;
use crate::contact::tool::{ContactReport, Push, ToolReading};

/// No grasp pulls harder than this, mN: soft tissue tears before.
const STRONGEST_GRASP_MN: f32 = 10_000.0;

impl ContactProblem {
    /// Nodes of the samples that push and of the ties, ascending, without held ones.
    pub fn reached(&mut self, held: &[bool]) -> &[u32] {
        self.gather_touched(held);
        let of_step = (&self.ways, &self.next);
        (self.tied).add_nodes(of_step, held, &mut self.prescribed.nodes);
        self.prescribed.sorted()
    }

    /// Nodes of the samples that push, ascending, without held ones.
    pub fn touched(&mut self, held: &[bool]) -> &[u32] {
        self.gather_touched(held);
        self.prescribed.sorted()
    }

    /// Nodes of the samples that push, without held ones, in no order and perhaps twice.
    /// Ties are left out: `touched` is what a host is shown as contact, and `reached` adds them for
    /// the solver.
    fn gather_touched(&mut self, held: &[bool]) {
        let nodes = &mut self.prescribed.nodes;
        nodes.clear();
        let forces = self.next.forces.iter();
        for force in forces.filter(|force| force.tool != NO_TOOL) {
            let sample = self.surface.samples.at(force.sample);
            let own = sample.entries().map(|entry| entry.0);
            // A force on a held node is borne by the bone or the table and moves nothing.
            nodes.extend(own.filter(|node| !held[*node as usize]));
        }
    }

    /// Calls with each node's share of the forces on the tissue, mN.
    pub fn each_load(&self, take: impl FnMut(u32, Vector)) {
        self.each_nodal_force(&self.next.forces, take);
    }

    /// Calls with each node's share of the forces of the last published step, mN.
    pub fn each_push(&self, take: impl FnMut(u32, Vector)) {
        self.each_nodal_force(&self.past.forces, take);
    }

    /// `B^T f`: each row's force, mN, by the weights of its nodes; a node that several rows have is called several times.
    fn each_nodal_force(&self, forces: &[Force], mut take: impl FnMut(u32, Vector)) {
        let points = self.tied.points(&self.surface.samples);
        for force in forces {
            for (node, weight) in points.at(force.sample).entries() {
                take(node, force.force * weight);
            }
        }
    }

    /// Sums up what each tool feels at `state`, the end of the step, and tears grasps that are pulled too hard; with `breaks` ties break
    /// that are pulled too hard.
    pub fn finish(&mut self, state: State<'_>, breaks: bool) {
        self.tied.finish(&self.ways, &mut self.next, state, breaks);
        for index in 0..self.ways.tools.len() {
            let penetration_mm = self.depths().depth(index, state, 1.0);
            let tool = &self.ways.tools[index];
            let (mut force, mut torque) = (Vector::ZERO, Vector::ZERO);
            // What a grasp bears is the pull along the mean normal of its jaws: pressure holds it, tension tears it.
            let (mut pull, mut normal) = (Vector::ZERO, Vector::ZERO);
            let mut contacts = 0;
            let held = &self.next.tools[index];
            for row in self.next.forces.iter().filter(|f| f.tool == index as u32) {
                let point = (self.surface.samples)
                    .at(row.sample)
                    .gather(|n| state.position(n));
                // `row.force` is on the tissue, and the tool feels the opposite.
                force -= row.force;
                // About the origin of the tool's pose, mN mm.
                torque -= (point - tool.pose.translation).cross(row.force);
                contacts += 1;
                if held.grasp.place(row.sample).is_some() {
                    pull += row.force;
                    normal += tool.body.nearest_at(&tool.pose, point).normal;
                }
            }
            let (tied, turned) = (self.tied).pull_on(index as u32, &self.ways, &self.next);
            force += tied;
            torque += turned;
            let held = &mut self.next.tools[index];
            let pull = tension(pull, normal.normalize_or_zero());
            let tear_off = match tool.tear_off_mn > 0.0 {
                true => tool.tear_off_mn,
                false => STRONGEST_GRASP_MN,
            };
            // Torn stays torn, though the step may be made again with less pull.
            let torn = held.reading.torn || held.grasp.tear(pull, tear_off);
            held.reading = ToolReading {
                force: force.to_array(),
                torque: torque.to_array(),
                contacts,
                penetration_mm,
                torn,
                residual_mm: match contacts {
                    0 => 0.0,
                    _ => self.solution.unsolved_mm,
                },
            };
        }
    }

    /// Makes the last step's readings and forces readable; displacements `[K,3]`, mm.
    pub fn report(&self, report: &mut ContactReport, rest: &[f32], u: &[f32]) {
        report.clear();
        report
            .readings
            .extend(self.past.tools.iter().map(|held| held.reading));
        report
            .ties
            .extend(self.past.ties.iter().map(|held| held.reading));
        let own = self.past.forces.iter();
        for force in own.filter(|force| force.tool != NO_TOOL) {
            let sample = self.surface.samples.at(force.sample);
            report.pushes.push(Push {
                tool: force.tool,
                point: sample
                    .gather(|node| vector(rest, node) + vector(u, node))
                    .to_array(),
                force: (-force.force).to_array(),
            });
        }
    }
}
