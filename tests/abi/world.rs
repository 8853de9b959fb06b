//! Live and closed handles, and the calls on them.

use std::ffi::CString;
use std::ptr::{null, null_mut, without_provenance_mut};

use upt::ffi::*;

use super::inputs::{UNTOUCHED, count, message, pointer_mut};
use super::traps::trapped;
use super::{Call, Documented, Function, Size};

/// The host's side.
pub struct World<'a> {
    documented: &'a Documented,
    pub(super) models: Vec<(*mut upt_model, usize)>,
    pub(super) scenes: Vec<(*mut upt_scene, usize)>,
    pub(super) closed_models: Vec<*mut upt_model>,
    pub(super) closed_scenes: Vec<*mut upt_scene>,
    pub(super) hulls: Vec<*mut upt_hull>,
    /// Haptics objects and the time of their next call, s.
    pub(super) hands: Vec<(*mut upt_haptics, f64)>,
    pub(super) snapshot: Vec<u8>,
    pub(super) points: std::collections::HashMap<usize, usize>,
}

impl<'a> World<'a> {
    pub fn new(documented: &'a Documented) -> Self {
        let mut world = World {
            documented,
            models: Vec::new(),
            scenes: Vec::new(),
            closed_models: Vec::new(),
            closed_scenes: Vec::new(),
            hulls: Vec::new(),
            hands: Vec::new(),
            snapshot: Vec::new(),
            points: Default::default(),
        };
        for seed in 0..2 {
            world.open(
                &fixture::path(fixture::BUNDLES[seed]).to_string_lossy(),
                null(),
                false,
            );
            let model = world.models[seed];
            let mut scene = null_mut();
            assert_eq!(
                unsafe { upt_scene_create(model.0, null(), &mut scene) },
                UPT_OK
            );
            world.scenes.push((scene, model.1));
        }
        world
    }

    /// Closes everything; a handle of a scene whose model was closed is still good.
    pub fn end(self) {
        for (scene, _) in self.scenes {
            assert_eq!(unsafe { upt_scene_destroy(scene) }, UPT_OK);
            assert_eq!(unsafe { upt_scene_destroy(scene) }, UPT_ERR_HANDLE);
        }
        for (hand, _) in self.hands {
            assert_eq!(unsafe { upt_haptics_destroy(hand) }, UPT_OK);
            assert_eq!(unsafe { upt_haptics_destroy(hand) }, UPT_ERR_HANDLE);
        }
        for hull in self.hulls {
            assert_eq!(unsafe { upt_hull_destroy(hull) }, UPT_OK);
        }
        for (model, _) in self.models {
            assert_eq!(unsafe { upt_model_destroy(model) }, UPT_OK);
        }
    }

    pub(super) fn open(
        &mut self,
        path: &str,
        options: *const upt_model_options,
        no_out: bool,
    ) -> i32 {
        let path = CString::new(path).unwrap();
        let mut model = null_mut();
        let out = if no_out { null_mut() } else { &raw mut model };
        let status = unsafe { upt_model_create(path.as_ptr(), options, out) };
        assert_eq!(status == UPT_OK, !model.is_null());
        if status == UPT_OK {
            let mut positions = 0;
            let mut info: upt_model_info = unsafe { std::mem::zeroed() };
            info.struct_size = size_of::<upt_model_info>() as u32;
            assert_eq!(unsafe { upt_model_read_info(model, &mut info) }, UPT_OK);
            positions += info.node_count as usize;
            self.models.push((model, positions));
        }
        status
    }

    pub(super) fn model(&self, call: &Call) -> (*mut upt_model, usize) {
        match (call.handle, self.models.as_slice()) {
            (0, _) | (_, []) => (null_mut(), 1),
            (1, _) => (without_provenance_mut(call.seed as usize), 1),
            (2, _) if !self.scenes.is_empty() => (self.scenes[0].0.cast(), 1),
            (3..6, _) if !self.closed_models.is_empty() => (self.closed_models[0], 1),
            (k, models) => models[usize::from(k) % models.len()],
        }
    }

    pub(super) fn scene(&self, call: &Call) -> (*mut upt_scene, usize) {
        match (call.handle, self.scenes.as_slice()) {
            (0, _) | (_, []) => (null_mut(), 1),
            (1, _) => (without_provenance_mut(call.seed as usize), 1),
            (2, _) if !self.models.is_empty() => (self.models[0].0.cast(), 1),
            (3..6, _) if !self.closed_scenes.is_empty() => (self.closed_scenes[0], 1),
            (k, scenes) => scenes[usize::from(k) % scenes.len()],
        }
    }

    /// The state of a scene as bytes, where it has one and no step is in flight.
    fn state(scene: *mut upt_scene) -> Option<Vec<u8>> {
        let mut needed = 0;
        let asked = unsafe { upt_scene_save(scene, null_mut(), 0, &mut needed) };
        let mut bytes = vec![0; needed as usize];
        let saved = unsafe { upt_scene_save(scene, bytes.as_mut_ptr(), needed, null_mut()) };
        (asked == UPT_OK && saved == UPT_OK).then_some(bytes)
    }

    /// Makes one call and checks what it did.
    pub fn make(&mut self, call: &Call) {
        let (scene, nodes) = self.scene(call);
        let before = Self::state(scene);
        // One call in three comes from a host that traps exceptions.
        let (name, status) = if call.seed.is_multiple_of(3) {
            trapped(|| self.dispatch(call, scene, nodes))
        } else {
            self.dispatch(call, scene, nodes)
        };
        let allowed = &self.documented[name];
        assert_ne!(status, UPT_ERR_PANIC, "{name}: {}", message());
        let pending =
            status == UPT_PENDING && matches!(call.function, Function::Poll | Function::Wait);
        assert!(
            status == UPT_OK || pending || allowed.contains(&status),
            "{name} gave {status} ({}), which its documentation does not list",
            message()
        );
        if status < 0 {
            assert!(message().starts_with(name), "{name}: {:?}", message());
            if let (Some(before), Some(after)) = (before, Self::state(scene)) {
                assert!(
                    before == after,
                    "{name} failed with {status} and changed the state"
                );
            }
        }
    }

    /// Calls `body` with an output of `right` floats and checks that it is written whole or not at all.
    pub(super) fn output(
        call: &Call,
        index: u8,
        right: usize,
        finite: bool,
        body: impl FnOnce(*mut f32, u64) -> i32,
    ) -> i32 {
        let (passed, length) = count(right, call.size);
        let mut out = vec![UNTOUCHED; length];
        let place = pointer_mut(&mut out, call, index);
        let passed = if place.is_null() && call.size == Size::Right {
            0
        } else {
            passed
        };
        let status = body(place, passed);
        if status != UPT_OK {
            assert!(
                out.iter().all(|x| *x == UNTOUCHED),
                "written by a failed call ({status})"
            );
        } else if finite {
            assert!(
                out.iter().all(|x| x.is_finite()),
                "published something that is not finite"
            );
        }
        status
    }

    fn dispatch(
        &mut self,
        call: &Call,
        scene: *mut upt_scene,
        nodes: usize,
    ) -> (&'static str, i32) {
        use Function::*;
        match call.function {
            Init | Shutdown | Providers | ModelOpen | ModelClose | ModelInfo | ModelDescribe
            | ModelPositions | ModelIndices | ModelSupport | ModelRegion | ModelLocate
            | SceneCreate | SceneDestroy | SetLog | Texts => self.call_library(call, scene),
            Step | Submit | Present => self.call_driven(call, scene, nodes),
            Instruments | Readings | InstrumentContacts | HullCreate | HullDestroy => {
                self.call_instruments(call, scene, nodes)
            }
            Cut | CutWith | Remove | Tear | ScaleStiffness | DropFragments => {
                self.call_cuts(call, scene)
            }
            NodeCount | UpdateSurface | Surface | SurfacePositions => {
                self.call_surface(call, scene)
            }
            TieReadings | TiePoints | Bed => self.call_ties(call, scene, nodes),
            HapticsCreate | HapticsRender | HapticsDestroy => self.call_haptics(call, scene),
            _ => self.call_scene(call, scene, nodes),
        }
    }
}
