//! Live handles. A handle is a number that is never used twice, not an address: a closed, foreign or invented
//! handle is found out by a look-up and is never followed.
//!
//! REQ-013: A handle that is closed, of another kind or invented is refused at any later time.

use std::cell::OnceCell;
use std::collections::HashMap;
use std::ptr::without_provenance_mut;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock, PoisonError, RwLock};

use super::call::call;
use super::constants::*;
use super::failure::{Answer, Failure, fail};
use super::step_structs::upt_hull;
use super::structs::{upt_model, upt_scene};
use crate::model::Model;
use crate::scene::Scene;

/// Numbers of the four kinds differ in their last digit, so that an error can name the kind that was passed.
const STRIDE: usize = 16;
const MODEL_TAG: usize = 1;
const SCENE_TAG: usize = 2;
const HULL_TAG: usize = 3;
const HAND_TAG: usize = 4;

/// The next number, without its tag: it only grows, so that a handle that was closed is never met again.
static NEXT: AtomicUsize = AtomicUsize::new(STRIDE);
/// Scenes hold their model, too: closing one only takes its number away.
static MODELS: Live<Model> = Live::new(MODEL_TAG, "model");
/// Bodies of hulls; a tool that was made of one keeps its own reference.
static HULLS: Live<::contact::Body> = Live::new(HULL_TAG, "hull");
/// Names the kind only: `hands` finds these without a lock.
static HANDS: Live<()> = Live::new(HAND_TAG, "haptics");
/// Destroyed only while no call is in one.
static SCENES: Live<SceneEntry> = Live::new(SCENE_TAG, "scene");

/// A scene and whether a bug was caught in it.
pub(super) struct SceneEntry {
    /// What the handle stands for.
    pub scene: Scene,
    /// Set by a panic, and never taken back: what the scene holds may be half changed.
    pub poisoned: AtomicBool,
}

/// The live objects of one kind, by handle. A call holds an `Arc` of its object, so that a close in another thread waits for nobody.
struct Live<T> {
    /// Last digit of the handles, base [`STRIDE`].
    tag: usize,
    /// The word for it in errors.
    kind: &'static str,
    entries: LazyLock<RwLock<HashMap<usize, Arc<T>>>>,
}

impl<T> Live<T> {
    const fn new(tag: usize, kind: &'static str) -> Self {
        Live {
            tag,
            kind,
            entries: LazyLock::new(Default::default),
        }
    }

    /// Gives it a new number.
    fn insert(&self, value: Arc<T>) -> usize {
        let handle = NEXT.fetch_add(STRIDE, Ordering::Relaxed) + self.tag;
        let mut entries = self.entries.write().unwrap_or_else(PoisonError::into_inner);
        entries.insert(handle, value);
        handle
    }

    /// The object, kept alive for as long as the call holds it.
    fn get(&self, handle: usize) -> Result<Arc<T>, Failure> {
        let entries = self.entries.read().unwrap_or_else(PoisonError::into_inner);
        match entries.get(&handle) {
            Some(value) => Ok(value.clone()),
            None => self.refuse(handle),
        }
    }

    /// Takes the entry out; `UPT_ERR_BUSY` while a call of another thread holds it and `exclusive` is asked for.
    fn remove(&self, handle: usize, exclusive: bool) -> Result<Arc<T>, Failure> {
        let mut entries = self.entries.write().unwrap_or_else(PoisonError::into_inner);
        match entries.get(&handle) {
            None => self.refuse(handle),
            Some(value) if exclusive && Arc::strong_count(value) > 1 => fail(
                UPT_ERR_BUSY,
                format!(
                    "another thread is in a call on this {}; try again after it",
                    self.kind
                ),
            ),
            Some(_) => Ok(entries
                .remove(&handle)
                .expect("looked up under the same lock")),
        }
    }

    /// Why a number is no live handle of this kind: the message says what it is, if that is known.
    fn refuse<U>(&self, handle: usize) -> Result<U, Failure> {
        if handle == 0 {
            return fail(UPT_ERR_NULL, format!("{} is NULL", self.kind));
        }
        let issued = handle >= STRIDE && handle < NEXT.load(Ordering::Relaxed) + STRIDE;
        let what = match handle % STRIDE {
            tag if tag == self.tag && issued => "it was closed",
            MODEL_TAG if issued => "it is a model",
            SCENE_TAG if issued => "it is a scene",
            HULL_TAG if issued => "it is a hull",
            HAND_TAG if issued => "it is a haptics object",
            _ => "this library never made it",
        };
        fail(
            UPT_ERR_HANDLE,
            format!("{} is not a live {0} handle: {what}", self.kind),
        )
    }
}

pub(super) fn add_model(model: Arc<Model>) -> *mut upt_model {
    without_provenance_mut(MODELS.insert(model))
}

pub(super) fn add_scene(scene: Scene) -> *mut upt_scene {
    without_provenance_mut(SCENES.insert(Arc::new(SceneEntry {
        scene,
        poisoned: AtomicBool::new(false),
    })))
}

pub(super) fn find_model(model: *const upt_model) -> Result<Arc<Model>, Failure> {
    MODELS.get(model.addr())
}

pub(super) fn remove_model(model: *mut upt_model) -> Result<Arc<Model>, Failure> {
    MODELS.remove(model.addr(), false)
}

pub(super) fn add_hull(body: ::contact::Body) -> *mut upt_hull {
    without_provenance_mut(HULLS.insert(Arc::new(body)))
}

pub(super) fn find_hull(hull: *const upt_hull) -> Result<Arc<::contact::Body>, Failure> {
    HULLS.get(hull.addr())
}

pub(super) fn remove_hull(hull: *mut upt_hull) -> Result<Arc<::contact::Body>, Failure> {
    HULLS.remove(hull.addr(), false)
}

/// A number for a haptics object.
pub(super) fn next_hand() -> usize {
    NEXT.fetch_add(STRIDE, Ordering::Relaxed) + HAND_TAG
}

/// Why a number is no live haptics object.
pub(super) fn refuse_hand<T>(handle: usize) -> Result<T, Failure> {
    HANDS.refuse(handle)
}

pub(super) fn find_scene(scene: *const upt_scene) -> Result<Arc<SceneEntry>, Failure> {
    SCENES.get(scene.addr())
}

pub(super) fn remove_scene(scene: *mut upt_scene) -> Result<Arc<SceneEntry>, Failure> {
    SCENES.remove(scene.addr(), true)
}

/// A call on a scene that must not have been poisoned; a panic poisons it.
pub(super) fn call_scene(
    name: &str,
    scene: *const upt_scene,
    body: impl FnOnce(&Scene) -> Answer,
) -> upt_status {
    let found: OnceCell<Arc<SceneEntry>> = OnceCell::new();
    let poison = || {
        if let Some(entry) = found.get() {
            entry.poisoned.store(true, Ordering::Release);
        }
    };
    call(name, poison, || {
        let entry = find_scene(scene)?;
        let entry = found.get_or_init(|| entry);
        if entry.poisoned.load(Ordering::Acquire) {
            return fail(
                UPT_ERR_PANIC,
                "a bug was caught in an earlier call on this scene; destroy it",
            );
        }
        body(&entry.scene)
    })
}
