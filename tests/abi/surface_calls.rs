//! Calls that read the surface of a scene's body.

use upt::ffi::*;

use super::inputs::*;
use super::{Call, Function, Odd, World};

impl World<'_> {
    pub(super) fn call_surface(
        &mut self,
        call: &Call,
        scene: *mut upt_scene,
    ) -> (&'static str, i32) {
        match call.function {
            Function::NodeCount => {
                let mut nodes = [0u64];
                let status =
                    unsafe { upt_scene_read_node_count(scene, pointer_mut(&mut nodes, call, 0)) };
                assert_eq!(status == UPT_OK, nodes[0] > 0);
                ("upt_scene_read_node_count", status)
            }
            Function::UpdateSurface => {
                let mut out: [upt_surface; 1] = [unsafe { std::mem::zeroed() }];
                out[0].struct_size = sized::<upt_surface>(call);
                let place = pointer_mut(&mut out, call, 0);
                let status = unsafe { upt_scene_update_surface(scene, place) };
                if status == UPT_OK {
                    let [new, all] = [out[0].first_vertex, out[0].vertex_count];
                    assert!(new <= all && out[0].changed_count <= out[0].triangle_count);
                }
                ("upt_scene_update_surface", status)
            }
            Function::Surface => {
                let [vertices, triangles, changes] = Self::counts(scene);
                let (rows, room) = count(vertices, call.size);
                let mut rest = vec![UNTOUCHED; 3 * room];
                let mut corners = vec![0u32; 3 * (triangles + 8)];
                let mut inside = vec![7u8; triangles + 8];
                let mut changed = vec![0u32; changes + 8];
                let triangles = count(triangles, call.size).0;
                let status = unsafe {
                    upt_scene_read_surface(
                        scene,
                        pointer_mut(&mut rest, call, 0),
                        rows,
                        pointer_mut(&mut corners, call, 1),
                        pointer_mut(&mut inside, call, 1),
                        triangles,
                        pointer_mut(&mut changed, call, 2),
                        changes as u64,
                    )
                };
                let is_untouched = rest.iter().all(|x| *x == UNTOUCHED);
                assert!(status == UPT_OK || is_untouched && inside.iter().all(|flag| *flag == 7));
                ("upt_scene_read_surface", status)
            }
            _ => {
                let floats = 3 * Self::counts(scene)[0];
                let status = Self::output(call, 0, floats, true, |place, count| unsafe {
                    upt_scene_read_surface_positions(scene, place, count)
                });
                ("upt_scene_read_surface_positions", status)
            }
        }
    }

    /// A view, and how many rows it has.
    pub(super) fn view(
        &self,
        scene: *mut upt_scene,
        call: &Call,
        nodes: usize,
    ) -> (Option<upt_view>, usize) {
        let mut view = upt_view::POINTS;
        view.struct_size = sized::<upt_view>(call);
        let rows = match call.seed % 4 {
            0 => return (None, nodes),
            1 => self.points.get(&scene.addr()).copied().unwrap_or(1),
            2 => {
                view.kind = UPT_VIEW_SURFACE;
                Self::counts(scene)[0]
            }
            _ => {
                view.kind = UPT_VIEW_NODES;
                nodes
            }
        };
        if call.odd == Odd::Wrong && call.seed.is_multiple_of(5) {
            view.kind = 7;
        }
        (Some(view), rows)
    }

    /// Vertices, triangles and changes of the surface, where the scene tells; asking for it drops the list of changes.
    pub(super) fn counts(scene: *mut upt_scene) -> [usize; 3] {
        let mut out: upt_surface = unsafe { std::mem::zeroed() };
        out.struct_size = size_of::<upt_surface>() as u32;
        match unsafe { upt_scene_update_surface(scene, &mut out) } {
            UPT_OK => [out.vertex_count, out.triangle_count, out.changed_count].map(|n| n as usize),
            _ => [1; 3],
        }
    }
}
