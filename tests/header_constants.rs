//! Every constant of `include/upt.h` by name and value: a change of one is a change of the ABI.

use upt::ffi::*;

/// `(name, what Rust hosts see, what is promised)`
macro_rules! constants {
    ($($name:ident = $value:literal,)*) => {
        &[$((stringify!($name), $name as i64, $value)),*]
    };
}

const CONSTANTS: &[(&str, i64, i64)] = constants! {
    UPT_OK = 0,
    UPT_PENDING = 1,
    UPT_ERR_NULL = -1,
    UPT_ERR_ARGUMENT = -2,
    UPT_ERR_STRUCT_SIZE = -3,
    UPT_ERR_HANDLE = -4,
    UPT_ERR_BUSY = -5,
    UPT_ERR_NON_FINITE = -6,
    UPT_ERR_STATE = -7,
    UPT_ERR_UNSUPPORTED = -8,
    UPT_ERR_OUT_OF_MEMORY = -9,
    UPT_ERR_RUNTIME = -20,
    UPT_ERR_PROVIDER = -21,
    UPT_ERR_IO = -30,
    UPT_ERR_BUNDLE = -31,
    UPT_ERR_VERSION = -32,
    UPT_ERR_SNAPSHOT = -33,
    UPT_ERR_GUARD = -40,
    UPT_ERR_PANIC = -90,
    UPT_PROVIDER_CPU = 0,
    UPT_PROVIDER_CUDA = 1,
    UPT_PROVIDER_TENSORRT = 2,
    UPT_PROVIDER_TENSORRT_RTX = 3,
    UPT_KIND_UPT = 0,
    UPT_KIND_REDUCED = 1,
    UPT_LOG_OFF = 0,
    UPT_LOG_ERROR = 1,
    UPT_LOG_WARN = 2,
    UPT_LOG_INFO = 3,
    UPT_LOG_DEBUG = 4,
    UPT_LOG_TRACE = 5,
    UPT_PRECISION_F32 = 0,
    UPT_PRECISION_BF16 = 1,
    UPT_PRECISION_F16 = 2,
    UPT_PRECISION_INT8 = 3,
    UPT_PRECISION_FORCE_F32 = 4,
    UPT_KERNEL_AUTO = 0,
    UPT_KERNEL_NATIVE = 1,
    UPT_KERNEL_ONNX = 2,
    UPT_KERNEL_RESIDENT = 3,
    UPT_STEP_AUTO = 0,
    UPT_STEP_SPLIT = 1,
    UPT_STEP_WHOLE = 2,
    UPT_STEP_MEASURED = 3,
    UPT_CORRECTIONS_RECOMMENDED = 0,
    UPT_CORRECTIONS_NONE = 1,
    UPT_CORRECTIONS_COUNT = 2,
    UPT_CORRECTIONS_AUTO = 3,
    UPT_GUARD_HOLD = 0,
    UPT_GUARD_REPORT = 1,
    UPT_GUARD_BLEND = 2,
    UPT_FLAG_PUSH = 1,
    UPT_FLAG_CONTACT_AREA = 2,
    UPT_FLAG_SITE = 4,
    UPT_FLAG_RATE = 8,
    UPT_FLAG_SITES = 16,
    UPT_FLAG_BOUND = 32,
    UPT_FLAG_NON_FINITE = 64,
    UPT_FLAG_INVERTED = 128,
    UPT_FLAG_GROWTH = 256,
    UPT_FLAG_CLAMPED = 512,
    UPT_FLAG_REGULARISED = 1024,
    UPT_FLAG_FELL_BACK = 2048,
    UPT_FLAG_ERROR = 4096,
    UPT_FLAG_DEEP = 8192,
    UPT_FLAG_UNSOLVED = 16384,
    UPT_FLAG_ELASTIC = 32768,
    UPT_SET_SURFACE_NODES = 0,
    UPT_SET_DOMAIN_NODES = 1,
    UPT_SET_FIXED_NODES = 2,
    UPT_SET_SURFACE_FACES = 3,
    UPT_SET_DOMAIN_FACES = 4,
    UPT_SET_TETS = 5,
    UPT_SWITCH_DEFAULT = 0,
    UPT_SWITCH_ON = 1,
    UPT_SWITCH_OFF = 2,
    UPT_VIEW_REGION = 0,
    UPT_VIEW_POINTS = 1,
    UPT_VIEW_SURFACE = 2,
    UPT_VIEW_NODES = 3,
    UPT_SHAPE_CAPSULE = 0,
    UPT_SHAPE_BOX = 1,
    UPT_SHAPE_SPATULA = 2,
    UPT_SHAPE_HULL = 3,
    UPT_SHAPE_SPHERE = 4,
    UPT_MODE_SLIDE = 0,
    UPT_MODE_GRASP = 1,
    UPT_END_SUPPORT = 0,
    UPT_END_WORLD = 1,
    UPT_END_INSTRUMENT = 2,
    UPT_END_TISSUE = 3,
    UPT_ABI_VERSION = 1,
};

#[test]
fn the_header_holds_these_constants_and_no_others() {
    let header = std::fs::read_to_string("include/upt.h").unwrap();
    let defined: Vec<(&str, i64)> = header
        .lines()
        .filter_map(|line| {
            let (name, value) = match line.strip_prefix("#define UPT_") {
                Some(version) => version.split_once(' ')?,
                None => line.trim().strip_prefix("UPT_")?.split_once(" = ")?,
            };
            Some((name, value.trim_end_matches(',').parse().ok()?))
        })
        .collect();
    assert!(defined.len() > 60);
    for (name, value) in &defined {
        let (_, rust, promised) = CONSTANTS
            .iter()
            .find(|(known, ..)| known.strip_prefix("UPT_") == Some(name))
            .unwrap_or_else(|| panic!("UPT_{name} = {value} is new: add it to this list"));
        assert_eq!((value, value), (rust, promised), "UPT_{name}");
    }
    assert_eq!(
        defined.len(),
        CONSTANTS.len(),
        "a constant has left the header"
    );
}

/// A status has the name that the header gives it.
#[test]
fn a_status_is_named_as_its_constant() {
    for (name, value, _) in CONSTANTS {
        if name.starts_with("UPT_ERR_") || matches!(*name, "UPT_OK" | "UPT_PENDING") {
            // SAFETY: the library's own text, NUL-terminated.
            let said = unsafe { std::ffi::CStr::from_ptr(upt_status_name(*value as i32)) };
            assert_eq!(said.to_str(), Ok(*name));
        }
    }
}
