//! A scene whose body changes: `upt_scene_cut_with` and the calls beside it, its surface, snapshots.

use anyhow::Result;
use upt::ffi;

use super::{Scene, check, size, zeroed};

/// What of the surface is new, with what a renderer takes of it.
pub struct SurfaceNews {
    pub update: ffi::upt_surface,
    /// `[vertices]`, mm.
    pub rest: Vec<[f32; 3]>,
    /// `[slots]`.
    pub triangles: Vec<[u32; 3]>,
    /// `[slots]`: 1 where the triangle was inside of the intact body.
    pub inside: Vec<u8>,
    /// Slots whose corners are others now.
    pub changed: Vec<u32>,
}

fn blank() -> ffi::upt_cut {
    // SAFETY: zero is a value of every field.
    let mut cut: ffi::upt_cut = unsafe { zeroed() };
    cut.struct_size = size::<ffi::upt_cut>();
    cut
}

impl Scene {
    /// `upt_scene_cut_with`: a straight edge goes from one pose to the next.
    pub fn cut(
        &mut self,
        fracture_energy: f32,
        stroke: u32,
        edges: &[[[f32; 3]; 2]; 2],
    ) -> Result<ffi::upt_cut> {
        let mut out = blank();
        // SAFETY: zero is a value of every field of a blade; pointer and counts describe `edges`.
        unsafe {
            let mut blade: ffi::upt_blade = zeroed();
            blade.struct_size = size::<ffi::upt_blade>();
            blade.fracture_energy = fracture_energy;
            let points = edges.as_ptr().cast();
            let handle = self.handle;
            check(ffi::upt_scene_cut_with(
                handle, &blade, stroke, points, 2, 2, &mut out,
            ))?;
        }
        Ok(out)
    }

    /// `upt_scene_remove`.
    pub fn remove(&mut self, tool: &ffi::upt_instrument, most_mm3: f32) -> Result<ffi::upt_cut> {
        let mut out = blank();
        // SAFETY: the instrument lives across the call, and `out` states its size.
        check(unsafe { ffi::upt_scene_remove(self.handle, tool, most_mm3, &mut out) })?;
        Ok(out)
    }

    /// `upt_scene_tear`.
    pub fn tear(&mut self, stroke: u32, stretch: f32, most: u32) -> Result<ffi::upt_cut> {
        let mut out = blank();
        // SAFETY: `out` states its size.
        check(unsafe { ffi::upt_scene_tear(self.handle, stroke, stretch, most, &mut out) })?;
        Ok(out)
    }

    /// `upt_scene_scale_stiffness`.
    pub fn scale_stiffness(&mut self, elements: &[u32], factor: f32) -> Result<ffi::upt_cut> {
        let mut out = blank();
        let count = elements.len() as u64;
        // SAFETY: pointer and count describe `elements`, and `out` states its size.
        check(unsafe {
            ffi::upt_scene_scale_stiffness(self.handle, elements.as_ptr(), count, factor, &mut out)
        })?;
        Ok(out)
    }

    /// `upt_scene_drop_fragments`.
    pub fn drop_fragments(&mut self) -> Result<ffi::upt_cut> {
        let mut out = blank();
        // SAFETY: `out` states its size.
        check(unsafe { ffi::upt_scene_drop_fragments(self.handle, &mut out) })?;
        Ok(out)
    }

    /// `upt_scene_update_surface` and `upt_scene_read_surface`.
    pub fn update_surface(&mut self) -> Result<SurfaceNews> {
        // SAFETY: the struct states its size, and each array has room for as many elements as its count says.
        unsafe {
            let mut update: ffi::upt_surface = zeroed();
            update.struct_size = size::<ffi::upt_surface>();
            check(ffi::upt_scene_update_surface(self.handle, &mut update))?;
            let slots = update.triangle_count as usize;
            let mut news = SurfaceNews {
                update,
                rest: vec![[0.0; 3]; update.vertex_count as usize],
                triangles: vec![[0; 3]; slots],
                inside: vec![0; slots],
                changed: vec![0; update.changed_count as usize],
            };
            check(ffi::upt_scene_read_surface(
                self.handle,
                news.rest.as_mut_ptr().cast(),
                update.vertex_count,
                news.triangles.as_mut_ptr().cast(),
                news.inside.as_mut_ptr(),
                update.triangle_count,
                news.changed.as_mut_ptr(),
                update.changed_count,
            ))?;
            Ok(news)
        }
    }

    /// `upt_scene_present` of the surface's vertices.
    pub fn present_surface(
        &mut self,
        seconds: f64,
        instruments: &[ffi::upt_instrument],
        out: &mut [[f32; 3]],
    ) -> Result<()> {
        let input = ffi::upt_input::of_instruments(instruments);
        let floats = 3 * out.len() as u64;
        let out = out.as_mut_ptr().cast();
        let view = &ffi::upt_view::SURFACE;
        // SAFETY: the pointers and counts describe the slices.
        check(unsafe { ffi::upt_scene_present(self.handle, &input, seconds, view, out, floats) })
    }

    /// `upt_scene_save`.
    pub fn save(&mut self) -> Result<Vec<u8>> {
        let mut needed = 0;
        // SAFETY: a NULL buffer of capacity 0 asks for the size; the second call has that capacity.
        unsafe {
            ffi::upt_scene_save(self.handle, std::ptr::null_mut(), 0, &mut needed);
            let mut bytes = vec![0u8; needed as usize];
            let room = bytes.as_mut_ptr().cast();
            check(ffi::upt_scene_save(self.handle, room, needed, &mut needed))?;
            bytes.truncate(needed as usize);
            Ok(bytes)
        }
    }

    /// `upt_scene_restore`.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<()> {
        let size = bytes.len() as u64;
        // SAFETY: pointer and size describe `bytes`.
        check(unsafe { ffi::upt_scene_restore(self.handle, bytes.as_ptr().cast(), size) })
    }
}
