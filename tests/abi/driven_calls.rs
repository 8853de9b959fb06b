//! Calls that take a `upt_input`: steps, submitted steps, frames.

use std::ptr::null;

use upt::ffi::*;

use super::inputs::*;
use super::tie_calls::ties;
use super::{Call, Function, Odd, World};

/// What an input's pointers lead to.
struct Lists {
    tools: Vec<upt_instrument>,
    nodes: Vec<u32>,
    vectors: Vec<f32>,
    field: Vec<f32>,
    pressures: Vec<upt_pressure>,
    point_forces: Vec<upt_point_force>,
    ties: Vec<upt_tie>,
}

impl World<'_> {
    /// Calls on a scene of `nodes` nodes.
    pub(super) fn call_driven(
        &mut self,
        call: &Call,
        scene: *mut upt_scene,
        nodes: usize,
    ) -> (&'static str, i32) {
        let lists = self.lists(call, nodes);
        let (mut input, drives) = input(call, &lists, nodes);
        // A count that cannot be right is refused before its list is touched, and so are two drives at once.
        let right = call.null == 7
            || input.instrument_count <= lists.tools.len() as u64
                && input.contact_count <= lists.nodes.len() as u64
                && input.pressure_count <= lists.pressures.len() as u64
                && input.tie_count <= lists.ties.len() as u64
                && input.point_force_count <= lists.point_forces.len() as u64
                && (input.pressure_count == 0
                    || lists.pressures[0].node_count <= lists.nodes.len() as u64)
                && drives < 2
                && input.reserved == [0; 4]
                && input.struct_size == size_of::<upt_input>() as u32;
        let refused = |status: i32| {
            assert!(right || status != UPT_OK, "a wrong input was taken");
            status
        };
        unsafe {
            match call.function {
                Function::Submit => {
                    let status = upt_scene_submit(scene, at(&input, call));
                    ("upt_scene_submit", refused(status))
                }
                Function::Step if call.seed.is_multiple_of(11) && !lists.nodes.is_empty() => {
                    // The output lies over the vectors, or over the nodes.
                    let mut memory = vec![0.0f32; (3 * nodes).max(lists.vectors.len())];
                    let over = memory.as_mut_ptr();
                    if call.seed.is_multiple_of(2) {
                        over.copy_from(lists.vectors.as_ptr(), lists.vectors.len());
                        input.contact_vectors = over;
                    } else {
                        over.cast::<u32>()
                            .copy_from(lists.nodes.as_ptr(), lists.nodes.len());
                        input.contact_nodes = over.cast();
                    }
                    let status = upt_scene_step(scene, at(&input, call), over, 3 * nodes as u64);
                    ("upt_scene_step", refused(status))
                }
                Function::Step => {
                    let status = Self::output(call, 2, 3 * nodes, true, |out, floats| {
                        upt_scene_step(scene, at(&input, call), out, floats)
                    });
                    ("upt_scene_step", refused(status))
                }
                Function::Present => {
                    let mut when = [(call.seed % 120) as f32 * 1e-3];
                    spoil(&mut when, call.odd, 0);
                    let when = when[0].into();
                    let (view, shown) = self.view(scene, call, nodes);
                    let view = view.as_ref().map_or(null(), |view| &raw const *view);
                    let status = Self::output(call, 1, 3 * shown, true, |out, floats| {
                        upt_scene_present(scene, at(&input, call), when, view, out, floats)
                    });
                    ("upt_scene_present", refused(status))
                }
                other => unreachable!("{other:?} takes no input"),
            }
        }
    }

    fn lists(&self, call: &Call, nodes: usize) -> Lists {
        let mut random = Random(call.seed | 1);
        let contacts = call.seed as usize % 7;
        let shift = call.seed as usize / 7;
        let mut listed: Vec<u32> = (0..contacts)
            .map(|i| ((shift + 5 * i) % nodes) as u32)
            .collect();
        if let (Odd::Wrong, Some(first)) = (call.odd, listed.first_mut()) {
            *first = if call.seed.is_multiple_of(2) {
                nodes as u32
            } else {
                u32::MAX
            };
        }
        let scale = if call.seed.is_multiple_of(5) {
            60.0
        } else {
            2.0
        };
        let mut vectors: Vec<f32> = (0..3 * contacts)
            .map(|_| scale * (random.next(2001) as f32 / 1000.0 - 1.0))
            .collect();
        spoil(&mut vectors, call.odd, call.seed as usize % 97);
        let mut field = vec![0.0; 3 * nodes];
        let at = call.seed as usize % (3 * nodes);
        field[at] = 1.5;
        spoil(&mut field, call.odd, at);
        let mut pascal = [40.0, -25.0];
        spoil(&mut pascal, call.odd, call.seed as usize % 5);
        let pressure = |pascal: f32| upt_pressure {
            struct_size: sized::<upt_pressure>(call),
            pascal,
            nodes: listed.as_ptr(),
            node_count: absurd(listed.len(), nodes, call),
        };
        let mut pulls = [2.0, -1.0, 0.5];
        spoil(&mut pulls, call.odd, call.seed as usize % 7);
        let wrong = call.odd == Odd::Wrong && call.seed.is_multiple_of(2);
        let point_force = |at: u32| upt_point_force {
            struct_size: sized::<upt_point_force>(call),
            nodes: [at, 1, 2, if wrong { u32::MAX } else { 3 }],
            weights: [[0.0; 4], [0.25; 4]][at as usize % 2],
            force: pulls,
        };
        Lists {
            point_forces: (0..3).map(point_force).collect(),
            pressures: pascal.map(pressure).into(),
            ties: ties(call, nodes),
            tools: self.instruments(call, 4),
            nodes: listed,
            vectors,
            field,
        }
    }
}

/// An input, mostly of one drive, and how many it has.
fn input(call: &Call, lists: &Lists, nodes: usize) -> (upt_input, usize) {
    let mut input = upt_input::NOTHING;
    input.struct_size = sized::<upt_input>(call);
    let kind = call.seed / 13 % 8;
    let two = call.odd == Odd::Wrong && call.seed.is_multiple_of(4);
    if kind < 3 || two {
        input.instruments = pointer(&lists.tools, call, 0);
        input.instrument_count = absurd(lists.tools.len(), 64, call);
    }
    if (3..6).contains(&kind) || two {
        input.contact_nodes = pointer(&lists.nodes, call, 0);
        input.contact_vectors = pointer(&lists.vectors, call, 1);
        input.contact_count = absurd(lists.nodes.len(), nodes, call);
    }
    if kind == 6 {
        input.collision = lists.field.as_ptr();
    }
    if kind > 3 && call.seed.is_multiple_of(3) {
        input.displacement = lists.field.as_ptr();
    }
    if call.odd == Odd::Wrong && call.seed.is_multiple_of(7) {
        input.reserved[3] = 1;
    }
    if (call.seed / 104).is_multiple_of(3) {
        load(&mut input, call, lists);
    }
    if (call.seed / 208).is_multiple_of(3) {
        input.ties = lists.ties.as_ptr();
        input.tie_count = absurd(lists.ties.len(), 256, call);
    }
    let mut time = [0.0];
    if call.seed.is_multiple_of(3) {
        spoil(&mut time, call.odd, 0);
    }
    input.time_s = time[0].into();
    let drives = [
        input.instrument_count != 0,
        input.contact_count != 0,
        !input.collision.is_null(),
    ];
    (input, drives.into_iter().filter(|&given| given).count())
}

/// Loads beside the drive.
fn load(input: &mut upt_input, call: &Call, lists: &Lists) {
    let at = call.seed as usize % 7;
    input.gravity = [0.0, -1.0, 0.5];
    spoil(&mut input.gravity, call.odd, at);
    input.pressures = lists.pressures.as_ptr();
    input.pressure_count = absurd(lists.pressures.len(), 32, call);
    if call.seed.is_multiple_of(4) {
        input.point_forces = lists.point_forces.as_ptr();
        input.point_force_count = absurd(lists.point_forces.len(), 256, call);
    }
    if call.seed.is_multiple_of(2) {
        input.forces = lists.field.as_ptr();
    }
    if call.seed.is_multiple_of(5) {
        let angle = (call.seed % 100) as f32 * 0.02;
        input.support_rotation = [angle.sin(), 0.0, 0.0, angle.cos()];
        input.support_position = [0.2 * (call.seed % 60) as f32, 1.0, 0.0];
        spoil(&mut input.support_rotation, call.odd, at);
    }
}

/// The input, or NULL where a call has none.
fn at(input: &upt_input, call: &Call) -> *const upt_input {
    match call.null {
        7 => null(),
        _ => input,
    }
}
