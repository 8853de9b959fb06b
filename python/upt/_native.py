# Written by `cargo xtask header` from src/ffi/; conventions: docs/reference/abi.md.
# SPDX-License-Identifier: Apache-2.0 OR MIT
"""The C ABI in Python: enums, structs and the signature of each function."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Sequence
from enum import IntEnum, IntFlag
from typing import Any, TypedDict

from upt._record import Record, boolean, choice, corrections, numbers, switch, text, vector

ABI_VERSION = 1
"""Version of the C ABI that `upt_abi_version` returns. Bindings compare it at load."""


class Status(IntEnum):
    """`UPT_ERR_*`. What a call returns: 0 is success, positive values are not errors, negative values are errors."""

    OK = 0
    """Success."""
    PENDING = 1
    """The submitted step has not finished."""
    NULL = -1
    """A required pointer is NULL."""
    ARGUMENT = -2
    """A size, index, enum or range is wrong."""
    STRUCT_SIZE = -3
    """This library does not know this `struct_size`."""
    HANDLE = -4
    """Not a live handle of this type."""
    BUSY = -5
    """The scene is in use by another thread or has a step in flight."""
    NON_FINITE = -6
    """An input holds NaN or Inf."""
    STATE = -7
    """The call does not fit the state (for instance: wait without submit)."""
    UNSUPPORTED = -8
    """This build or this bundle cannot do it."""
    OUT_OF_MEMORY = -9
    """There is not enough memory for the call."""
    RUNTIME = -20
    """ONNX Runtime is missing, too old or broken; the message lists what was tried."""
    PROVIDER = -21
    """No provider of the list can run the model."""
    IO = -30
    """A file cannot be read."""
    BUNDLE = -31
    """A bundle is invalid; the message names the file and the field."""
    VERSION = -32
    """The version of a bundle or snapshot is not supported."""
    SNAPSHOT = -33
    """A snapshot is damaged or belongs to another model."""
    GUARD = -40
    """The guard refused the new state; the last good state stays."""
    PANIC = -90
    """A bug in the library; the scene can only be destroyed."""


class Provider(IntEnum):
    """`UPT_PROVIDER_*`. What runs the networks of a model."""

    CPU = 0
    """ONNX Runtime's CPU provider and the native kernels."""
    CUDA = 1
    """NVIDIA CUDA."""
    TENSORRT = 2
    """NVIDIA TensorRT."""
    TENSORRT_RTX = 3
    """NVIDIA TensorRT-RTX (a plugin provider)."""


class Kind(IntEnum):
    """`UPT_KIND_*`. What a model is."""

    UPT = 0
    """A Universal Physics Transformer."""
    REDUCED = 1
    """A linear-elastic response with a learned correction in a static basis."""


class LogLevel(IntEnum):
    """`UPT_LOG_*`. How much the log tells."""

    OFF = 0
    """No messages."""
    ERROR = 1
    """Failures."""
    WARN = 2
    """Fallbacks, and each flag once when it rises: contacts outside the envelope, states that the guard refuses."""
    INFO = 3
    """Loading: what was opened and which provider runs it."""
    DEBUG = 4
    """Stage times."""
    TRACE = 5
    """Everything."""


class Precision(IntEnum):
    """`UPT_PRECISION_*`. Arithmetic of the heavy stages."""

    F32 = 0
    """32-bit floats: the reference. In a scene's options: the model's precision."""
    BF16 = 1
    """bfloat16 products where the CPU is faster with them, 32-bit floats elsewhere; the statistics say which."""
    F16 = 2
    """16-bit floats: the bundle's `*.f16.onnx`, or a GPU provider's own."""
    INT8 = 3
    """8-bit integers: the bundle's `*.int8.onnx`."""
    FORCE_F32 = 4
    """In options only: 32-bit floats, even in a scene of a model that was opened with another precision."""


class Kernel(IntEnum):
    """`UPT_KERNEL_*`. What decodes."""

    AUTO = 0
    """The library chooses the decoder."""
    NATIVE = 1
    """The fused native decoder."""
    ONNX = 2
    """ONNX Runtime sessions in node tiles."""
    RESIDENT = 3
    """ONNX Runtime, all nodes in one run with the query table resident on the device."""


class StepPath(IntEnum):
    """`UPT_STEP_*`. Who makes a step of a `UPT_KIND_UPT` bundle."""

    AUTO = 0
    """On the CPU: split. On a device: the faster of split and whole, timed while the scene is created."""
    SPLIT = 1
    """Native encoder and message mean, then `latent.onnx` and the decoder."""
    WHOLE = 2
    """The bundle's `step.onnx`, which decodes every node in every step."""
    MEASURED = 3
    """The faster of split and whole, timed while the scene is created."""


class CorrectionsMode(IntEnum):
    """`UPT_CORRECTIONS_*`. How many corrections a step gets."""

    RECOMMENDED = 0
    """As many as the bundle recommends, until its own target is reached."""
    NONE = 1
    """None."""
    COUNT = 2
    """`count` of them; with a target or a budget at most so many."""
    AUTO = 3
    """As many as the target needs and the budget allows, up to 64."""


class Switch(IntEnum):
    """`UPT_SWITCH_*`. A switch, for what is usually on."""

    DEFAULT = 0
    """A switch: as usual, which its field says."""
    ON = 1
    """A switch: on."""
    OFF = 2
    """A switch: off."""


class GuardPolicy(IntEnum):
    """`UPT_GUARD_*`. What happens to a state that the guard refuses."""

    HOLD = 0
    """Keep the last good state and return `UPT_ERR_GUARD`. A step without contact, which the host cannot change, is treated as
    under `UPT_GUARD_BLEND`."""
    REPORT = 1
    """Publish finite states and set flags."""
    BLEND = 2
    """Replace a refused state by the prior's or by rest, and set flags."""


class Flag(IntFlag):
    """`UPT_FLAG_*`. Bits of `flags`."""

    PUSH = 1
    """A push is longer than the model was trained on."""
    CONTACT_AREA = 2
    """A contact area is outside the trained range."""
    SITE = 4
    """A contact lies outside the domain."""
    RATE = 8
    """A push changes faster than trained."""
    SITES = 16
    """More separate contact sites than trained."""
    BOUND = 32
    """Guard: a displacement passes the bound."""
    NON_FINITE = 64
    """Guard: the state is not finite."""
    INVERTED = 128
    """An element at the contact is inverted; with `check_inversion` any element, and the guard refuses the state."""
    GROWTH = 256
    """Guard: the displacement grew too much in one step."""
    CLAMPED = 512
    """The learned correction was bounded."""
    REGULARISED = 1024
    """The contact block was nearly singular and was regularised."""
    FELL_BACK = 2048
    """The corrections ended with inverted elements, or had lost the contact of an instrument: the step's first guess or the linear response
    took their place."""
    ERROR = 4096
    """The estimated error is above the scene's `error_limit_mm`."""
    DEEP = 8192
    """Tissue lies more than 1 mm inside an instrument, or an instrument in the tissue."""
    UNSOLVED = 16384
    """The contact solve was cut short by its bounds or the budget and left more than 0.01 mm (`residual_mm` of the readings)."""
    ELASTIC = 32768
    """The bundle's tissue relaxes, and this scene makes no corrections, which alone know of it: what it shows and feels is elastic."""


class IndexSet(IntEnum):
    """`UPT_SET_*`. A static set of indices of a mesh."""

    SURFACE_NODES = 0
    """Nodes of the surface."""
    DOMAIN_NODES = 1
    """Nodes that instruments may touch."""
    FIXED_NODES = 2
    """Nodes held at zero under the bundle's boundary condition."""
    SURFACE_FACES = 3
    """Surface triangles, 3 node indices each, outward."""
    DOMAIN_FACES = 4
    """Triangles that instruments may touch, 3 node indices each, outward."""
    TETS = 5
    """Tetrahedra, 4 node indices each, positive volume."""


class ViewKind(IntEnum):
    """`UPT_VIEW_*`. What is shown of a state."""

    REGION = 0
    """The region's nodes in its order; all nodes where there is no region."""
    POINTS = 1
    """The attached points."""
    SURFACE = 2
    """The vertices of the surface as the last `upt_scene_update_surface` left it, each from its place at rest: the lips of cuts too."""
    NODES = 3
    """The view's own `nodes`, in the region or not. Only `upt_scene_decode` takes it."""


class Shape(IntEnum):
    """`UPT_SHAPE_*`. Shape of an instrument."""

    CAPSULE = 0
    """An instrument's shape: a capsule along local y."""
    BOX = 1
    """An instrument's shape: a box."""
    SPATULA = 2
    """An instrument's shape: a box with rounded corners."""
    HULL = 3
    """An instrument's shape: a hull from `upt_hull_create`."""
    SPHERE = 4
    """An instrument's shape: a ball of `radius`."""


class Mode(IntEnum):
    """`UPT_MODE_*`. What an instrument does to the tissue."""

    SLIDE = 0
    """An instrument pushes, with Coulomb friction."""
    GRASP = 1
    """An instrument grasps what lies within 0.5 mm of it when the mode changes to this, and holds it until the mode changes back
    or the grasp tears off."""


class End(IntEnum):
    """`UPT_END_*`. What a tie is tied to."""

    SUPPORT = 0
    """A tie's far end is in the mesh's frame, which goes with the support."""
    WORLD = 1
    """A tie's far end is in the world, which is the mesh's frame where no support moves."""
    INSTRUMENT = 2
    """A tie's far end is on an instrument."""
    TISSUE = 3
    """A tie's far end is another point of the tissue: a suture."""


class InitOptions(Record):
    """Options of `upt_init`."""

    struct_size: int
    """`sizeof(upt_init_options)`."""
    threads: int
    """Default number of threads of a model; 0 means 1."""
    onnxruntime_path: str | None = text("_onnxruntime_path")
    """Path of ONNX Runtime's shared library; NULL searches the folder of libupt, then `ORT_DYLIB_PATH`, then the system."""

    _fields_ = [
        ("struct_size", ctypes.c_uint32),
        ("threads", ctypes.c_uint32),
        ("_onnxruntime_path", ctypes.c_char_p),
    ]


class InitOptionsKeywords(TypedDict, total=False):
    """Fields of `InitOptions`."""

    threads: int
    """Default number of threads of a model; 0 means 1."""
    onnxruntime_path: str | os.PathLike[str] | None
    """Path of ONNX Runtime's shared library; NULL searches the folder of libupt, then `ORT_DYLIB_PATH`, then the system."""


class ModelOptions(Record):
    """Options of `upt_model_create`."""

    struct_size: int
    """`sizeof(upt_model_options)`."""
    threads: int
    """Threads that a step may use, the caller's included; 0: the default of `upt_init`."""
    providers: tuple[Provider, ...] = numbers("_providers", "provider_count", ctypes.c_int32, Provider)
    """`UPT_PROVIDER_*` in order of preference; NULL: CPU."""
    provider_count: int
    """Entries in `providers`."""
    device_id: int
    """Device of GPU providers, from 0."""
    precision: Precision = choice("_precision", Precision)
    """`UPT_PRECISION_*`."""
    gpu_memory_limit: int
    """Bytes; 0: no limit. Needs a GPU provider in `providers`."""
    cache_dir: str | None = text("_cache_dir")
    """Folder for compiled engines; NULL: they are not kept."""
    allow_tf32: bool = boolean("_allow_tf32")
    """1: TF32 products allowed (CUDA; errors near 1e-3)."""
    cuda_graph: bool = boolean("_cuda_graph")
    """1: capture CUDA graphs."""
    fallback: bool | None = switch("_fallback")
    """`UPT_SWITCH_*`: the next provider is tried where one cannot run the model, usually on; off: `UPT_ERR_PROVIDER`."""
    portable: bool = boolean("_portable")
    """1: the same bits on every processor, for replays and lockstep; steps take longer. Reduced bundles without a network."""
    user_stream: int | None
    """A `cudaStream_t` of `device_id` that runs the graphs and must outlive the model and its scenes; NULL: ONNX Runtime makes its own."""

    _fields_ = [
        ("struct_size", ctypes.c_uint32),
        ("threads", ctypes.c_uint32),
        ("_providers", ctypes.c_void_p),
        ("provider_count", ctypes.c_uint64),
        ("device_id", ctypes.c_int32),
        ("_precision", ctypes.c_int32),
        ("gpu_memory_limit", ctypes.c_uint64),
        ("_cache_dir", ctypes.c_char_p),
        ("_allow_tf32", ctypes.c_uint8),
        ("_cuda_graph", ctypes.c_uint8),
        ("_fallback", ctypes.c_uint8),
        ("_portable", ctypes.c_uint8),
        ("user_stream", ctypes.c_void_p),
    ]


class ModelOptionsKeywords(TypedDict, total=False):
    """Fields of `ModelOptions`."""

    threads: int
    """Threads that a step may use, the caller's included; 0: the default of `upt_init`."""
    providers: Sequence[Provider | str | int]
    """`UPT_PROVIDER_*` in order of preference; NULL: CPU."""
    device_id: int
    """Device of GPU providers, from 0."""
    precision: Precision | str | int
    """`UPT_PRECISION_*`."""
    gpu_memory_limit: int
    """Bytes; 0: no limit. Needs a GPU provider in `providers`."""
    cache_dir: str | os.PathLike[str] | None
    """Folder for compiled engines; NULL: they are not kept."""
    allow_tf32: bool
    """1: TF32 products allowed (CUDA; errors near 1e-3)."""
    cuda_graph: bool
    """1: capture CUDA graphs."""
    fallback: bool | None
    """`UPT_SWITCH_*`: the next provider is tried where one cannot run the model, usually on; off: `UPT_ERR_PROVIDER`."""
    portable: bool
    """1: the same bits on every processor, for replays and lockstep; steps take longer. Reduced bundles without a network."""
    user_stream: int | None
    """A `cudaStream_t` of `device_id` that runs the graphs and must outlive the model and its scenes; NULL: ONNX Runtime makes its own."""


class ModelInfo(Record):
    """What a model is; filled by `upt_model_read_info`."""

    struct_size: int
    """`sizeof(upt_model_info)`, set by the caller."""
    kind: Kind = choice("_kind", Kind)
    """`UPT_KIND_*`."""
    node_count: int
    """K, the nodes of the bundle's mesh."""
    tet_count: int
    """Tetrahedra."""
    surface_face_count: int
    """Boundary triangles."""
    domain_node_count: int
    """Nodes that instruments may touch."""
    held_node_count: int
    """Nodes held at zero."""
    supernode_count: int
    """Supernodes (kind `UPT_KIND_UPT`), else 0."""
    dt: float
    """Length of a step, seconds."""
    max_push_mm: float
    """Longest push that the model was trained on, mm."""
    provider: Provider = choice("_provider", Provider)
    """`UPT_PROVIDER_*` that runs the latent stage."""
    precision: Precision = choice("_precision", Precision)
    """`UPT_PRECISION_*`."""
    memory_bytes: int
    """Host memory of the model."""
    load_seconds: float
    """Wall time of `upt_model_create`."""
    frame_step_s: float
    """The `step_s` of `upt_scene_options` that the bundle recommends to a host that shows frames (`upt_scene_present`), seconds; `dt` where it
    recommends no other. For scenes with the corrections that the bundle recommends."""

    _fields_ = [
        ("struct_size", ctypes.c_uint32),
        ("_kind", ctypes.c_int32),
        ("node_count", ctypes.c_uint64),
        ("tet_count", ctypes.c_uint64),
        ("surface_face_count", ctypes.c_uint64),
        ("domain_node_count", ctypes.c_uint64),
        ("held_node_count", ctypes.c_uint64),
        ("supernode_count", ctypes.c_uint64),
        ("dt", ctypes.c_float),
        ("max_push_mm", ctypes.c_float),
        ("_provider", ctypes.c_int32),
        ("_precision", ctypes.c_int32),
        ("memory_bytes", ctypes.c_uint64),
        ("load_seconds", ctypes.c_double),
        ("frame_step_s", ctypes.c_double),
    ]


class Corrections(Record):
    """How many corrections by the elements a step gets while there is contact, in `upt_scene_options`."""

    mode: CorrectionsMode = choice("_mode", CorrectionsMode)
    """`UPT_CORRECTIONS_*`."""
    count: int
    """With `UPT_CORRECTIONS_COUNT` 1 to 64; otherwise 0."""
    budget_us: int
    """No correction starts later than this in a step, µs, but the first of a step without tools; 0: no budget. Not with `UPT_CORRECTIONS_NONE`."""
    target_mm: float
    """Corrections stop once the estimated error is below this, mm; 0: no target. Only with `UPT_CORRECTIONS_COUNT` and `UPT_CORRECTIONS_AUTO`."""

    _fields_ = [
        ("_mode", ctypes.c_int32),
        ("count", ctypes.c_uint32),
        ("budget_us", ctypes.c_uint32),
        ("target_mm", ctypes.c_float),
    ]


class SceneOptions(Record):
    """Options of `upt_scene_create`."""

    struct_size: int
    """`sizeof(upt_scene_options)`."""
    threads: int
    """Threads of a step; 0: the model's."""
    kernel: Kernel = choice("_kernel", Kernel)
    """`UPT_KERNEL_*`: who decodes."""
    precision: Precision = choice("_precision", Precision)
    """`UPT_PRECISION_*` of the native decoder; 0: the model's; `UPT_PRECISION_FORCE_F32`: float32, whatever the model's is."""
    guard_policy: GuardPolicy = choice("_guard_policy", GuardPolicy)
    """`UPT_GUARD_*`."""
    mesh_path: str | None = text("_mesh_path")
    """A mesh of the host's own (`*.mesh.safetensors`); NULL: the bundle's."""
    boundary: bool | None = switch("_boundary")
    """`UPT_SWITCH_*`: held nodes and nodes in contact are where they belong, usually on; off: where the networks put them."""
    sleep: bool | None = switch("_sleep")
    """`UPT_SWITCH_*`: tissue at rest sleeps, usually on."""
    check_inversion: bool = boolean("_check_inversion")
    """1: the guard looks for inverted elements in each step."""
    latest_wins: bool = boolean("_latest_wins")
    """1: a submit while a step is in flight replaces the waiting contact and does not return `UPT_ERR_BUSY`."""
    cubic_sampling: bool = boolean("_cubic_sampling")
    """1: sample with a cubic through the last states instead of a line."""
    interpolate_points: bool = boolean("_interpolate_points")
    """1: attached points are interpolated between nodes, not decoded (kind `upt`)."""
    substeps: int
    """The most substeps of a step that instruments drive, where one step would miss the corrections' target: 1 for none, up to 8; 0: as
    many as the bundle recommends. 2 or more need a target."""
    reserved: tuple[int, ...] = vector("_reserved")
    """Zero."""
    step_path: StepPath = choice("_step_path", StepPath)
    """`UPT_STEP_*`: who makes a step of a `UPT_KIND_UPT` bundle."""
    corrections: Corrections = corrections("_corrections", Corrections)
    """Corrections by the elements while there is contact; all zero: as many as the bundle recommends."""
    error_limit_mm: float
    """`UPT_FLAG_ERROR` rises if the estimated error is above this, mm; 0: never."""
    step_s: float
    """Length of a step, s: 0.01 to 0.05, or 0 for the bundle's. A length other than the bundle's needs corrections
    (without them: `UPT_ERR_UNSUPPORTED`) and leaves the learned part out."""
    damping_per_s: float
    """Mass-proportional damping of the tissue, 1/s: 0.01 to 1000, or 0 for the bundle's. A damping other than the bundle's
    needs corrections (without them: `UPT_ERR_UNSUPPORTED`) and leaves the learned part out."""

    _fields_ = [
        ("struct_size", ctypes.c_uint32),
        ("threads", ctypes.c_uint32),
        ("_kernel", ctypes.c_int32),
        ("_precision", ctypes.c_int32),
        ("_guard_policy", ctypes.c_int32),
        ("_mesh_path", ctypes.c_char_p),
        ("_boundary", ctypes.c_uint8),
        ("_sleep", ctypes.c_uint8),
        ("_check_inversion", ctypes.c_uint8),
        ("_latest_wins", ctypes.c_uint8),
        ("_cubic_sampling", ctypes.c_uint8),
        ("_interpolate_points", ctypes.c_uint8),
        ("substeps", ctypes.c_uint8),
        ("_reserved", ctypes.c_uint8 * 1),
        ("_step_path", ctypes.c_int32),
        ("_corrections", Corrections),
        ("error_limit_mm", ctypes.c_float),
        ("step_s", ctypes.c_double),
        ("damping_per_s", ctypes.c_double),
    ]


class SceneOptionsKeywords(TypedDict, total=False):
    """Fields of `SceneOptions`."""

    threads: int
    """Threads of a step; 0: the model's."""
    kernel: Kernel | str | int
    """`UPT_KERNEL_*`: who decodes."""
    precision: Precision | str | int
    """`UPT_PRECISION_*` of the native decoder; 0: the model's; `UPT_PRECISION_FORCE_F32`: float32, whatever the model's is."""
    guard_policy: GuardPolicy | str | int
    """`UPT_GUARD_*`."""
    mesh_path: str | os.PathLike[str] | None
    """A mesh of the host's own (`*.mesh.safetensors`); NULL: the bundle's."""
    boundary: bool | None
    """`UPT_SWITCH_*`: held nodes and nodes in contact are where they belong, usually on; off: where the networks put them."""
    sleep: bool | None
    """`UPT_SWITCH_*`: tissue at rest sleeps, usually on."""
    check_inversion: bool
    """1: the guard looks for inverted elements in each step."""
    latest_wins: bool
    """1: a submit while a step is in flight replaces the waiting contact and does not return `UPT_ERR_BUSY`."""
    cubic_sampling: bool
    """1: sample with a cubic through the last states instead of a line."""
    interpolate_points: bool
    """1: attached points are interpolated between nodes, not decoded (kind `upt`)."""
    substeps: int
    """The most substeps of a step that instruments drive, where one step would miss the corrections' target: 1 for none, up to 8; 0: as
    many as the bundle recommends. 2 or more need a target."""
    step_path: StepPath | str | int
    """`UPT_STEP_*`: who makes a step of a `UPT_KIND_UPT` bundle."""
    corrections: Corrections | str | int
    """Corrections by the elements while there is contact; all zero: as many as the bundle recommends."""
    error_limit_mm: float
    """`UPT_FLAG_ERROR` rises if the estimated error is above this, mm; 0: never."""
    step_s: float
    """Length of a step, s: 0.01 to 0.05, or 0 for the bundle's. A length other than the bundle's needs corrections
    (without them: `UPT_ERR_UNSUPPORTED`) and leaves the learned part out."""
    damping_per_s: float
    """Mass-proportional damping of the tissue, 1/s: 0.01 to 1000, or 0 for the bundle's. A damping other than the bundle's
    needs corrections (without them: `UPT_ERR_UNSUPPORTED`) and leaves the learned part out."""


class HapticsOptions(Record):
    """Options of `upt_haptics_create`."""

    struct_size: int
    """`sizeof(upt_haptics_options)`."""
    instrument: int
    """The tool's place in the array of instruments that drives the steps."""
    tool: int | None
    """Its shape, mode and friction, as in that array; position and rotation say where it starts."""
    blend_ms: float
    """Time over which the change that a new step brings is blended in, ms; 0: 25."""
    step_latency_ms: float
    """Age of a step when it arrives, ms: the time since its poses were taken; 0: as long as the step took."""
    force_limit_n: float
    """Longest force, N; 0: no limit."""
    damping_limit_n_s_per_m: float
    """The most that the passivity controller damps, N s/m; 0: 5."""
    passivity: bool | None = switch("_passivity")
    """`UPT_SWITCH_*`: passivity observer and controller, usually on."""
    reserved: tuple[int, ...] = vector("_reserved")
    """Zero."""

    _fields_ = [
        ("struct_size", ctypes.c_uint32),
        ("instrument", ctypes.c_uint32),
        ("tool", ctypes.c_void_p),
        ("blend_ms", ctypes.c_float),
        ("step_latency_ms", ctypes.c_float),
        ("force_limit_n", ctypes.c_float),
        ("damping_limit_n_s_per_m", ctypes.c_float),
        ("_passivity", ctypes.c_uint8),
        ("_reserved", ctypes.c_uint8 * 7),
    ]


class HapticsOptionsKeywords(TypedDict, total=False):
    """Fields of `HapticsOptions`."""

    instrument: int
    """The tool's place in the array of instruments that drives the steps."""
    tool: int | None
    """Its shape, mode and friction, as in that array; position and rotation say where it starts."""
    blend_ms: float
    """Time over which the change that a new step brings is blended in, ms; 0: 25."""
    step_latency_ms: float
    """Age of a step when it arrives, ms: the time since its poses were taken; 0: as long as the step took."""
    force_limit_n: float
    """Longest force, N; 0: no limit."""
    damping_limit_n_s_per_m: float
    """The most that the passivity controller damps, N s/m; 0: 5."""
    passivity: bool | None
    """`UPT_SWITCH_*`: passivity observer and controller, usually on."""


class HapticPose(Record):
    """A tool's pose at a moment; the input of `upt_haptics_render`."""

    struct_size: int
    """`sizeof(upt_haptic_pose)`."""
    has_velocity: bool = boolean("_has_velocity")
    """1: the velocities below are given; 0: they follow from the last two poses."""
    reserved: tuple[int, ...] = vector("_reserved")
    """Zero."""
    time_s: float
    """The host's clock, s; never earlier than in the last call."""
    position_m: tuple[float, ...] = vector("_position_m")
    """In the mesh's frame, metres."""
    rotation: tuple[float, ...] = vector("_rotation")
    """Unit quaternion x, y, z, w; all zero is no rotation."""
    velocity_m_per_s: tuple[float, ...] = vector("_velocity_m_per_s")
    """Of the tool's position."""
    angular_velocity_rad_per_s: tuple[float, ...] = vector("_angular_velocity_rad_per_s")
    """About the axes of the mesh's frame."""

    _fields_ = [
        ("struct_size", ctypes.c_uint32),
        ("_has_velocity", ctypes.c_uint8),
        ("_reserved", ctypes.c_uint8 * 3),
        ("time_s", ctypes.c_double),
        ("_position_m", ctypes.c_float * 3),
        ("_rotation", ctypes.c_float * 4),
        ("_velocity_m_per_s", ctypes.c_float * 3),
        ("_angular_velocity_rad_per_s", ctypes.c_float * 3),
    ]


class HapticForce(Record):
    """What a hand feels; filled by `upt_haptics_render`."""

    struct_size: int
    """`sizeof(upt_haptic_force)`, set by the caller."""
    contact_count: int
    """Points of the surface that push or hold the tool."""
    contact: bool = boolean("_contact")
    """1: there is a force."""
    damped: bool = boolean("_damped")
    """1: the passivity controller damps."""
    reserved: tuple[int, ...] = vector("_reserved")
    """Zero."""
    step_count: int
    """States of the scene that this object has seen."""
    age_s: float
    """Watchdog: age of the last of these states, s."""
    excess_energy_j: float
    """Energy that the hand received, less what it gave, since the tool last touched, J; the controller takes it back."""
    force_n: tuple[float, ...] = vector("_force_n")
    """On the tool, N, in the mesh's frame."""
    torque_n_m: tuple[float, ...] = vector("_torque_n_m")
    """On the tool about its position, N m."""
    stiffness_n_per_m: tuple[float, ...] = vector("_stiffness_n_per_m")
    """`[3,3]`, row-major: how the force falls with the position, N/m. With the next two: a symmetric 6x6 stiffness of the contact alone."""
    coupling_n_per_rad: tuple[float, ...] = vector("_coupling_n_per_rad")
    """`[3,3]`, row-major: how the force falls with the rotation, N/rad; transposed, the torque with the position, N m/m."""
    angular_stiffness_n_m_per_rad: tuple[float, ...] = vector("_angular_stiffness_n_m_per_rad")
    """`[3,3]`, row-major: how the torque falls with the rotation, N m/rad."""

    _fields_ = [
        ("struct_size", ctypes.c_uint32),
        ("contact_count", ctypes.c_uint32),
        ("_contact", ctypes.c_uint8),
        ("_damped", ctypes.c_uint8),
        ("_reserved", ctypes.c_uint8 * 6),
        ("step_count", ctypes.c_uint64),
        ("age_s", ctypes.c_double),
        ("excess_energy_j", ctypes.c_double),
        ("_force_n", ctypes.c_float * 3),
        ("_torque_n_m", ctypes.c_float * 3),
        ("_stiffness_n_per_m", ctypes.c_float * 9),
        ("_coupling_n_per_rad", ctypes.c_float * 9),
        ("_angular_stiffness_n_m_per_rad", ctypes.c_float * 9),
    ]


class SceneStats(Record):
    """What the last step did; filled by `upt_scene_read_stats`."""

    struct_size: int
    """`sizeof(upt_scene_stats)`, set by the caller."""
    flags: Flag = choice("_flags", Flag)
    """`UPT_FLAG_*` of the last step."""
    step_count: int
    """Steps since creation or reset."""
    decoded_node_count: int
    """Nodes decoded in the last step."""
    contact_count: int
    """Contact nodes of the last step."""
    memory_bytes: int
    """Bytes that the scene has allocated in addition to the model; pages that it has never touched are not resident."""
    threads: int
    """Threads of a step."""
    kernel: Kernel = choice("_kernel", Kernel)
    """`UPT_KERNEL_*` that decodes."""
    provider: Provider = choice("_provider", Provider)
    """`UPT_PROVIDER_*` that runs the latent stage."""
    precision: Precision = choice("_precision", Precision)
    """`UPT_PRECISION_*` of the decoder."""
    max_displacement_mm: float
    """Largest displacement among the decoded nodes, mm."""
    indicator: float
    """Largest ratio of push, rate of push, contact area and number of sites to what the model was trained on; above 1: outside."""
    sleeping: bool = boolean("_sleeping")
    """1: the scene sleeps."""
    poisoned: bool = boolean("_poisoned")
    """1: a bug was caught in an earlier call; only destroy is left."""
    prior_forces: bool = boolean("_prior_forces")
    """1: `upt_scene_read_contact_force` gives the contact forces of the linear response; 0: the elements' elastic forces."""
    substeps: int
    """Substeps of the last step; 0 if it was not split."""
    reserved: tuple[int, ...] = vector("_reserved")
    """Zero."""
    step_path: StepPath = choice("_step_path", StepPath)
    """`UPT_STEP_SPLIT` or `UPT_STEP_WHOLE`."""
    corrections: int
    """Corrections made in the last step."""
    evaluations: int
    """Evaluations of the element forces in the last step."""
    residual: float
    """Residual force after the corrections divided by that before them; 0 without corrections."""
    error_mm: float
    """Estimated root mean square error of the corrected state over all nodes, mm; 0 without corrections."""
    min_det: float
    """Smallest det F of the corrected state; without corrections, of the elements at the contact; 0 if there are neither."""

    _fields_ = [
        ("struct_size", ctypes.c_uint32),
        ("_flags", ctypes.c_uint32),
        ("step_count", ctypes.c_uint64),
        ("decoded_node_count", ctypes.c_uint64),
        ("contact_count", ctypes.c_uint64),
        ("memory_bytes", ctypes.c_uint64),
        ("threads", ctypes.c_uint32),
        ("_kernel", ctypes.c_int32),
        ("_provider", ctypes.c_int32),
        ("_precision", ctypes.c_int32),
        ("max_displacement_mm", ctypes.c_float),
        ("indicator", ctypes.c_float),
        ("_sleeping", ctypes.c_uint8),
        ("_poisoned", ctypes.c_uint8),
        ("_prior_forces", ctypes.c_uint8),
        ("substeps", ctypes.c_uint8),
        ("_reserved", ctypes.c_uint8 * 4),
        ("_step_path", ctypes.c_int32),
        ("corrections", ctypes.c_uint32),
        ("evaluations", ctypes.c_uint32),
        ("residual", ctypes.c_float),
        ("error_mm", ctypes.c_float),
        ("min_det", ctypes.c_float),
    ]


class SceneTiming(Record):
    """What the last step took, in milliseconds; filled by `upt_scene_read_timing`."""

    struct_size: int
    """`sizeof(upt_scene_timing)`, set by the caller."""
    reserved: tuple[int, ...] = vector("_reserved")
    """Zero."""
    step_count: int
    """Steps since creation or reset, the last of which this is of: as in `upt_scene_stats`."""
    step_ms: float
    """The whole step, ms; the stages follow."""
    check_ms: float
    """Input checks, ms."""
    prior_ms: float
    """Contact solve and linear response, ms."""
    encode_ms: float
    """Encoder, ms."""
    aggregate_ms: float
    """Message mean, ms."""
    latent_ms: float
    """Latent network, or the whole step's graph, ms."""
    decode_ms: float
    """Decoder, ms."""
    guard_ms: float
    """Guard and publishing, ms."""
    corrections_ms: float
    """Corrections, ms."""
    contact_ms: float
    """Contact solves of instruments, ms; part of `corrections_ms`, or of `check_ms` without corrections."""
    upload_ms: float
    """Part of the stages' times: copies to a device, ms; 0 on the CPU."""
    download_ms: float
    """Part of the stages' times: copies back from a device, ms; 0 on the CPU."""

    _fields_ = [
        ("struct_size", ctypes.c_uint32),
        ("_reserved", ctypes.c_uint8 * 4),
        ("step_count", ctypes.c_uint64),
        ("step_ms", ctypes.c_double),
        ("check_ms", ctypes.c_double),
        ("prior_ms", ctypes.c_double),
        ("encode_ms", ctypes.c_double),
        ("aggregate_ms", ctypes.c_double),
        ("latent_ms", ctypes.c_double),
        ("decode_ms", ctypes.c_double),
        ("guard_ms", ctypes.c_double),
        ("corrections_ms", ctypes.c_double),
        ("contact_ms", ctypes.c_double),
        ("upload_ms", ctypes.c_double),
        ("download_ms", ctypes.c_double),
    ]


class Input(Record):
    """The input of a step, submitted or not, and of a frame between steps. All zero but `struct_size`: the tissue moves on by itself.
    
    One thing drives a step: `instruments`, the nodes in contact, or `collision`; two at once are `UPT_ERR_ARGUMENT`. Later versions add
    fields at the end."""

    struct_size: int
    """`sizeof(upt_input)`."""
    reserved: tuple[int, ...] = vector("_reserved")
    """Zero."""
    instruments: int | None
    """`[instrument_count]`: where rigid instruments are at the end of the step, all with the same `struct_size`. Pass every instrument
    every time, in the same order."""
    instrument_count: int
    """At most 64."""
    contact_nodes: int | None
    """`[contact_count]` nodes in contact, each at most once, in any order; of a scene that has been cut also copies."""
    contact_vectors: int | None
    """`[contact_count,3]`, mm: the displacement of these nodes at the end of the step."""
    contact_count: int
    """At most K."""
    collision: int | None
    """`[K,3]` of the model's mesh, also where the scene has been cut, mm; zero except at nodes in contact, where it is their displacement at the end of
    the step; NULL: no such field."""
    displacement: int | None
    """`[K,3]`, mm, the displacement that the step starts from; NULL: the scene's own state. Not with `instruments`."""
    time_s: float
    """The moment of the end of the step on the host's clock, s, from which `upt_scene_present` counts; 0 for hosts that keep none."""
    forces: int | None
    """`[K,3]`, mN: forces on the nodes of the model's mesh at the end of the step (where the scene has been cut, on the tissue at a node's place);
    NULL: none. Loads (this field and those after it) act beside whatever drives the step, in scenes with corrections; they change on a line over the step, and a frame goes on from those of its step."""
    pressures: int | None
    """`[pressure_count]`: pressure on parts of the surface at the end of the step, all with the same `struct_size`."""
    pressure_count: int
    """At most 32."""
    ties: int | None
    """`[tie_count]`: ties of the tissue, all with the same `struct_size`, beside instruments or alone. A tie's place in the array is its identity: pass every tie
    every time, in the same order. A broken one stays broken in its place until it has a stiffness of 0 there, the array ends before it, or the scene is reset."""
    tie_count: int
    """At most 256."""
    supports: int | None
    """`[support_count]`: what support groups of the bundle do, each at most once, all with the same `struct_size`. A group that is not named is held where it was
    meshed, or where it was held again. Pass them in every step."""
    support_count: int
    """At most 64."""
    point_forces: int | None
    """`[point_force_count]`: forces at points of the tissue at the end of the step, beside `forces`, all with the same `struct_size`."""
    point_force_count: int
    """At most 256."""
    gravity: tuple[float, ...] = vector("_gravity")
    """Gravity in the mesh's frame at the end of the step, m/s², at most 1000 in each direction."""
    gravity_at_rest: tuple[float, ...] = vector("_gravity_at_rest")
    """Gravity under which the mesh was scanned, m/s²: what acts is `gravity - gravity_at_rest`, on the mass of each node. Zeros: the bundle's, where `gravity` is not zero."""
    support_position: tuple[float, ...] = vector("_support_position")
    """Where what holds the body is at the end of the step, mm: a point `x` of the mesh's frame is at `R x + support_position` in the world. All else stays in
    the mesh's frame, which goes with the support, but `gravity`, which is the world's then; the body feels the support's motion as inertia. Pass it in every step; a
    support that goes farther than 40 mm or half a radian in a step is put there."""
    support_rotation: tuple[float, ...] = vector("_support_rotation")
    """`R` as a unit quaternion x, y, z, w; all zero is no rotation. Position and rotation all zero: there is no support that moves."""
    reserved_end: tuple[int, ...] = vector("_reserved_end")
    """Zero."""

    _fields_ = [
        ("struct_size", ctypes.c_uint32),
        ("_reserved", ctypes.c_uint8 * 4),
        ("instruments", ctypes.c_void_p),
        ("instrument_count", ctypes.c_uint64),
        ("contact_nodes", ctypes.c_void_p),
        ("contact_vectors", ctypes.c_void_p),
        ("contact_count", ctypes.c_uint64),
        ("collision", ctypes.c_void_p),
        ("displacement", ctypes.c_void_p),
        ("time_s", ctypes.c_double),
        ("forces", ctypes.c_void_p),
        ("pressures", ctypes.c_void_p),
        ("pressure_count", ctypes.c_uint64),
        ("ties", ctypes.c_void_p),
        ("tie_count", ctypes.c_uint64),
        ("supports", ctypes.c_void_p),
        ("support_count", ctypes.c_uint64),
        ("point_forces", ctypes.c_void_p),
        ("point_force_count", ctypes.c_uint64),
        ("_gravity", ctypes.c_float * 3),
        ("_gravity_at_rest", ctypes.c_float * 3),
        ("_support_position", ctypes.c_float * 3),
        ("_support_rotation", ctypes.c_float * 4),
        ("_reserved_end", ctypes.c_uint8 * 4),
    ]


class Tie(Record):
    """A tie: a spring between a point of the tissue and something else, an element of `upt_input.ties`."""

    struct_size: int
    """`sizeof(upt_tie)`, the same in every element of an array."""
    to: End = choice("_to", End)
    """What it is tied to: `UPT_END_*`."""
    nodes: tuple[int, ...] = vector("_nodes")
    """The point of the tissue: nodes, of which one at least is free and near the domain, ..."""
    weights: tuple[float, ...] = vector("_weights")
    """... and their weights, 0 or more, with the sum 1; all zero: the first node alone. `upt_scene_tie_points` finds both."""
    place: tuple[float, ...] = vector("_place")
    """Where its far end is at the end of the step, mm: in the mesh's frame, in the world, or in the instrument's frame. It comes there on a line within the step; one
    that goes farther than 40 mm is put there."""
    instrument: int
    """Tied to an instrument: its place in `upt_input.instruments`."""
    other_nodes: tuple[int, ...] = vector("_other_nodes")
    """Tied to the tissue: the other point, as `nodes` and `weights`."""
    other_weights: tuple[float, ...] = vector("_other_weights")
    """See `other_nodes`."""
    stiffness: float
    """N/m, which is mN/mm, at most 1000000; 0: it does not pull."""
    slack_mm: float
    """It pulls where it is longer than this, mm."""
    damping: float
    """N s/m, which is mN s/mm."""
    break_mn: float
    """It breaks under a larger tension at the end of a step, mN; 0: never. Where several would, those break first that are pulled hardest for what they bear."""
    pushes: bool = boolean("_pushes")
    """1: it pushes where it is shorter than `slack_mm`, as a rod does; 0: it is a thread."""
    reserved: tuple[int, ...] = vector("_reserved")
    """Zero."""

    _fields_ = [
        ("struct_size", ctypes.c_uint32),
        ("_to", ctypes.c_int32),
        ("_nodes", ctypes.c_uint32 * 3),
        ("_weights", ctypes.c_float * 3),
        ("_place", ctypes.c_float * 3),
        ("instrument", ctypes.c_uint32),
        ("_other_nodes", ctypes.c_uint32 * 3),
        ("_other_weights", ctypes.c_float * 3),
        ("stiffness", ctypes.c_float),
        ("slack_mm", ctypes.c_float),
        ("damping", ctypes.c_float),
        ("break_mn", ctypes.c_float),
        ("_pushes", ctypes.c_uint8),
        ("_reserved", ctypes.c_uint8 * 3),
    ]


class TieReading(Record):
    """What a tie does at the end of a step; filled by `upt_scene_read_ties`."""

    struct_size: int
    """`sizeof(upt_tie_reading)`, set by the caller, the same in every element of an array."""
    broken: bool = boolean("_broken")
    """1: it has broken, in this step or before."""
    broke: bool = boolean("_broke")
    """1: it broke in this step."""
    reserved: tuple[int, ...] = vector("_reserved")
    """Zero."""
    force: tuple[float, ...] = vector("_force")
    """On the tissue at the tie's point, mN."""
    length_mm: float
    """From end to end, mm."""

    _fields_ = [
        ("struct_size", ctypes.c_uint32),
        ("_broken", ctypes.c_uint8),
        ("_broke", ctypes.c_uint8),
        ("_reserved", ctypes.c_uint8 * 2),
        ("_force", ctypes.c_float * 3),
        ("length_mm", ctypes.c_float),
    ]


class Bed(Record):
    """A bed: what holds a region of the surface, for `upt_scene_bed`."""

    struct_size: int
    """`sizeof(upt_bed)`."""
    radius_mm: float
    """mm: with no `nodes`, the region is what lies this close to `centre` in the last state."""
    centre: tuple[float, ...] = vector("_centre")
    """mm, in the mesh's frame."""
    offset: tuple[float, ...] = vector("_offset")
    """From each node to where it is tied, mm; zeros: where it is in the last state."""
    nodes: int | None
    """`[node_count]`: the nodes that it ties."""
    node_count: int
    """At most K; 0: those about `centre`."""
    stiffness: float
    """Of all ties together, N/m."""
    slack_mm: float
    """Of each tie, mm."""
    damping: float
    """Of all ties together, N s/m."""
    break_mn: float
    """Of all ties together, mN; 0: it never breaks."""
    pushes: int
    """As in `upt_tie`."""
    reserved: tuple[int, ...] = vector("_reserved")
    """Zero."""

    _fields_ = [
        ("struct_size", ctypes.c_uint32),
        ("radius_mm", ctypes.c_float),
        ("_centre", ctypes.c_float * 3),
        ("_offset", ctypes.c_float * 3),
        ("nodes", ctypes.c_void_p),
        ("node_count", ctypes.c_uint64),
        ("stiffness", ctypes.c_float),
        ("slack_mm", ctypes.c_float),
        ("damping", ctypes.c_float),
        ("break_mn", ctypes.c_float),
        ("pushes", ctypes.c_uint8),
        ("_reserved", ctypes.c_uint8 * 7),
    ]


class View(Record):
    """What is shown of a state. Where a call takes one, NULL is the region."""

    struct_size: int
    """`sizeof(upt_view)`."""
    kind: ViewKind = choice("_kind", ViewKind)
    """`UPT_VIEW_*`."""
    nodes: int | None
    """`[node_count]`, only with `UPT_VIEW_NODES`: indices, in the order of the output; NULL with count 0: all nodes."""
    node_count: int
    """At most K."""

    _fields_ = [
        ("struct_size", ctypes.c_uint32),
        ("_kind", ctypes.c_int32),
        ("nodes", ctypes.c_void_p),
        ("node_count", ctypes.c_uint64),
    ]


class Instrument(Record):
    """A rigid instrument, as `upt_input` and `upt_scene_contacts_from_instruments` take it."""

    struct_size: int
    """`sizeof(upt_instrument)`, the same in every element of an array."""
    shape: Shape = choice("_shape", Shape)
    """`UPT_SHAPE_*`."""
    position: tuple[float, ...] = vector("_position")
    """Centre, mm, in the mesh's frame."""
    rotation: tuple[float, ...] = vector("_rotation")
    """Unit quaternion x, y, z, w; all zero is no rotation."""
    half_extents: tuple[float, ...] = vector("_half_extents")
    """Half sizes along the local axes, mm; a capsule's half length is `[1]` (local y). A sphere has none."""
    radius: float
    """A sphere's or a capsule's radius or a spatula's corner radius, mm."""
    sticking: bool = boolean("_sticking")
    """Only for `upt_scene_contacts_from_instruments`. 1: touched nodes move with the instrument until it leaves; 0: they slide."""
    mode: Mode = choice("_mode", Mode)
    """Only for `upt_input`: `UPT_MODE_*`."""
    reserved: tuple[int, ...] = vector("_reserved")
    """Zero."""
    friction: float
    """Only for `upt_input`: Coulomb's coefficient, 0 or more."""
    tear_off_mn: float
    """A grasp tears off when its points together pull harder than this, mN; 0: never."""
    hull: int | None
    """`UPT_SHAPE_HULL`: the `upt_hull`; otherwise NULL."""

    _fields_ = [
        ("struct_size", ctypes.c_uint32),
        ("_shape", ctypes.c_int32),
        ("_position", ctypes.c_float * 3),
        ("_rotation", ctypes.c_float * 4),
        ("_half_extents", ctypes.c_float * 3),
        ("radius", ctypes.c_float),
        ("_sticking", ctypes.c_uint8),
        ("_mode", ctypes.c_uint8),
        ("_reserved", ctypes.c_uint8 * 2),
        ("friction", ctypes.c_float),
        ("tear_off_mn", ctypes.c_float),
        ("hull", ctypes.c_void_p),
    ]


class InstrumentReading(Record):
    """What the tissue does to an instrument at the end of a step; filled by `upt_scene_read_instruments`."""

    struct_size: int
    """`sizeof(upt_instrument_reading)`, set by the caller, the same in every element of an array."""
    contact_count: int
    """Points of the surface that push or hold the instrument."""
    force: tuple[float, ...] = vector("_force")
    """On the instrument, mN."""
    torque: tuple[float, ...] = vector("_torque")
    """On the instrument about its position, mN mm."""
    penetration_mm: float
    """Depth of the deepest point of the surface inside the instrument, mm."""
    torn: bool = boolean("_torn")
    """1: its grasp tore off in this step."""
    reserved: tuple[int, ...] = vector("_reserved")
    """Zero."""
    residual_mm: float
    """What the last contact solve left unsolved, mm: 0 where it came to its end."""

    _fields_ = [
        ("struct_size", ctypes.c_uint32),
        ("contact_count", ctypes.c_uint32),
        ("_force", ctypes.c_float * 3),
        ("_torque", ctypes.c_float * 3),
        ("penetration_mm", ctypes.c_float),
        ("_torn", ctypes.c_uint8),
        ("_reserved", ctypes.c_uint8 * 3),
        ("residual_mm", ctypes.c_float),
    ]


class InstrumentContact(Record):
    """A point of the surface that pushes or holds an instrument; filled by `upt_scene_read_instrument_contacts`."""

    instrument: int
    """Place of the instrument in the step's array."""
    position: tuple[float, ...] = vector("_position")
    """Position of the point, mm."""
    force: tuple[float, ...] = vector("_force")
    """On the instrument, mN."""

    _fields_ = [
        ("instrument", ctypes.c_uint32),
        ("_position", ctypes.c_float * 3),
        ("_force", ctypes.c_float * 3),
    ]


class Cut(Record):
    """What an operation has made of the body of a scene; filled by `upt_scene_cut` and the calls beside it."""

    struct_size: int
    """`sizeof(upt_cut)`, set by the caller."""
    fragment_count: int
    """Pieces that were dropped."""
    node_count: int
    """Nodes that the scene has now. Outputs have 3 floats for each."""
    copied_count: int
    """New ones, the last of them."""
    area_mm2: float
    """New area of the cut, mm²."""
    removed_mm3: float
    """Volume that the body has lost, mm³."""
    force: tuple[float, ...] = vector("_force")
    """What the tissue does to the blade of `upt_scene_cut_with`, mN."""
    is_changed: int
    """1: the body is another one, also where no area is new: its surface wants `upt_scene_update_surface` before it is read."""

    _fields_ = [
        ("struct_size", ctypes.c_uint32),
        ("fragment_count", ctypes.c_uint32),
        ("node_count", ctypes.c_uint64),
        ("copied_count", ctypes.c_uint64),
        ("area_mm2", ctypes.c_float),
        ("removed_mm3", ctypes.c_float),
        ("_force", ctypes.c_float * 3),
        ("is_changed", ctypes.c_uint32),
    ]


class Blade(Record):
    """A blade that feels the tissue. All zero: it feels nothing, and cuts whatever way it goes."""

    struct_size: int
    """`sizeof(upt_blade)`."""
    fracture_energy: float
    """Fracture energy of the tissue, J/m², which is mN/mm: what new area takes."""
    threshold: float
    """With how much it must be pushed before a stroke begins to cut, mN, ..."""
    pushed: float
    """... and is, mN: of the reading of the instrument that is its body, what points against `ahead`."""
    ahead: tuple[float, ...] = vector("_ahead")
    """Where the edge is sharp, of any length; zeros: everywhere. It cuts where its way leans from there by less than 60 degrees."""
    reserved: int
    """0."""

    _fields_ = [
        ("struct_size", ctypes.c_uint32),
        ("fracture_energy", ctypes.c_float),
        ("threshold", ctypes.c_float),
        ("pushed", ctypes.c_float),
        ("_ahead", ctypes.c_float * 3),
        ("reserved", ctypes.c_uint32),
    ]


class Surface(Record):
    """The surface of a scene's body, and what of it is new; filled by `upt_scene_update_surface`."""

    struct_size: int
    """`sizeof(upt_surface)`, set by the caller."""
    is_new: int
    """1: every vertex and triangle is new, so upload all. That is so at the first call, and at the first after `upt_scene_reset` or
    `upt_scene_restore` has put another body back."""
    vertex_count: int
    """Vertices now."""
    triangle_count: int
    """Slots of triangles now, empty ones included."""
    first_vertex: int
    """Vertices from this one on are new."""
    changed_count: int
    """Slots whose corners have changed."""

    _fields_ = [
        ("struct_size", ctypes.c_uint32),
        ("is_new", ctypes.c_uint32),
        ("vertex_count", ctypes.c_uint64),
        ("triangle_count", ctypes.c_uint64),
        ("first_vertex", ctypes.c_uint64),
        ("changed_count", ctypes.c_uint64),
    ]


class PointForce(Record):
    """A force at a point of the tissue, an element of `upt_input.point_forces`; `upt_model_locate_points` finds the point."""

    struct_size: int
    """`sizeof(upt_point_force)`, the same in every element of an array."""
    nodes: tuple[int, ...] = vector("_nodes")
    """Nodes of the model's mesh around the point, which share the force (where the scene has been cut, the tissue at their places does), ..."""
    weights: tuple[float, ...] = vector("_weights")
    """... and their weights, 0 or more, with the sum 1; all zero: the first node alone."""
    force: tuple[float, ...] = vector("_force")
    """mN, at most 1000000 in each direction, in the mesh's frame."""

    _fields_ = [
        ("struct_size", ctypes.c_uint32),
        ("_nodes", ctypes.c_uint32 * 4),
        ("_weights", ctypes.c_float * 4),
        ("_force", ctypes.c_float * 3),
    ]


class Pressure(Record):
    """A pressure on a part of the surface, which follows the surface as it moves. A face in several of them takes their sum."""

    struct_size: int
    """`sizeof(upt_pressure)`, the same in every element of an array."""
    pascal: float
    """From outside on the body, Pa, at most 1000000; negative for suction."""
    nodes: int | None
    """`[node_count]`: it acts on the boundary triangles with all three corners among these nodes; where the scene has been cut, on what is left of them."""
    node_count: int
    """At most K; 0: it acts on the domain, and on all that cuts and removal have laid bare."""

    _fields_ = [
        ("struct_size", ctypes.c_uint32),
        ("pascal", ctypes.c_float),
        ("nodes", ctypes.c_void_p),
        ("node_count", ctypes.c_uint64),
    ]


class Support(Record):
    """What a support group of the bundle does at the end of a step, an element of `upt_input.supports`. `upt_model_read_support` names the groups."""

    struct_size: int
    """`sizeof(upt_support)`, the same in every element of an array."""
    group: int
    """Its place among the bundle's groups, from 0."""
    position: tuple[float, ...] = vector("_position")
    """As a rigid body in the mesh's frame: a node `x` of the group ends at `R x + position`, mm; at most 40 mm from where it is."""
    rotation: tuple[float, ...] = vector("_rotation")
    """`R` as a unit quaternion x, y, z, w; all zero is no rotation."""
    let_go: bool = boolean("_let_go")
    """1: the group holds nothing, and its nodes move as all free ones do. Held again, it holds them where they are then. 0: it holds."""
    reserved: tuple[int, ...] = vector("_reserved")
    """Zero."""
    displacements: int | None
    """`[n,3]`, mm, instead of a pose: the displacement of each of the group's nodes at the end of the step; NULL: the pose."""
    displacement_count: int
    """3 n, or 0."""

    _fields_ = [
        ("struct_size", ctypes.c_uint32),
        ("group", ctypes.c_uint32),
        ("_position", ctypes.c_float * 3),
        ("_rotation", ctypes.c_float * 4),
        ("_let_go", ctypes.c_uint8),
        ("_reserved", ctypes.c_uint8 * 3),
        ("displacements", ctypes.c_void_p),
        ("displacement_count", ctypes.c_uint64),
    ]


#: Name: (result, parameters).
FUNCTIONS: dict[str, tuple[Any, list[Any]]] = {
    "upt_init": (ctypes.c_int32, [ctypes.c_void_p]),
    "upt_shutdown": (ctypes.c_int32, []),
    "upt_version": (ctypes.c_char_p, []),
    "upt_abi_version": (ctypes.c_uint32, []),
    "upt_last_error": (ctypes.c_char_p, []),
    "upt_status_name": (ctypes.c_char_p, [ctypes.c_int32]),
    "upt_set_log": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int32]),
    "upt_providers": (ctypes.c_int32, [ctypes.c_char_p, ctypes.c_uint64, ctypes.c_void_p]),
    "upt_model_create": (ctypes.c_int32, [ctypes.c_char_p, ctypes.c_void_p, ctypes.c_void_p]),
    "upt_model_destroy": (ctypes.c_int32, [ctypes.c_void_p]),
    "upt_model_read_info": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p]),
    "upt_model_describe": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_uint64, ctypes.c_void_p]),
    "upt_model_read_positions": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint64]),
    "upt_model_read_indices": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_int32, ctypes.c_void_p, ctypes.c_uint64, ctypes.c_void_p]),
    "upt_model_read_support": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_uint32, ctypes.c_char_p, ctypes.c_uint64, ctypes.c_void_p, ctypes.c_uint64, ctypes.c_void_p]),
    "upt_model_read_region": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_uint32, ctypes.c_char_p, ctypes.c_uint64, ctypes.c_void_p, ctypes.c_uint64, ctypes.c_void_p]),
    "upt_model_locate_points": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint64, ctypes.c_void_p, ctypes.c_void_p]),
    "upt_scene_create": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p]),
    "upt_scene_destroy": (ctypes.c_int32, [ctypes.c_void_p]),
    "upt_scene_reset": (ctypes.c_int32, [ctypes.c_void_p]),
    "upt_scene_step": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint64]),
    "upt_scene_step_field": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint64]),
    "upt_scene_read": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint64]),
    "upt_scene_submit": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p]),
    "upt_scene_poll": (ctypes.c_int32, [ctypes.c_void_p]),
    "upt_scene_wait": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_uint32]),
    "upt_scene_sample": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint64]),
    "upt_scene_set_region": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint64]),
    "upt_scene_decode": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint64]),
    "upt_scene_attach_points": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint64]),
    "upt_scene_read_instruments": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint64]),
    "upt_scene_read_instrument_contacts": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint64, ctypes.c_void_p]),
    "upt_hull_create": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_uint64, ctypes.c_void_p, ctypes.c_uint64, ctypes.c_void_p]),
    "upt_hull_destroy": (ctypes.c_int32, [ctypes.c_void_p]),
    "upt_scene_read_ties": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint64]),
    "upt_scene_tie_points": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint64, ctypes.c_void_p, ctypes.c_void_p]),
    "upt_scene_bed": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint64, ctypes.c_void_p]),
    "upt_scene_cut": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_uint32, ctypes.c_void_p, ctypes.c_uint64, ctypes.c_uint64, ctypes.c_void_p]),
    "upt_scene_cut_with": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint32, ctypes.c_void_p, ctypes.c_uint64, ctypes.c_uint64, ctypes.c_void_p]),
    "upt_scene_remove": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_float, ctypes.c_void_p]),
    "upt_scene_tear": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_uint32, ctypes.c_float, ctypes.c_uint32, ctypes.c_void_p]),
    "upt_scene_scale_stiffness": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint64, ctypes.c_float, ctypes.c_void_p]),
    "upt_scene_drop_fragments": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p]),
    "upt_scene_read_node_count": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p]),
    "upt_scene_update_surface": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p]),
    "upt_scene_read_surface": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint64, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint64, ctypes.c_void_p, ctypes.c_uint64]),
    "upt_scene_read_surface_positions": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint64]),
    "upt_scene_present": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint64]),
    "upt_haptics_create": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p]),
    "upt_haptics_render": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p]),
    "upt_haptics_destroy": (ctypes.c_int32, [ctypes.c_void_p]),
    "upt_scene_contacts_from_instruments": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint64, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint64, ctypes.c_void_p]),
    "upt_scene_read_contact_force": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint64]),
    "upt_scene_read_stats": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p]),
    "upt_scene_read_timing": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p]),
    "upt_scene_save": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint64, ctypes.c_void_p]),
    "upt_scene_restore": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint64]),
    "upt_scene_record": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_uint32]),
    "upt_scene_take_record": (ctypes.c_int32, [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint64, ctypes.c_void_p]),
}
