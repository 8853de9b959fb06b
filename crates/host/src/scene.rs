//! A scene, by the functions `upt_scene_*`.

use anyhow::Result;
use upt::ffi;

use super::{Hand, Model, check, size, zeroed};
use crate::Effort;

/// A scene; destroyed when dropped. Used by the thread that made it.
pub struct Scene {
    pub(super) handle: *mut ffi::upt_scene,
}

impl Scene {
    /// `upt_scene_create`; the guard reports instead of refusing, so that errors can be measured.
    pub fn create(model: &Model, kernel: i32) -> Result<Self> {
        // SAFETY: the options live across the call; `handle` is a place to write to.
        unsafe {
            let mut options: ffi::upt_scene_options = zeroed();
            options.struct_size = size::<ffi::upt_scene_options>();
            options.kernel = kernel;
            options.precision = model.info.precision;
            options.guard_policy = ffi::UPT_GUARD_REPORT;
            let (mode, count) = match model.corrections {
                None => (ffi::UPT_CORRECTIONS_RECOMMENDED, 0),
                Some(Effort { most: 0, .. }) => (ffi::UPT_CORRECTIONS_NONE, 0),
                Some(effort) => (ffi::UPT_CORRECTIONS_COUNT, effort.most),
            };
            options.corrections = ffi::upt_corrections {
                mode,
                count,
                budget_us: model.correction_budget_us,
                target_mm: model.corrections.map_or(0.0, |effort| effort.target_mm),
            };
            options.substeps = model.corrections.map_or(0, |effort| effort.substeps) as u8;
            options.step_s = model.step_s;
            options.damping_per_s = model.damping_per_s;
            let mut handle = std::ptr::null_mut();
            check(ffi::upt_scene_create(model.handle, &options, &mut handle))?;
            Ok(Self { handle })
        }
    }

    /// `upt_scene_reset`.
    pub fn reset(&mut self) -> Result<()> {
        // SAFETY: the handle is live.
        check(unsafe { ffi::upt_scene_reset(self.handle) })
    }

    /// `upt_scene_set_region`; an empty list means all nodes.
    pub fn set_region(&mut self, nodes: &[u32]) -> Result<()> {
        let pointer = if nodes.is_empty() {
            std::ptr::null()
        } else {
            nodes.as_ptr()
        };
        // SAFETY: pointer and count describe `nodes`.
        check(unsafe { ffi::upt_scene_set_region(self.handle, pointer, nodes.len() as u64) })
    }

    /// `upt_scene_step` with nodes in contact.
    pub fn step(
        &mut self,
        nodes: &[u32],
        vectors: &[[f32; 3]],
        out: &mut [[f32; 3]],
    ) -> Result<()> {
        let input = ffi::upt_input::of_contacts(nodes, vectors.as_flattened());
        let floats = 3 * out.len() as u64;
        // SAFETY: the pointers and counts describe the slices, which live across the call.
        check(unsafe { ffi::upt_scene_step(self.handle, &input, out.as_mut_ptr().cast(), floats) })
    }

    /// `upt_scene_decode`: displacement of any nodes in the last state.
    pub fn decode(&mut self, nodes: &[u32], out: &mut [[f32; 3]]) -> Result<()> {
        // SAFETY: the pointers and counts describe the slices.
        check(unsafe {
            ffi::upt_scene_decode(
                self.handle,
                &ffi::upt_view::of_nodes(nodes),
                out.as_mut_ptr().cast(),
                3 * out.len() as u64,
            )
        })
    }

    /// `upt_scene_step` with instruments.
    pub fn step_instruments(
        &mut self,
        instruments: &[ffi::upt_instrument],
        out: &mut [[f32; 3]],
    ) -> Result<()> {
        let input = ffi::upt_input::of_instruments(instruments);
        let floats = 3 * out.len() as u64;
        // SAFETY: the pointers and counts describe the slices, which live across the call.
        check(unsafe { ffi::upt_scene_step(self.handle, &input, out.as_mut_ptr().cast(), floats) })
    }

    /// Whether the bundle has a linear response, with which a step solves the contact of instruments. Makes a step that touches nothing.
    pub fn solves_contact(&mut self) -> bool {
        // SAFETY: zeros are valid numbers.
        let mut far: ffi::upt_instrument = unsafe { std::mem::zeroed() };
        far.struct_size = size::<ffi::upt_instrument>();
        (far.position[0], far.rotation[3], far.radius) = (1e4, 1.0, 1.0);
        let input = ffi::upt_input::of_instruments(std::slice::from_ref(&far));
        // SAFETY: the input's list lives across the call; NULL keeps the result inside.
        check(unsafe { ffi::upt_scene_step(self.handle, &input, std::ptr::null_mut(), 0) }).is_ok()
    }

    /// `upt_scene_submit`: a step on the scene's worker. What the input points to must be there; the call copies it.
    pub fn submit(&mut self, input: &ffi::upt_input) -> Result<()> {
        // SAFETY: the caller's lists live across the call.
        check(unsafe { ffi::upt_scene_submit(self.handle, input) })
    }

    /// `upt_scene_bed` about a place, with stiffness (N/m) and strength (mN); none for a body that has been cut.
    pub fn bed(
        &mut self,
        centre: [f32; 3],
        radius_mm: f32,
        [stiffness, break_mn]: [f32; 2],
    ) -> Result<Option<Vec<ffi::upt_tie>>> {
        // SAFETY: zeros are valid numbers.
        let mut bed: ffi::upt_bed = unsafe { zeroed() };
        bed.struct_size = size::<ffi::upt_bed>();
        (bed.centre, bed.radius_mm) = (centre, radius_mm);
        (bed.stiffness, bed.break_mn) = (stiffness, break_mn);
        let mut ties = vec![ffi::upt_tie::NONE; upt::MAX_TIES];
        let mut count = 0;
        let room = ties.len() as u64;
        // SAFETY: the pointers and counts describe the structs, which live across the call.
        let status =
            unsafe { ffi::upt_scene_bed(self.handle, &bed, ties.as_mut_ptr(), room, &mut count) };
        if status == ffi::UPT_ERR_UNSUPPORTED {
            return Ok(None);
        }
        check(status)?;
        ties.truncate(count as usize);
        Ok(Some(ties))
    }

    /// `upt_scene_read_ties` of the last step's `count` ties.
    pub fn tie_readings(&self, count: usize) -> Result<Vec<ffi::upt_tie_reading>> {
        // SAFETY: zeros are valid numbers.
        let mut blank: ffi::upt_tie_reading = unsafe { zeroed() };
        blank.struct_size = size::<ffi::upt_tie_reading>();
        let mut readings = vec![blank; count];
        // SAFETY: the pointer and count describe the list.
        check(unsafe {
            ffi::upt_scene_read_ties(self.handle, readings.as_mut_ptr(), count as u64)
        })?;
        Ok(readings)
    }

    /// `upt_scene_wait`: until no step is in flight; what became of it does not matter here.
    pub fn settle(&mut self) {
        // SAFETY: the handle is live.
        unsafe { ffi::upt_scene_wait(self.handle, u32::MAX) };
    }

    /// `upt_scene_wait`, for at most so many milliseconds: whether no step is in flight.
    pub fn wait(&mut self, timeout_ms: u32) -> Result<bool> {
        // SAFETY: the handle is live.
        let status = unsafe { ffi::upt_scene_wait(self.handle, timeout_ms) };
        check(status)?;
        Ok(status != ffi::UPT_PENDING)
    }

    /// `upt_scene_read_instruments` of the last step's `count` instruments.
    pub fn readings(&self, count: usize) -> Result<Vec<ffi::upt_instrument_reading>> {
        // SAFETY: zeros are valid numbers.
        let mut blank: ffi::upt_instrument_reading = unsafe { std::mem::zeroed() };
        blank.struct_size = size_of::<ffi::upt_instrument_reading>() as u32;
        let mut readings = vec![blank; count];
        // SAFETY: the pointer and count describe the list.
        check(unsafe {
            ffi::upt_scene_read_instruments(self.handle, readings.as_mut_ptr(), count as u64)
        })?;
        Ok(readings)
    }

    /// `upt_scene_contacts_from_instruments`; the lists are as long as the contact afterwards.
    pub fn contacts(
        &mut self,
        instruments: &[ffi::upt_instrument],
        nodes: &mut Vec<u32>,
        vectors: &mut Vec<[f32; 3]>,
    ) -> Result<()> {
        /// Nodes that there is room for at first: more than a few tools touch.
        const ROOM: usize = 4096;
        let mut count = ROOM as u64;
        loop {
            let room = count;
            nodes.resize(room as usize, 0);
            vectors.resize(room as usize, [0.0; 3]);
            // SAFETY: the pointers and counts describe the slices.
            let status = unsafe {
                ffi::upt_scene_contacts_from_instruments(
                    self.handle,
                    instruments.as_ptr(),
                    instruments.len() as u64,
                    nodes.as_mut_ptr(),
                    vectors.as_mut_ptr().cast(),
                    room,
                    &mut count,
                )
            };
            if count <= room {
                check(status)?;
                nodes.truncate(count as usize);
                vectors.truncate(count as usize);
                return Ok(());
            }
        }
    }

    /// `upt_scene_read_instrument_contacts` of the last step.
    pub fn instrument_contacts(&self) -> Result<Vec<ffi::upt_instrument_contact>> {
        let mut needed = 0;
        // SAFETY: a NULL buffer of capacity 0 asks for the count; the second call has that capacity.
        unsafe {
            ffi::upt_scene_read_instrument_contacts(
                self.handle,
                std::ptr::null_mut(),
                0,
                &mut needed,
            );
            let mut out = vec![zeroed(); needed as usize];
            check(ffi::upt_scene_read_instrument_contacts(
                self.handle,
                out.as_mut_ptr(),
                needed,
                &mut needed,
            ))?;
            Ok(out)
        }
    }

    /// `upt_scene_read_contact_force` at the `count` contact nodes of the last step, mN.
    pub fn contact_force(&mut self, count: usize) -> Result<Vec<[f32; 3]>> {
        let mut out = vec![[0.0; 3]; count];
        // SAFETY: pointer and count describe `out`.
        check(unsafe {
            ffi::upt_scene_read_contact_force(
                self.handle,
                out.as_mut_ptr().cast(),
                3 * count as u64,
            )
        })?;
        Ok(out)
    }

    /// `upt_scene_sample`: between the last two states.
    pub fn sample(&mut self, alpha: f64, out: &mut [[f32; 3]]) -> Result<()> {
        // SAFETY: pointer and count describe `out`.
        check(unsafe {
            ffi::upt_scene_sample(
                self.handle,
                alpha,
                std::ptr::null(),
                out.as_mut_ptr().cast(),
                3 * out.len() as u64,
            )
        })
    }

    /// `upt_scene_present`: `seconds` after the last step, with instruments where they are then.
    pub fn present(
        &mut self,
        seconds: f64,
        instruments: &[ffi::upt_instrument],
        out: &mut [[f32; 3]],
    ) -> Result<()> {
        let input = ffi::upt_input::of_instruments(instruments);
        // SAFETY: the pointers and counts describe the slices.
        check(unsafe {
            ffi::upt_scene_present(
                self.handle,
                &input,
                seconds,
                std::ptr::null(),
                out.as_mut_ptr().cast(),
                3 * out.len() as u64,
            )
        })
    }

    /// The first instrument of the steps, for a hand that gets them `latency_ms` after their poses were taken.
    pub fn hand(&mut self, tool: &ffi::upt_instrument, latency_ms: f32) -> Result<Hand> {
        Hand::create(self.handle, tool, latency_ms)
    }

    /// `upt_scene_read_timing`.
    pub fn timing(&self) -> Result<ffi::upt_scene_timing> {
        // SAFETY: the struct is a place to write to and states its size.
        unsafe {
            let mut timing: ffi::upt_scene_timing = zeroed();
            timing.struct_size = size::<ffi::upt_scene_timing>();
            check(ffi::upt_scene_read_timing(self.handle, &mut timing))?;
            Ok(timing)
        }
    }

    /// `upt_scene_read_stats`.
    pub fn stats(&self) -> Result<ffi::upt_scene_stats> {
        // SAFETY: the struct is a place to write to and states its size.
        unsafe {
            let mut stats: ffi::upt_scene_stats = zeroed();
            stats.struct_size = size::<ffi::upt_scene_stats>();
            check(ffi::upt_scene_read_stats(self.handle, &mut stats))?;
            Ok(stats)
        }
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        // SAFETY: the handle came from upt_scene_create and is destroyed once.
        unsafe { ffi::upt_scene_destroy(self.handle) };
    }
}
