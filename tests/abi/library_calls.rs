//! Calls of the library and of models, and those that make and end scenes.

use std::ffi::c_char;
use std::ptr::{null, null_mut};

use upt::ffi::*;

use super::inputs::*;
use super::{Call, Function, Odd, Size, World};

/// `upt_model_read_support` and `upt_model_read_region`.
type Named =
    unsafe extern "C" fn(*const upt_model, u32, *mut c_char, u64, *mut u32, u64, *mut u64) -> i32;

unsafe extern "C" fn ignore(_: i32, _: *const c_char, _: *mut std::ffi::c_void) {}

impl World<'_> {
    /// Calls of the library, of models, and those that make and end scenes.
    pub(super) fn call_library(
        &mut self,
        call: &Call,
        scene: *mut upt_scene,
    ) -> (&'static str, i32) {
        let (model, model_nodes) = self.model(call);
        let wrong = call.odd == Odd::Wrong;
        unsafe {
            match call.function {
                Function::Init => {
                    let mut options: upt_init_options = std::mem::zeroed();
                    options.struct_size = sized::<upt_init_options>(call);
                    options.threads = if wrong {
                        u32::MAX
                    } else {
                        (call.seed % 3) as u32
                    };
                    let options = if call.seed.is_multiple_of(2) {
                        null()
                    } else {
                        &raw const options
                    };
                    ("upt_init", upt_init(options))
                }
                Function::Shutdown => {
                    let status = upt_shutdown();
                    let live = self.models.len() + self.scenes.len();
                    assert_eq!(status == UPT_OK, live == 0, "with {live} handles alive");
                    ("upt_shutdown", status)
                }
                Function::Providers => {
                    let mut text = [0 as c_char; 4096];
                    let (capacity, _) = count(text.len() - 1, call.size);
                    let capacity = capacity.min(text.len() as u64);
                    let mut needed = 0u64;
                    let status = upt_providers(
                        pointer_mut(&mut text, call, 0),
                        capacity,
                        pointer_mut(std::slice::from_mut(&mut needed), call, 1),
                    );
                    ("upt_providers", status)
                }
                Function::ModelOpen => ("upt_model_create", self.model_open(call)),
                Function::ModelClose => {
                    let status = upt_model_destroy(model);
                    if status == UPT_OK {
                        self.models.retain(|entry| entry.0 != model);
                        self.closed_models.push(model);
                    }
                    ("upt_model_destroy", status)
                }
                Function::ModelInfo => {
                    let mut info: upt_model_info = std::mem::zeroed();
                    info.struct_size = sized::<upt_model_info>(call);
                    let out = pointer_mut(std::slice::from_mut(&mut info), call, 0);
                    ("upt_model_read_info", upt_model_read_info(model, out))
                }
                Function::ModelDescribe => {
                    let mut text = vec![0 as c_char; 1 << 16];
                    let (capacity, _) = count(text.len() - 1, call.size);
                    let capacity = capacity.min(text.len() as u64);
                    let status = upt_model_describe(
                        model,
                        pointer_mut(&mut text, call, 0),
                        capacity,
                        null_mut(),
                    );
                    ("upt_model_describe", status)
                }
                Function::ModelPositions => {
                    let status = Self::output(call, 0, 3 * model_nodes, true, |out, count| {
                        upt_model_read_positions(model, out, count)
                    });
                    ("upt_model_read_positions", status)
                }
                Function::ModelIndices => {
                    let mut out = vec![0u32; 1 << 15];
                    let set = if wrong { 77 } else { (call.seed % 6) as i32 };
                    let (capacity, _) = count(out.len() - 1, call.size);
                    let capacity = capacity.min(out.len() as u64);
                    let mut needed = 0u64;
                    let status = upt_model_read_indices(
                        model,
                        set,
                        pointer_mut(&mut out, call, 0),
                        capacity,
                        pointer_mut(std::slice::from_mut(&mut needed), call, 1),
                    );
                    ("upt_model_read_indices", status)
                }
                Function::ModelSupport | Function::ModelRegion => {
                    let mut name = [0 as std::ffi::c_char; 32];
                    let (mut nodes, mut needed) = ([0u32; 64], 0u64);
                    let group = if wrong {
                        u32::MAX
                    } else {
                        call.seed as u32 % 3
                    };
                    let (capacity, _) = count(nodes.len() - 1, call.size);
                    let (named, ask): (_, Named) = match call.function {
                        Function::ModelRegion => ("upt_model_read_region", upt_model_read_region),
                        _ => ("upt_model_read_support", upt_model_read_support),
                    };
                    let status = ask(
                        model,
                        group,
                        pointer_mut(&mut name, call, 0),
                        32,
                        pointer_mut(&mut nodes, call, 1),
                        capacity.min(nodes.len() as u64),
                        pointer_mut(std::slice::from_mut(&mut needed), call, 2),
                    );
                    (named, status)
                }
                Function::ModelLocate => {
                    let mut places = [0.5f32; 6];
                    spoil(&mut places, call.odd, call.seed as usize);
                    let (mut nodes, mut weights) = ([0u32; 8], [0.0f32; 8]);
                    let count = match call.size {
                        Size::Zero => 0,
                        Size::Absurd => u64::MAX - 3,
                        _ => 2,
                    };
                    let status = upt_model_locate_points(
                        model,
                        pointer(&places, call, 0),
                        count,
                        pointer_mut(&mut nodes, call, 1),
                        pointer_mut(&mut weights, call, 2),
                    );
                    let found = status == UPT_OK && count == 2;
                    let sum: f32 = weights.iter().sum();
                    assert!(!found || (sum - 2.0).abs() < 1e-5, "weights {weights:?}");
                    assert!(found || sum == 0.0, "a failed call wrote {weights:?}");
                    ("upt_model_locate_points", status)
                }
                Function::SceneCreate => (
                    "upt_scene_create",
                    self.scene_create(call, model, model_nodes),
                ),
                Function::SceneDestroy => {
                    let status = upt_scene_destroy(scene);
                    if status == UPT_OK {
                        self.scenes.retain(|entry| entry.0 != scene);
                        self.closed_scenes.push(scene);
                    }
                    ("upt_scene_destroy", status)
                }
                Function::SetLog => {
                    let level = if wrong { 9 } else { (call.seed % 6) as i32 };
                    let receiver: upt_log_fn = (call.null & 1 == 0).then_some(ignore);
                    ("upt_set_log", upt_set_log(receiver, null_mut(), level))
                }
                Function::Texts => {
                    for text in [
                        upt_version(),
                        upt_last_error(),
                        upt_status_name(call.seed as i32),
                    ] {
                        assert!(std::ffi::CStr::from_ptr(text).to_str().is_ok());
                    }
                    assert_eq!(upt_abi_version(), UPT_ABI_VERSION);
                    ("upt_init", UPT_OK)
                }
                other => unreachable!("{other:?} is a call on a scene"),
            }
        }
    }

    fn model_open(&mut self, call: &Call) -> i32 {
        let mut options: upt_model_options = unsafe { std::mem::zeroed() };
        options.struct_size = sized::<upt_model_options>(call);
        let providers = [
            UPT_PROVIDER_CUDA,
            if call.seed.is_multiple_of(2) {
                UPT_PROVIDER_CPU
            } else {
                99
            },
        ];
        if call.odd == Odd::Wrong {
            options.threads = u32::MAX;
            options.precision = (call.seed % 7) as i32;
            options.providers = providers.as_ptr();
            options.provider_count = 1 + call.seed % 2;
            options.allow_tf32 = (call.seed % 4) as u8;
            options.device_id = -((call.seed % 3) as i32);
            options.gpu_memory_limit = call.seed % 5;
            if call.size == Size::Absurd {
                options.provider_count = u64::MAX - 3;
            }
        }
        let path = match call.size {
            Size::Right | Size::Long => fixture::path(fixture::BUNDLES[call.seed as usize % 2])
                .to_string_lossy()
                .into_owned(),
            Size::Zero => String::new(),
            Size::Short => "no/such/bundle".into(),
            Size::Absurd => "x".repeat(5000),
        };
        if self.models.len() >= 3 {
            return UPT_OK;
        }
        let options = if call.null & 1 == 1 {
            null()
        } else {
            &raw const options
        };
        self.open(&path, options, call.null & 2 == 2)
    }

    fn scene_create(&mut self, call: &Call, model: *mut upt_model, nodes: usize) -> i32 {
        if self.scenes.len() >= 4 {
            return UPT_OK;
        }
        let mut options: upt_scene_options = unsafe { std::mem::zeroed() };
        options.struct_size = sized::<upt_scene_options>(call);
        options.threads = (call.seed % 3) as u32;
        options.guard_policy = (call.seed / 3 % 3) as i32;
        options.check_inversion = (call.seed / 9 % 2) as u8;
        options.step_s = [0.0, 0.0, 0.01, 0.025, 0.2][(call.seed % 5) as usize];
        options.damping_per_s = [0.0, 0.0, 2.0, f64::NAN][(call.seed / 5 % 4) as usize];
        options.latest_wins = (call.seed / 18 % 2) as u8;
        options.cubic_sampling = (call.seed / 36 % 2) as u8;
        options.interpolate_points = (call.seed / 72 % 2) as u8;
        if call.odd == Odd::Wrong {
            options.kernel = (call.seed % 5) as i32;
            options.precision = (call.seed / 5 % 6) as i32;
            options.guard_policy = 3;
        }
        let mut scene = null_mut();
        let out = if call.null & 2 == 2 {
            null_mut()
        } else {
            &raw mut scene
        };
        let options = if call.null & 1 == 1 {
            null()
        } else {
            &raw const options
        };
        let status = unsafe { upt_scene_create(model, options, out) };
        assert_eq!(status == UPT_OK, !scene.is_null());
        if status == UPT_OK {
            self.scenes.push((scene, nodes));
        }
        status
    }
}
