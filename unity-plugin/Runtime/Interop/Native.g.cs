// Written by `cargo xtask header` from src/ffi/; conventions: docs/reference/abi.md.
// SPDX-License-Identifier: Apache-2.0 OR MIT
using System;
using System.Runtime.InteropServices;

namespace Upt.Interop
{
    /// <summary>What a call returns: 0 is success, positive values are not errors, negative values are errors.</summary>
    public enum upt_status : int
    {
        /// <summary>Success.</summary>
        UPT_OK = 0,
        /// <summary>The submitted step has not finished.</summary>
        UPT_PENDING = 1,
        /// <summary>A required pointer is NULL.</summary>
        UPT_ERR_NULL = -1,
        /// <summary>A size, index, enum or range is wrong.</summary>
        UPT_ERR_ARGUMENT = -2,
        /// <summary>This library does not know this `struct_size`.</summary>
        UPT_ERR_STRUCT_SIZE = -3,
        /// <summary>Not a live handle of this type.</summary>
        UPT_ERR_HANDLE = -4,
        /// <summary>The scene is in use by another thread or has a step in flight.</summary>
        UPT_ERR_BUSY = -5,
        /// <summary>An input holds NaN or Inf.</summary>
        UPT_ERR_NON_FINITE = -6,
        /// <summary>The call does not fit the state (for instance: wait without submit).</summary>
        UPT_ERR_STATE = -7,
        /// <summary>This build or this bundle cannot do it.</summary>
        UPT_ERR_UNSUPPORTED = -8,
        /// <summary>There is not enough memory for the call.</summary>
        UPT_ERR_OUT_OF_MEMORY = -9,
        /// <summary>ONNX Runtime is missing, too old or broken; the message lists what was tried.</summary>
        UPT_ERR_RUNTIME = -20,
        /// <summary>No provider of the list can run the model.</summary>
        UPT_ERR_PROVIDER = -21,
        /// <summary>A file cannot be read.</summary>
        UPT_ERR_IO = -30,
        /// <summary>A bundle is invalid; the message names the file and the field.</summary>
        UPT_ERR_BUNDLE = -31,
        /// <summary>The version of a bundle or snapshot is not supported.</summary>
        UPT_ERR_VERSION = -32,
        /// <summary>A snapshot is damaged or belongs to another model.</summary>
        UPT_ERR_SNAPSHOT = -33,
        /// <summary>The guard refused the new state; the last good state stays.</summary>
        UPT_ERR_GUARD = -40,
        /// <summary>A bug in the library; the scene can only be destroyed.</summary>
        UPT_ERR_PANIC = -90,
    }

    /// <summary>What runs the networks of a model.</summary>
    public enum upt_provider : int
    {
        /// <summary>ONNX Runtime's CPU provider and the native kernels.</summary>
        UPT_PROVIDER_CPU = 0,
        /// <summary>NVIDIA CUDA.</summary>
        UPT_PROVIDER_CUDA = 1,
        /// <summary>NVIDIA TensorRT.</summary>
        UPT_PROVIDER_TENSORRT = 2,
        /// <summary>NVIDIA TensorRT-RTX (a plugin provider).</summary>
        UPT_PROVIDER_TENSORRT_RTX = 3,
    }

    /// <summary>What a model is.</summary>
    public enum upt_kind : int
    {
        /// <summary>A Universal Physics Transformer.</summary>
        UPT_KIND_UPT = 0,
        /// <summary>A linear-elastic response with a learned correction in a static basis.</summary>
        UPT_KIND_REDUCED = 1,
    }

    /// <summary>How much the log tells.</summary>
    public enum upt_log_level : int
    {
        /// <summary>No messages.</summary>
        UPT_LOG_OFF = 0,
        /// <summary>Failures.</summary>
        UPT_LOG_ERROR = 1,
        /// <summary>Fallbacks, and each flag once when it rises: contacts outside the envelope, states that the guard refuses.</summary>
        UPT_LOG_WARN = 2,
        /// <summary>Loading: what was opened and which provider runs it.</summary>
        UPT_LOG_INFO = 3,
        /// <summary>Stage times.</summary>
        UPT_LOG_DEBUG = 4,
        /// <summary>Everything.</summary>
        UPT_LOG_TRACE = 5,
    }

    /// <summary>Arithmetic of the heavy stages.</summary>
    public enum upt_precision : int
    {
        /// <summary>32-bit floats: the reference. In a scene's options: the model's precision.</summary>
        UPT_PRECISION_F32 = 0,
        /// <summary>bfloat16 products where the CPU is faster with them, 32-bit floats elsewhere; the statistics say which.</summary>
        UPT_PRECISION_BF16 = 1,
        /// <summary>16-bit floats: the bundle's `*.f16.onnx`, or a GPU provider's own.</summary>
        UPT_PRECISION_F16 = 2,
        /// <summary>8-bit integers: the bundle's `*.int8.onnx`.</summary>
        UPT_PRECISION_INT8 = 3,
        /// <summary>In options only: 32-bit floats, even in a scene of a model that was opened with another precision.</summary>
        UPT_PRECISION_FORCE_F32 = 4,
    }

    /// <summary>What decodes.</summary>
    public enum upt_kernel : int
    {
        /// <summary>The library chooses the decoder.</summary>
        UPT_KERNEL_AUTO = 0,
        /// <summary>The fused native decoder.</summary>
        UPT_KERNEL_NATIVE = 1,
        /// <summary>ONNX Runtime sessions in node tiles.</summary>
        UPT_KERNEL_ONNX = 2,
        /// <summary>ONNX Runtime, all nodes in one run with the query table resident on the device.</summary>
        UPT_KERNEL_RESIDENT = 3,
    }

    /// <summary>Who makes a step of a `UPT_KIND_UPT` bundle.</summary>
    public enum upt_step_path : int
    {
        /// <summary>On the CPU: split. On a device: the faster of split and whole, timed while the scene is created.</summary>
        UPT_STEP_AUTO = 0,
        /// <summary>Native encoder and message mean, then `latent.onnx` and the decoder.</summary>
        UPT_STEP_SPLIT = 1,
        /// <summary>The bundle's `step.onnx`, which decodes every node in every step.</summary>
        UPT_STEP_WHOLE = 2,
        /// <summary>The faster of split and whole, timed while the scene is created.</summary>
        UPT_STEP_MEASURED = 3,
    }

    /// <summary>How many corrections a step gets.</summary>
    public enum upt_corrections_mode : int
    {
        /// <summary>As many as the bundle recommends, until its own target is reached.</summary>
        UPT_CORRECTIONS_RECOMMENDED = 0,
        /// <summary>None.</summary>
        UPT_CORRECTIONS_NONE = 1,
        /// <summary>`count` of them; with a target or a budget at most so many.</summary>
        UPT_CORRECTIONS_COUNT = 2,
        /// <summary>As many as the target needs and the budget allows, up to 64.</summary>
        UPT_CORRECTIONS_AUTO = 3,
    }

    /// <summary>A switch, for what is usually on.</summary>
    public enum upt_switch : byte
    {
        /// <summary>A switch: as usual, which its field says.</summary>
        UPT_SWITCH_DEFAULT = 0,
        /// <summary>A switch: on.</summary>
        UPT_SWITCH_ON = 1,
        /// <summary>A switch: off.</summary>
        UPT_SWITCH_OFF = 2,
    }

    /// <summary>What happens to a state that the guard refuses.</summary>
    public enum upt_guard_policy : int
    {
        /// <summary>
        /// Keep the last good state and return `UPT_ERR_GUARD`. A step without contact, which the host cannot change, is treated as
        /// under `UPT_GUARD_BLEND`.
        /// </summary>
        UPT_GUARD_HOLD = 0,
        /// <summary>Publish finite states and set flags.</summary>
        UPT_GUARD_REPORT = 1,
        /// <summary>Replace a refused state by the prior's or by rest, and set flags.</summary>
        UPT_GUARD_BLEND = 2,
    }

    /// <summary>Bits of `flags`.</summary>
    [Flags]
    public enum upt_flag : uint
    {
        /// <summary>A push is longer than the model was trained on.</summary>
        UPT_FLAG_PUSH = 1,
        /// <summary>A contact area is outside the trained range.</summary>
        UPT_FLAG_CONTACT_AREA = 2,
        /// <summary>A contact lies outside the domain.</summary>
        UPT_FLAG_SITE = 4,
        /// <summary>A push changes faster than trained.</summary>
        UPT_FLAG_RATE = 8,
        /// <summary>More separate contact sites than trained.</summary>
        UPT_FLAG_SITES = 16,
        /// <summary>Guard: a displacement passes the bound.</summary>
        UPT_FLAG_BOUND = 32,
        /// <summary>Guard: the state is not finite.</summary>
        UPT_FLAG_NON_FINITE = 64,
        /// <summary>An element at the contact is inverted; with `check_inversion` any element, and the guard refuses the state.</summary>
        UPT_FLAG_INVERTED = 128,
        /// <summary>Guard: the displacement grew too much in one step.</summary>
        UPT_FLAG_GROWTH = 256,
        /// <summary>The learned correction was bounded.</summary>
        UPT_FLAG_CLAMPED = 512,
        /// <summary>The contact block was nearly singular and was regularised.</summary>
        UPT_FLAG_REGULARISED = 1024,
        /// <summary>
        /// The corrections ended with inverted elements, or had lost the contact of an instrument: the step's first guess or the linear response
        /// took their place.
        /// </summary>
        UPT_FLAG_FELL_BACK = 2048,
        /// <summary>The estimated error is above the scene's `error_limit_mm`.</summary>
        UPT_FLAG_ERROR = 4096,
        /// <summary>Tissue lies more than 1 mm inside an instrument, or an instrument in the tissue.</summary>
        UPT_FLAG_DEEP = 8192,
        /// <summary>The contact solve was cut short by its bounds or the budget and left more than 0.01 mm (`residual_mm` of the readings).</summary>
        UPT_FLAG_UNSOLVED = 16384,
        /// <summary>The bundle's tissue relaxes, and this scene makes no corrections, which alone know of it: what it shows and feels is elastic.</summary>
        UPT_FLAG_ELASTIC = 32768,
    }

    /// <summary>A static set of indices of a mesh.</summary>
    public enum upt_index_set : int
    {
        /// <summary>Nodes of the surface.</summary>
        UPT_SET_SURFACE_NODES = 0,
        /// <summary>Nodes that instruments may touch.</summary>
        UPT_SET_DOMAIN_NODES = 1,
        /// <summary>Nodes held at zero under the bundle's boundary condition.</summary>
        UPT_SET_FIXED_NODES = 2,
        /// <summary>Surface triangles, 3 node indices each, outward.</summary>
        UPT_SET_SURFACE_FACES = 3,
        /// <summary>Triangles that instruments may touch, 3 node indices each, outward.</summary>
        UPT_SET_DOMAIN_FACES = 4,
        /// <summary>Tetrahedra, 4 node indices each, positive volume.</summary>
        UPT_SET_TETS = 5,
    }

    /// <summary>What is shown of a state.</summary>
    public enum upt_view_kind : int
    {
        /// <summary>The region's nodes in its order; all nodes where there is no region.</summary>
        UPT_VIEW_REGION = 0,
        /// <summary>The attached points.</summary>
        UPT_VIEW_POINTS = 1,
        /// <summary>The vertices of the surface as the last `upt_scene_update_surface` left it, each from its place at rest: the lips of cuts too.</summary>
        UPT_VIEW_SURFACE = 2,
        /// <summary>The view's own `nodes`, in the region or not. Only `upt_scene_decode` takes it.</summary>
        UPT_VIEW_NODES = 3,
    }

    /// <summary>Shape of an instrument.</summary>
    public enum upt_shape : int
    {
        /// <summary>An instrument's shape: a capsule along local y.</summary>
        UPT_SHAPE_CAPSULE = 0,
        /// <summary>An instrument's shape: a box.</summary>
        UPT_SHAPE_BOX = 1,
        /// <summary>An instrument's shape: a box with rounded corners.</summary>
        UPT_SHAPE_SPATULA = 2,
        /// <summary>An instrument's shape: a hull from `upt_hull_create`.</summary>
        UPT_SHAPE_HULL = 3,
        /// <summary>An instrument's shape: a ball of `radius`.</summary>
        UPT_SHAPE_SPHERE = 4,
    }

    /// <summary>What an instrument does to the tissue.</summary>
    public enum upt_mode : byte
    {
        /// <summary>An instrument pushes, with Coulomb friction.</summary>
        UPT_MODE_SLIDE = 0,
        /// <summary>
        /// An instrument grasps what lies within 0.5 mm of it when the mode changes to this, and holds it until the mode changes back
        /// or the grasp tears off.
        /// </summary>
        UPT_MODE_GRASP = 1,
    }

    /// <summary>What a tie is tied to.</summary>
    public enum upt_end : int
    {
        /// <summary>A tie's far end is in the mesh's frame, which goes with the support.</summary>
        UPT_END_SUPPORT = 0,
        /// <summary>A tie's far end is in the world, which is the mesh's frame where no support moves.</summary>
        UPT_END_WORLD = 1,
        /// <summary>A tie's far end is on an instrument.</summary>
        UPT_END_INSTRUMENT = 2,
        /// <summary>A tie's far end is another point of the tissue: a suture.</summary>
        UPT_END_TISSUE = 3,
    }

    /// <summary>Options of `upt_init`.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct upt_init_options
    {
        /// <summary>`sizeof(upt_init_options)`.</summary>
        public uint struct_size;
        /// <summary>Default number of threads of a model; 0 means 1.</summary>
        public uint threads;
        /// <summary>Path of ONNX Runtime's shared library; NULL searches the folder of libupt, then `ORT_DYLIB_PATH`, then the system.</summary>
        public byte* onnxruntime_path;
    }

    /// <summary>Options of `upt_model_create`.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct upt_model_options
    {
        /// <summary>`sizeof(upt_model_options)`.</summary>
        public uint struct_size;
        /// <summary>Threads that a step may use, the caller's included; 0: the default of `upt_init`.</summary>
        public uint threads;
        /// <summary>`UPT_PROVIDER_*` in order of preference; NULL: CPU.</summary>
        public upt_provider* providers;
        /// <summary>Entries in `providers`.</summary>
        public ulong provider_count;
        /// <summary>Device of GPU providers, from 0.</summary>
        public int device_id;
        /// <summary>`UPT_PRECISION_*`.</summary>
        public upt_precision precision;
        /// <summary>Bytes; 0: no limit. Needs a GPU provider in `providers`.</summary>
        public ulong gpu_memory_limit;
        /// <summary>Folder for compiled engines; NULL: they are not kept.</summary>
        public byte* cache_dir;
        /// <summary>1: TF32 products allowed (CUDA; errors near 1e-3).</summary>
        public byte allow_tf32;
        /// <summary>1: capture CUDA graphs.</summary>
        public byte cuda_graph;
        /// <summary>`UPT_SWITCH_*`: the next provider is tried where one cannot run the model, usually on; off: `UPT_ERR_PROVIDER`.</summary>
        public upt_switch fallback;
        /// <summary>1: the same bits on every processor, for replays and lockstep; steps take longer. Reduced bundles without a network.</summary>
        public byte portable;
        /// <summary>A `cudaStream_t` of `device_id` that runs the graphs and must outlive the model and its scenes; NULL: ONNX Runtime makes its own.</summary>
        public IntPtr user_stream;
    }

    /// <summary>What a model is; filled by `upt_model_read_info`.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct upt_model_info
    {
        /// <summary>`sizeof(upt_model_info)`, set by the caller.</summary>
        public uint struct_size;
        /// <summary>`UPT_KIND_*`.</summary>
        public upt_kind kind;
        /// <summary>K, the nodes of the bundle's mesh.</summary>
        public ulong node_count;
        /// <summary>Tetrahedra.</summary>
        public ulong tet_count;
        /// <summary>Boundary triangles.</summary>
        public ulong surface_face_count;
        /// <summary>Nodes that instruments may touch.</summary>
        public ulong domain_node_count;
        /// <summary>Nodes held at zero.</summary>
        public ulong held_node_count;
        /// <summary>Supernodes (kind `UPT_KIND_UPT`), else 0.</summary>
        public ulong supernode_count;
        /// <summary>Length of a step, seconds.</summary>
        public float dt;
        /// <summary>Longest push that the model was trained on, mm.</summary>
        public float max_push_mm;
        /// <summary>`UPT_PROVIDER_*` that runs the latent stage.</summary>
        public upt_provider provider;
        /// <summary>`UPT_PRECISION_*`.</summary>
        public upt_precision precision;
        /// <summary>Host memory of the model.</summary>
        public ulong memory_bytes;
        /// <summary>Wall time of `upt_model_create`.</summary>
        public double load_seconds;
        /// <summary>
        /// The `step_s` of `upt_scene_options` that the bundle recommends to a host that shows frames (`upt_scene_present`), seconds; `dt` where it
        /// recommends no other. For scenes with the corrections that the bundle recommends.
        /// </summary>
        public double frame_step_s;
    }

    /// <summary>How many corrections by the elements a step gets while there is contact, in `upt_scene_options`.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct upt_corrections
    {
        /// <summary>`UPT_CORRECTIONS_*`.</summary>
        public upt_corrections_mode mode;
        /// <summary>With `UPT_CORRECTIONS_COUNT` 1 to 64; otherwise 0.</summary>
        public uint count;
        /// <summary>No correction starts later than this in a step, µs, but the first of a step without tools; 0: no budget. Not with `UPT_CORRECTIONS_NONE`.</summary>
        public uint budget_us;
        /// <summary>Corrections stop once the estimated error is below this, mm; 0: no target. Only with `UPT_CORRECTIONS_COUNT` and `UPT_CORRECTIONS_AUTO`.</summary>
        public float target_mm;
    }

    /// <summary>Options of `upt_scene_create`.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct upt_scene_options
    {
        /// <summary>`sizeof(upt_scene_options)`.</summary>
        public uint struct_size;
        /// <summary>Threads of a step; 0: the model's.</summary>
        public uint threads;
        /// <summary>`UPT_KERNEL_*`: who decodes.</summary>
        public upt_kernel kernel;
        /// <summary>`UPT_PRECISION_*` of the native decoder; 0: the model's; `UPT_PRECISION_FORCE_F32`: float32, whatever the model's is.</summary>
        public upt_precision precision;
        /// <summary>`UPT_GUARD_*`.</summary>
        public upt_guard_policy guard_policy;
        /// <summary>A mesh of the host's own (`*.mesh.safetensors`); NULL: the bundle's.</summary>
        public byte* mesh_path;
        /// <summary>`UPT_SWITCH_*`: held nodes and nodes in contact are where they belong, usually on; off: where the networks put them.</summary>
        public upt_switch boundary;
        /// <summary>`UPT_SWITCH_*`: tissue at rest sleeps, usually on.</summary>
        public upt_switch sleep;
        /// <summary>1: the guard looks for inverted elements in each step.</summary>
        public byte check_inversion;
        /// <summary>1: a submit while a step is in flight replaces the waiting contact and does not return `UPT_ERR_BUSY`.</summary>
        public byte latest_wins;
        /// <summary>1: sample with a cubic through the last states instead of a line.</summary>
        public byte cubic_sampling;
        /// <summary>1: attached points are interpolated between nodes, not decoded (kind `upt`).</summary>
        public byte interpolate_points;
        /// <summary>
        /// The most substeps of a step that instruments drive, where one step would miss the corrections' target: 1 for none, up to 8; 0: as
        /// many as the bundle recommends. 2 or more need a target.
        /// </summary>
        public byte substeps;
        /// <summary>Zero.</summary>
        public fixed byte reserved[1];
        /// <summary>`UPT_STEP_*`: who makes a step of a `UPT_KIND_UPT` bundle.</summary>
        public upt_step_path step_path;
        /// <summary>Corrections by the elements while there is contact; all zero: as many as the bundle recommends.</summary>
        public upt_corrections corrections;
        /// <summary>`UPT_FLAG_ERROR` rises if the estimated error is above this, mm; 0: never.</summary>
        public float error_limit_mm;
        /// <summary>
        /// Length of a step, s: 0.01 to 0.05, or 0 for the bundle's. A length other than the bundle's needs corrections
        /// (without them: `UPT_ERR_UNSUPPORTED`) and leaves the learned part out.
        /// </summary>
        public double step_s;
        /// <summary>
        /// Mass-proportional damping of the tissue, 1/s: 0.01 to 1000, or 0 for the bundle's. A damping other than the bundle's
        /// needs corrections (without them: `UPT_ERR_UNSUPPORTED`) and leaves the learned part out.
        /// </summary>
        public double damping_per_s;
    }

    /// <summary>Options of `upt_haptics_create`.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct upt_haptics_options
    {
        /// <summary>`sizeof(upt_haptics_options)`.</summary>
        public uint struct_size;
        /// <summary>The tool's place in the array of instruments that drives the steps.</summary>
        public uint instrument;
        /// <summary>Its shape, mode and friction, as in that array; position and rotation say where it starts.</summary>
        public upt_instrument* tool;
        /// <summary>Time over which the change that a new step brings is blended in, ms; 0: 25.</summary>
        public float blend_ms;
        /// <summary>Age of a step when it arrives, ms: the time since its poses were taken; 0: as long as the step took.</summary>
        public float step_latency_ms;
        /// <summary>Longest force, N; 0: no limit.</summary>
        public float force_limit_n;
        /// <summary>The most that the passivity controller damps, N s/m; 0: 5.</summary>
        public float damping_limit_n_s_per_m;
        /// <summary>`UPT_SWITCH_*`: passivity observer and controller, usually on.</summary>
        public upt_switch passivity;
        /// <summary>Zero.</summary>
        public fixed byte reserved[7];
    }

    /// <summary>A tool's pose at a moment; the input of `upt_haptics_render`.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct upt_haptic_pose
    {
        /// <summary>`sizeof(upt_haptic_pose)`.</summary>
        public uint struct_size;
        /// <summary>1: the velocities below are given; 0: they follow from the last two poses.</summary>
        public byte has_velocity;
        /// <summary>Zero.</summary>
        public fixed byte reserved[3];
        /// <summary>The host's clock, s; never earlier than in the last call.</summary>
        public double time_s;
        /// <summary>In the mesh's frame, metres.</summary>
        public fixed float position_m[3];
        /// <summary>Unit quaternion x, y, z, w; all zero is no rotation.</summary>
        public fixed float rotation[4];
        /// <summary>Of the tool's position.</summary>
        public fixed float velocity_m_per_s[3];
        /// <summary>About the axes of the mesh's frame.</summary>
        public fixed float angular_velocity_rad_per_s[3];
    }

    /// <summary>What a hand feels; filled by `upt_haptics_render`.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct upt_haptic_force
    {
        /// <summary>`sizeof(upt_haptic_force)`, set by the caller.</summary>
        public uint struct_size;
        /// <summary>Points of the surface that push or hold the tool.</summary>
        public uint contact_count;
        /// <summary>1: there is a force.</summary>
        public byte contact;
        /// <summary>1: the passivity controller damps.</summary>
        public byte damped;
        /// <summary>Zero.</summary>
        public fixed byte reserved[6];
        /// <summary>States of the scene that this object has seen.</summary>
        public ulong step_count;
        /// <summary>Watchdog: age of the last of these states, s.</summary>
        public double age_s;
        /// <summary>Energy that the hand received, less what it gave, since the tool last touched, J; the controller takes it back.</summary>
        public double excess_energy_j;
        /// <summary>On the tool, N, in the mesh's frame.</summary>
        public fixed float force_n[3];
        /// <summary>On the tool about its position, N m.</summary>
        public fixed float torque_n_m[3];
        /// <summary>`[3,3]`, row-major: how the force falls with the position, N/m. With the next two: a symmetric 6x6 stiffness of the contact alone.</summary>
        public fixed float stiffness_n_per_m[9];
        /// <summary>`[3,3]`, row-major: how the force falls with the rotation, N/rad; transposed, the torque with the position, N m/m.</summary>
        public fixed float coupling_n_per_rad[9];
        /// <summary>`[3,3]`, row-major: how the torque falls with the rotation, N m/rad.</summary>
        public fixed float angular_stiffness_n_m_per_rad[9];
    }

    /// <summary>What the last step did; filled by `upt_scene_read_stats`.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct upt_scene_stats
    {
        /// <summary>`sizeof(upt_scene_stats)`, set by the caller.</summary>
        public uint struct_size;
        /// <summary>`UPT_FLAG_*` of the last step.</summary>
        public upt_flag flags;
        /// <summary>Steps since creation or reset.</summary>
        public ulong step_count;
        /// <summary>Nodes decoded in the last step.</summary>
        public ulong decoded_node_count;
        /// <summary>Contact nodes of the last step.</summary>
        public ulong contact_count;
        /// <summary>Bytes that the scene has allocated in addition to the model; pages that it has never touched are not resident.</summary>
        public ulong memory_bytes;
        /// <summary>Threads of a step.</summary>
        public uint threads;
        /// <summary>`UPT_KERNEL_*` that decodes.</summary>
        public upt_kernel kernel;
        /// <summary>`UPT_PROVIDER_*` that runs the latent stage.</summary>
        public upt_provider provider;
        /// <summary>`UPT_PRECISION_*` of the decoder.</summary>
        public upt_precision precision;
        /// <summary>Largest displacement among the decoded nodes, mm.</summary>
        public float max_displacement_mm;
        /// <summary>Largest ratio of push, rate of push, contact area and number of sites to what the model was trained on; above 1: outside.</summary>
        public float indicator;
        /// <summary>1: the scene sleeps.</summary>
        public byte sleeping;
        /// <summary>1: a bug was caught in an earlier call; only destroy is left.</summary>
        public byte poisoned;
        /// <summary>1: `upt_scene_read_contact_force` gives the contact forces of the linear response; 0: the elements' elastic forces.</summary>
        public byte prior_forces;
        /// <summary>Substeps of the last step; 0 if it was not split.</summary>
        public byte substeps;
        /// <summary>Zero.</summary>
        public fixed byte reserved[4];
        /// <summary>`UPT_STEP_SPLIT` or `UPT_STEP_WHOLE`.</summary>
        public upt_step_path step_path;
        /// <summary>Corrections made in the last step.</summary>
        public uint corrections;
        /// <summary>Evaluations of the element forces in the last step.</summary>
        public uint evaluations;
        /// <summary>Residual force after the corrections divided by that before them; 0 without corrections.</summary>
        public float residual;
        /// <summary>Estimated root mean square error of the corrected state over all nodes, mm; 0 without corrections.</summary>
        public float error_mm;
        /// <summary>Smallest det F of the corrected state; without corrections, of the elements at the contact; 0 if there are neither.</summary>
        public float min_det;
    }

    /// <summary>What the last step took, in milliseconds; filled by `upt_scene_read_timing`.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct upt_scene_timing
    {
        /// <summary>`sizeof(upt_scene_timing)`, set by the caller.</summary>
        public uint struct_size;
        /// <summary>Zero.</summary>
        public fixed byte reserved[4];
        /// <summary>Steps since creation or reset, the last of which this is of: as in `upt_scene_stats`.</summary>
        public ulong step_count;
        /// <summary>The whole step, ms; the stages follow.</summary>
        public double step_ms;
        /// <summary>Input checks, ms.</summary>
        public double check_ms;
        /// <summary>Contact solve and linear response, ms.</summary>
        public double prior_ms;
        /// <summary>Encoder, ms.</summary>
        public double encode_ms;
        /// <summary>Message mean, ms.</summary>
        public double aggregate_ms;
        /// <summary>Latent network, or the whole step's graph, ms.</summary>
        public double latent_ms;
        /// <summary>Decoder, ms.</summary>
        public double decode_ms;
        /// <summary>Guard and publishing, ms.</summary>
        public double guard_ms;
        /// <summary>Corrections, ms.</summary>
        public double corrections_ms;
        /// <summary>Contact solves of instruments, ms; part of `corrections_ms`, or of `check_ms` without corrections.</summary>
        public double contact_ms;
        /// <summary>Part of the stages' times: copies to a device, ms; 0 on the CPU.</summary>
        public double upload_ms;
        /// <summary>Part of the stages' times: copies back from a device, ms; 0 on the CPU.</summary>
        public double download_ms;
    }

    /// <summary>
    /// The input of a step, submitted or not, and of a frame between steps. All zero but `struct_size`: the tissue moves on by itself.
    ///
    /// One thing drives a step: `instruments`, the nodes in contact, or `collision`; two at once are `UPT_ERR_ARGUMENT`. Later versions add
    /// fields at the end.
    /// </summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct upt_input
    {
        /// <summary>`sizeof(upt_input)`.</summary>
        public uint struct_size;
        /// <summary>Zero.</summary>
        public fixed byte reserved[4];
        /// <summary>
        /// `[instrument_count]`: where rigid instruments are at the end of the step, all with the same `struct_size`. Pass every instrument
        /// every time, in the same order.
        /// </summary>
        public upt_instrument* instruments;
        /// <summary>At most 64.</summary>
        public ulong instrument_count;
        /// <summary>`[contact_count]` nodes in contact, each at most once, in any order; of a scene that has been cut also copies.</summary>
        public uint* contact_nodes;
        /// <summary>`[contact_count,3]`, mm: the displacement of these nodes at the end of the step.</summary>
        public float* contact_vectors;
        /// <summary>At most K.</summary>
        public ulong contact_count;
        /// <summary>
        /// `[K,3]` of the model's mesh, also where the scene has been cut, mm; zero except at nodes in contact, where it is their displacement at the end of
        /// the step; NULL: no such field.
        /// </summary>
        public float* collision;
        /// <summary>`[K,3]`, mm, the displacement that the step starts from; NULL: the scene's own state. Not with `instruments`.</summary>
        public float* displacement;
        /// <summary>The moment of the end of the step on the host's clock, s, from which `upt_scene_present` counts; 0 for hosts that keep none.</summary>
        public double time_s;
        /// <summary>
        /// `[K,3]`, mN: forces on the nodes of the model's mesh at the end of the step (where the scene has been cut, on the tissue at a node's place);
        /// NULL: none. Loads (this field and those after it) act beside whatever drives the step, in scenes with corrections; they change on a line over the step, and a frame goes on from those of its step.
        /// </summary>
        public float* forces;
        /// <summary>`[pressure_count]`: pressure on parts of the surface at the end of the step, all with the same `struct_size`.</summary>
        public upt_pressure* pressures;
        /// <summary>At most 32.</summary>
        public ulong pressure_count;
        /// <summary>
        /// `[tie_count]`: ties of the tissue, all with the same `struct_size`, beside instruments or alone. A tie's place in the array is its identity: pass every tie
        /// every time, in the same order. A broken one stays broken in its place until it has a stiffness of 0 there, the array ends before it, or the scene is reset.
        /// </summary>
        public upt_tie* ties;
        /// <summary>At most 256.</summary>
        public ulong tie_count;
        /// <summary>
        /// `[support_count]`: what support groups of the bundle do, each at most once, all with the same `struct_size`. A group that is not named is held where it was
        /// meshed, or where it was held again. Pass them in every step.
        /// </summary>
        public upt_support* supports;
        /// <summary>At most 64.</summary>
        public ulong support_count;
        /// <summary>`[point_force_count]`: forces at points of the tissue at the end of the step, beside `forces`, all with the same `struct_size`.</summary>
        public upt_point_force* point_forces;
        /// <summary>At most 256.</summary>
        public ulong point_force_count;
        /// <summary>Gravity in the mesh's frame at the end of the step, m/s², at most 1000 in each direction.</summary>
        public fixed float gravity[3];
        /// <summary>Gravity under which the mesh was scanned, m/s²: what acts is `gravity - gravity_at_rest`, on the mass of each node. Zeros: the bundle's, where `gravity` is not zero.</summary>
        public fixed float gravity_at_rest[3];
        /// <summary>
        /// Where what holds the body is at the end of the step, mm: a point `x` of the mesh's frame is at `R x + support_position` in the world. All else stays in
        /// the mesh's frame, which goes with the support, but `gravity`, which is the world's then; the body feels the support's motion as inertia. Pass it in every step; a
        /// support that goes farther than 40 mm or half a radian in a step is put there.
        /// </summary>
        public fixed float support_position[3];
        /// <summary>`R` as a unit quaternion x, y, z, w; all zero is no rotation. Position and rotation all zero: there is no support that moves.</summary>
        public fixed float support_rotation[4];
        /// <summary>Zero.</summary>
        public fixed byte reserved_end[4];
    }

    /// <summary>A tie: a spring between a point of the tissue and something else, an element of `upt_input.ties`.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct upt_tie
    {
        /// <summary>`sizeof(upt_tie)`, the same in every element of an array.</summary>
        public uint struct_size;
        /// <summary>What it is tied to: `UPT_END_*`.</summary>
        public upt_end to;
        /// <summary>The point of the tissue: nodes, of which one at least is free and near the domain, ...</summary>
        public fixed uint nodes[3];
        /// <summary>... and their weights, 0 or more, with the sum 1; all zero: the first node alone. `upt_scene_tie_points` finds both.</summary>
        public fixed float weights[3];
        /// <summary>
        /// Where its far end is at the end of the step, mm: in the mesh's frame, in the world, or in the instrument's frame. It comes there on a line within the step; one
        /// that goes farther than 40 mm is put there.
        /// </summary>
        public fixed float place[3];
        /// <summary>Tied to an instrument: its place in `upt_input.instruments`.</summary>
        public uint instrument;
        /// <summary>Tied to the tissue: the other point, as `nodes` and `weights`.</summary>
        public fixed uint other_nodes[3];
        /// <summary>See `other_nodes`.</summary>
        public fixed float other_weights[3];
        /// <summary>N/m, which is mN/mm, at most 1000000; 0: it does not pull.</summary>
        public float stiffness;
        /// <summary>It pulls where it is longer than this, mm.</summary>
        public float slack_mm;
        /// <summary>N s/m, which is mN s/mm.</summary>
        public float damping;
        /// <summary>It breaks under a larger tension at the end of a step, mN; 0: never. Where several would, those break first that are pulled hardest for what they bear.</summary>
        public float break_mn;
        /// <summary>1: it pushes where it is shorter than `slack_mm`, as a rod does; 0: it is a thread.</summary>
        public byte pushes;
        /// <summary>Zero.</summary>
        public fixed byte reserved[3];
    }

    /// <summary>What a tie does at the end of a step; filled by `upt_scene_read_ties`.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct upt_tie_reading
    {
        /// <summary>`sizeof(upt_tie_reading)`, set by the caller, the same in every element of an array.</summary>
        public uint struct_size;
        /// <summary>1: it has broken, in this step or before.</summary>
        public byte broken;
        /// <summary>1: it broke in this step.</summary>
        public byte broke;
        /// <summary>Zero.</summary>
        public fixed byte reserved[2];
        /// <summary>On the tissue at the tie's point, mN.</summary>
        public fixed float force[3];
        /// <summary>From end to end, mm.</summary>
        public float length_mm;
    }

    /// <summary>A bed: what holds a region of the surface, for `upt_scene_bed`.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct upt_bed
    {
        /// <summary>`sizeof(upt_bed)`.</summary>
        public uint struct_size;
        /// <summary>mm: with no `nodes`, the region is what lies this close to `centre` in the last state.</summary>
        public float radius_mm;
        /// <summary>mm, in the mesh's frame.</summary>
        public fixed float centre[3];
        /// <summary>From each node to where it is tied, mm; zeros: where it is in the last state.</summary>
        public fixed float offset[3];
        /// <summary>`[node_count]`: the nodes that it ties.</summary>
        public uint* nodes;
        /// <summary>At most K; 0: those about `centre`.</summary>
        public ulong node_count;
        /// <summary>Of all ties together, N/m.</summary>
        public float stiffness;
        /// <summary>Of each tie, mm.</summary>
        public float slack_mm;
        /// <summary>Of all ties together, N s/m.</summary>
        public float damping;
        /// <summary>Of all ties together, mN; 0: it never breaks.</summary>
        public float break_mn;
        /// <summary>As in `upt_tie`.</summary>
        public byte pushes;
        /// <summary>Zero.</summary>
        public fixed byte reserved[7];
    }

    /// <summary>What is shown of a state. Where a call takes one, NULL is the region.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct upt_view
    {
        /// <summary>`sizeof(upt_view)`.</summary>
        public uint struct_size;
        /// <summary>`UPT_VIEW_*`.</summary>
        public upt_view_kind kind;
        /// <summary>`[node_count]`, only with `UPT_VIEW_NODES`: indices, in the order of the output; NULL with count 0: all nodes.</summary>
        public uint* nodes;
        /// <summary>At most K.</summary>
        public ulong node_count;
    }

    /// <summary>A rigid instrument, as `upt_input` and `upt_scene_contacts_from_instruments` take it.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct upt_instrument
    {
        /// <summary>`sizeof(upt_instrument)`, the same in every element of an array.</summary>
        public uint struct_size;
        /// <summary>`UPT_SHAPE_*`.</summary>
        public upt_shape shape;
        /// <summary>Centre, mm, in the mesh's frame.</summary>
        public fixed float position[3];
        /// <summary>Unit quaternion x, y, z, w; all zero is no rotation.</summary>
        public fixed float rotation[4];
        /// <summary>Half sizes along the local axes, mm; a capsule's half length is `[1]` (local y). A sphere has none.</summary>
        public fixed float half_extents[3];
        /// <summary>A sphere's or a capsule's radius or a spatula's corner radius, mm.</summary>
        public float radius;
        /// <summary>Only for `upt_scene_contacts_from_instruments`. 1: touched nodes move with the instrument until it leaves; 0: they slide.</summary>
        public byte sticking;
        /// <summary>Only for `upt_input`: `UPT_MODE_*`.</summary>
        public upt_mode mode;
        /// <summary>Zero.</summary>
        public fixed byte reserved[2];
        /// <summary>Only for `upt_input`: Coulomb's coefficient, 0 or more.</summary>
        public float friction;
        /// <summary>A grasp tears off when its points together pull harder than this, mN; 0: never.</summary>
        public float tear_off_mn;
        /// <summary>`UPT_SHAPE_HULL`: the `upt_hull`; otherwise NULL.</summary>
        public IntPtr hull;
    }

    /// <summary>What the tissue does to an instrument at the end of a step; filled by `upt_scene_read_instruments`.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct upt_instrument_reading
    {
        /// <summary>`sizeof(upt_instrument_reading)`, set by the caller, the same in every element of an array.</summary>
        public uint struct_size;
        /// <summary>Points of the surface that push or hold the instrument.</summary>
        public uint contact_count;
        /// <summary>On the instrument, mN.</summary>
        public fixed float force[3];
        /// <summary>On the instrument about its position, mN mm.</summary>
        public fixed float torque[3];
        /// <summary>Depth of the deepest point of the surface inside the instrument, mm.</summary>
        public float penetration_mm;
        /// <summary>1: its grasp tore off in this step.</summary>
        public byte torn;
        /// <summary>Zero.</summary>
        public fixed byte reserved[3];
        /// <summary>What the last contact solve left unsolved, mm: 0 where it came to its end.</summary>
        public float residual_mm;
    }

    /// <summary>A point of the surface that pushes or holds an instrument; filled by `upt_scene_read_instrument_contacts`.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct upt_instrument_contact
    {
        /// <summary>Place of the instrument in the step's array.</summary>
        public uint instrument;
        /// <summary>Position of the point, mm.</summary>
        public fixed float position[3];
        /// <summary>On the instrument, mN.</summary>
        public fixed float force[3];
    }

    /// <summary>What an operation has made of the body of a scene; filled by `upt_scene_cut` and the calls beside it.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct upt_cut
    {
        /// <summary>`sizeof(upt_cut)`, set by the caller.</summary>
        public uint struct_size;
        /// <summary>Pieces that were dropped.</summary>
        public uint fragment_count;
        /// <summary>Nodes that the scene has now. Outputs have 3 floats for each.</summary>
        public ulong node_count;
        /// <summary>New ones, the last of them.</summary>
        public ulong copied_count;
        /// <summary>New area of the cut, mm².</summary>
        public float area_mm2;
        /// <summary>Volume that the body has lost, mm³.</summary>
        public float removed_mm3;
        /// <summary>What the tissue does to the blade of `upt_scene_cut_with`, mN.</summary>
        public fixed float force[3];
        /// <summary>1: the body is another one, also where no area is new: its surface wants `upt_scene_update_surface` before it is read.</summary>
        public uint is_changed;
    }

    /// <summary>A blade that feels the tissue. All zero: it feels nothing, and cuts whatever way it goes.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct upt_blade
    {
        /// <summary>`sizeof(upt_blade)`.</summary>
        public uint struct_size;
        /// <summary>Fracture energy of the tissue, J/m², which is mN/mm: what new area takes.</summary>
        public float fracture_energy;
        /// <summary>With how much it must be pushed before a stroke begins to cut, mN, ...</summary>
        public float threshold;
        /// <summary>... and is, mN: of the reading of the instrument that is its body, what points against `ahead`.</summary>
        public float pushed;
        /// <summary>Where the edge is sharp, of any length; zeros: everywhere. It cuts where its way leans from there by less than 60 degrees.</summary>
        public fixed float ahead[3];
        /// <summary>0.</summary>
        public uint reserved;
    }

    /// <summary>The surface of a scene's body, and what of it is new; filled by `upt_scene_update_surface`.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct upt_surface
    {
        /// <summary>`sizeof(upt_surface)`, set by the caller.</summary>
        public uint struct_size;
        /// <summary>
        /// 1: every vertex and triangle is new, so upload all. That is so at the first call, and at the first after `upt_scene_reset` or
        /// `upt_scene_restore` has put another body back.
        /// </summary>
        public uint is_new;
        /// <summary>Vertices now.</summary>
        public ulong vertex_count;
        /// <summary>Slots of triangles now, empty ones included.</summary>
        public ulong triangle_count;
        /// <summary>Vertices from this one on are new.</summary>
        public ulong first_vertex;
        /// <summary>Slots whose corners have changed.</summary>
        public ulong changed_count;
    }

    /// <summary>A force at a point of the tissue, an element of `upt_input.point_forces`; `upt_model_locate_points` finds the point.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct upt_point_force
    {
        /// <summary>`sizeof(upt_point_force)`, the same in every element of an array.</summary>
        public uint struct_size;
        /// <summary>Nodes of the model's mesh around the point, which share the force (where the scene has been cut, the tissue at their places does), ...</summary>
        public fixed uint nodes[4];
        /// <summary>... and their weights, 0 or more, with the sum 1; all zero: the first node alone.</summary>
        public fixed float weights[4];
        /// <summary>mN, at most 1000000 in each direction, in the mesh's frame.</summary>
        public fixed float force[3];
    }

    /// <summary>A pressure on a part of the surface, which follows the surface as it moves. A face in several of them takes their sum.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct upt_pressure
    {
        /// <summary>`sizeof(upt_pressure)`, the same in every element of an array.</summary>
        public uint struct_size;
        /// <summary>From outside on the body, Pa, at most 1000000; negative for suction.</summary>
        public float pascal;
        /// <summary>`[node_count]`: it acts on the boundary triangles with all three corners among these nodes; where the scene has been cut, on what is left of them.</summary>
        public uint* nodes;
        /// <summary>At most K; 0: it acts on the domain, and on all that cuts and removal have laid bare.</summary>
        public ulong node_count;
    }

    /// <summary>What a support group of the bundle does at the end of a step, an element of `upt_input.supports`. `upt_model_read_support` names the groups.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public unsafe struct upt_support
    {
        /// <summary>`sizeof(upt_support)`, the same in every element of an array.</summary>
        public uint struct_size;
        /// <summary>Its place among the bundle's groups, from 0.</summary>
        public uint group;
        /// <summary>As a rigid body in the mesh's frame: a node `x` of the group ends at `R x + position`, mm; at most 40 mm from where it is.</summary>
        public fixed float position[3];
        /// <summary>`R` as a unit quaternion x, y, z, w; all zero is no rotation.</summary>
        public fixed float rotation[4];
        /// <summary>1: the group holds nothing, and its nodes move as all free ones do. Held again, it holds them where they are then. 0: it holds.</summary>
        public byte let_go;
        /// <summary>Zero.</summary>
        public fixed byte reserved[3];
        /// <summary>`[n,3]`, mm, instead of a pose: the displacement of each of the group's nodes at the end of the step; NULL: the pose.</summary>
        public float* displacements;
        /// <summary>3 n, or 0.</summary>
        public ulong displacement_count;
    }

    /// <summary>The C ABI, as it is.</summary>
    public static unsafe class Native
    {
#if UNITY_WEBGL && !UNITY_EDITOR
        const string Library = "__Internal";
#else
        const string Library = "upt";
#endif

        /// <summary>Success.</summary>
        public const upt_status UPT_OK = upt_status.UPT_OK;
        /// <summary>The submitted step has not finished.</summary>
        public const upt_status UPT_PENDING = upt_status.UPT_PENDING;
        /// <summary>A required pointer is NULL.</summary>
        public const upt_status UPT_ERR_NULL = upt_status.UPT_ERR_NULL;
        /// <summary>A size, index, enum or range is wrong.</summary>
        public const upt_status UPT_ERR_ARGUMENT = upt_status.UPT_ERR_ARGUMENT;
        /// <summary>This library does not know this `struct_size`.</summary>
        public const upt_status UPT_ERR_STRUCT_SIZE = upt_status.UPT_ERR_STRUCT_SIZE;
        /// <summary>Not a live handle of this type.</summary>
        public const upt_status UPT_ERR_HANDLE = upt_status.UPT_ERR_HANDLE;
        /// <summary>The scene is in use by another thread or has a step in flight.</summary>
        public const upt_status UPT_ERR_BUSY = upt_status.UPT_ERR_BUSY;
        /// <summary>An input holds NaN or Inf.</summary>
        public const upt_status UPT_ERR_NON_FINITE = upt_status.UPT_ERR_NON_FINITE;
        /// <summary>The call does not fit the state (for instance: wait without submit).</summary>
        public const upt_status UPT_ERR_STATE = upt_status.UPT_ERR_STATE;
        /// <summary>This build or this bundle cannot do it.</summary>
        public const upt_status UPT_ERR_UNSUPPORTED = upt_status.UPT_ERR_UNSUPPORTED;
        /// <summary>There is not enough memory for the call.</summary>
        public const upt_status UPT_ERR_OUT_OF_MEMORY = upt_status.UPT_ERR_OUT_OF_MEMORY;
        /// <summary>ONNX Runtime is missing, too old or broken; the message lists what was tried.</summary>
        public const upt_status UPT_ERR_RUNTIME = upt_status.UPT_ERR_RUNTIME;
        /// <summary>No provider of the list can run the model.</summary>
        public const upt_status UPT_ERR_PROVIDER = upt_status.UPT_ERR_PROVIDER;
        /// <summary>A file cannot be read.</summary>
        public const upt_status UPT_ERR_IO = upt_status.UPT_ERR_IO;
        /// <summary>A bundle is invalid; the message names the file and the field.</summary>
        public const upt_status UPT_ERR_BUNDLE = upt_status.UPT_ERR_BUNDLE;
        /// <summary>The version of a bundle or snapshot is not supported.</summary>
        public const upt_status UPT_ERR_VERSION = upt_status.UPT_ERR_VERSION;
        /// <summary>A snapshot is damaged or belongs to another model.</summary>
        public const upt_status UPT_ERR_SNAPSHOT = upt_status.UPT_ERR_SNAPSHOT;
        /// <summary>The guard refused the new state; the last good state stays.</summary>
        public const upt_status UPT_ERR_GUARD = upt_status.UPT_ERR_GUARD;
        /// <summary>A bug in the library; the scene can only be destroyed.</summary>
        public const upt_status UPT_ERR_PANIC = upt_status.UPT_ERR_PANIC;
        /// <summary>ONNX Runtime's CPU provider and the native kernels.</summary>
        public const upt_provider UPT_PROVIDER_CPU = upt_provider.UPT_PROVIDER_CPU;
        /// <summary>NVIDIA CUDA.</summary>
        public const upt_provider UPT_PROVIDER_CUDA = upt_provider.UPT_PROVIDER_CUDA;
        /// <summary>NVIDIA TensorRT.</summary>
        public const upt_provider UPT_PROVIDER_TENSORRT = upt_provider.UPT_PROVIDER_TENSORRT;
        /// <summary>NVIDIA TensorRT-RTX (a plugin provider).</summary>
        public const upt_provider UPT_PROVIDER_TENSORRT_RTX = upt_provider.UPT_PROVIDER_TENSORRT_RTX;
        /// <summary>A Universal Physics Transformer.</summary>
        public const upt_kind UPT_KIND_UPT = upt_kind.UPT_KIND_UPT;
        /// <summary>A linear-elastic response with a learned correction in a static basis.</summary>
        public const upt_kind UPT_KIND_REDUCED = upt_kind.UPT_KIND_REDUCED;
        /// <summary>No messages.</summary>
        public const upt_log_level UPT_LOG_OFF = upt_log_level.UPT_LOG_OFF;
        /// <summary>Failures.</summary>
        public const upt_log_level UPT_LOG_ERROR = upt_log_level.UPT_LOG_ERROR;
        /// <summary>Fallbacks, and each flag once when it rises: contacts outside the envelope, states that the guard refuses.</summary>
        public const upt_log_level UPT_LOG_WARN = upt_log_level.UPT_LOG_WARN;
        /// <summary>Loading: what was opened and which provider runs it.</summary>
        public const upt_log_level UPT_LOG_INFO = upt_log_level.UPT_LOG_INFO;
        /// <summary>Stage times.</summary>
        public const upt_log_level UPT_LOG_DEBUG = upt_log_level.UPT_LOG_DEBUG;
        /// <summary>Everything.</summary>
        public const upt_log_level UPT_LOG_TRACE = upt_log_level.UPT_LOG_TRACE;
        /// <summary>32-bit floats: the reference. In a scene's options: the model's precision.</summary>
        public const upt_precision UPT_PRECISION_F32 = upt_precision.UPT_PRECISION_F32;
        /// <summary>bfloat16 products where the CPU is faster with them, 32-bit floats elsewhere; the statistics say which.</summary>
        public const upt_precision UPT_PRECISION_BF16 = upt_precision.UPT_PRECISION_BF16;
        /// <summary>16-bit floats: the bundle's `*.f16.onnx`, or a GPU provider's own.</summary>
        public const upt_precision UPT_PRECISION_F16 = upt_precision.UPT_PRECISION_F16;
        /// <summary>8-bit integers: the bundle's `*.int8.onnx`.</summary>
        public const upt_precision UPT_PRECISION_INT8 = upt_precision.UPT_PRECISION_INT8;
        /// <summary>In options only: 32-bit floats, even in a scene of a model that was opened with another precision.</summary>
        public const upt_precision UPT_PRECISION_FORCE_F32 = upt_precision.UPT_PRECISION_FORCE_F32;
        /// <summary>The library chooses the decoder.</summary>
        public const upt_kernel UPT_KERNEL_AUTO = upt_kernel.UPT_KERNEL_AUTO;
        /// <summary>The fused native decoder.</summary>
        public const upt_kernel UPT_KERNEL_NATIVE = upt_kernel.UPT_KERNEL_NATIVE;
        /// <summary>ONNX Runtime sessions in node tiles.</summary>
        public const upt_kernel UPT_KERNEL_ONNX = upt_kernel.UPT_KERNEL_ONNX;
        /// <summary>ONNX Runtime, all nodes in one run with the query table resident on the device.</summary>
        public const upt_kernel UPT_KERNEL_RESIDENT = upt_kernel.UPT_KERNEL_RESIDENT;
        /// <summary>On the CPU: split. On a device: the faster of split and whole, timed while the scene is created.</summary>
        public const upt_step_path UPT_STEP_AUTO = upt_step_path.UPT_STEP_AUTO;
        /// <summary>Native encoder and message mean, then `latent.onnx` and the decoder.</summary>
        public const upt_step_path UPT_STEP_SPLIT = upt_step_path.UPT_STEP_SPLIT;
        /// <summary>The bundle's `step.onnx`, which decodes every node in every step.</summary>
        public const upt_step_path UPT_STEP_WHOLE = upt_step_path.UPT_STEP_WHOLE;
        /// <summary>The faster of split and whole, timed while the scene is created.</summary>
        public const upt_step_path UPT_STEP_MEASURED = upt_step_path.UPT_STEP_MEASURED;
        /// <summary>As many as the bundle recommends, until its own target is reached.</summary>
        public const upt_corrections_mode UPT_CORRECTIONS_RECOMMENDED = upt_corrections_mode.UPT_CORRECTIONS_RECOMMENDED;
        /// <summary>None.</summary>
        public const upt_corrections_mode UPT_CORRECTIONS_NONE = upt_corrections_mode.UPT_CORRECTIONS_NONE;
        /// <summary>`count` of them; with a target or a budget at most so many.</summary>
        public const upt_corrections_mode UPT_CORRECTIONS_COUNT = upt_corrections_mode.UPT_CORRECTIONS_COUNT;
        /// <summary>As many as the target needs and the budget allows, up to 64.</summary>
        public const upt_corrections_mode UPT_CORRECTIONS_AUTO = upt_corrections_mode.UPT_CORRECTIONS_AUTO;
        /// <summary>A switch: as usual, which its field says.</summary>
        public const upt_switch UPT_SWITCH_DEFAULT = upt_switch.UPT_SWITCH_DEFAULT;
        /// <summary>A switch: on.</summary>
        public const upt_switch UPT_SWITCH_ON = upt_switch.UPT_SWITCH_ON;
        /// <summary>A switch: off.</summary>
        public const upt_switch UPT_SWITCH_OFF = upt_switch.UPT_SWITCH_OFF;
        /// <summary>
        /// Keep the last good state and return `UPT_ERR_GUARD`. A step without contact, which the host cannot change, is treated as
        /// under `UPT_GUARD_BLEND`.
        /// </summary>
        public const upt_guard_policy UPT_GUARD_HOLD = upt_guard_policy.UPT_GUARD_HOLD;
        /// <summary>Publish finite states and set flags.</summary>
        public const upt_guard_policy UPT_GUARD_REPORT = upt_guard_policy.UPT_GUARD_REPORT;
        /// <summary>Replace a refused state by the prior's or by rest, and set flags.</summary>
        public const upt_guard_policy UPT_GUARD_BLEND = upt_guard_policy.UPT_GUARD_BLEND;
        /// <summary>A push is longer than the model was trained on.</summary>
        public const upt_flag UPT_FLAG_PUSH = upt_flag.UPT_FLAG_PUSH;
        /// <summary>A contact area is outside the trained range.</summary>
        public const upt_flag UPT_FLAG_CONTACT_AREA = upt_flag.UPT_FLAG_CONTACT_AREA;
        /// <summary>A contact lies outside the domain.</summary>
        public const upt_flag UPT_FLAG_SITE = upt_flag.UPT_FLAG_SITE;
        /// <summary>A push changes faster than trained.</summary>
        public const upt_flag UPT_FLAG_RATE = upt_flag.UPT_FLAG_RATE;
        /// <summary>More separate contact sites than trained.</summary>
        public const upt_flag UPT_FLAG_SITES = upt_flag.UPT_FLAG_SITES;
        /// <summary>Guard: a displacement passes the bound.</summary>
        public const upt_flag UPT_FLAG_BOUND = upt_flag.UPT_FLAG_BOUND;
        /// <summary>Guard: the state is not finite.</summary>
        public const upt_flag UPT_FLAG_NON_FINITE = upt_flag.UPT_FLAG_NON_FINITE;
        /// <summary>An element at the contact is inverted; with `check_inversion` any element, and the guard refuses the state.</summary>
        public const upt_flag UPT_FLAG_INVERTED = upt_flag.UPT_FLAG_INVERTED;
        /// <summary>Guard: the displacement grew too much in one step.</summary>
        public const upt_flag UPT_FLAG_GROWTH = upt_flag.UPT_FLAG_GROWTH;
        /// <summary>The learned correction was bounded.</summary>
        public const upt_flag UPT_FLAG_CLAMPED = upt_flag.UPT_FLAG_CLAMPED;
        /// <summary>The contact block was nearly singular and was regularised.</summary>
        public const upt_flag UPT_FLAG_REGULARISED = upt_flag.UPT_FLAG_REGULARISED;
        /// <summary>
        /// The corrections ended with inverted elements, or had lost the contact of an instrument: the step's first guess or the linear response
        /// took their place.
        /// </summary>
        public const upt_flag UPT_FLAG_FELL_BACK = upt_flag.UPT_FLAG_FELL_BACK;
        /// <summary>The estimated error is above the scene's `error_limit_mm`.</summary>
        public const upt_flag UPT_FLAG_ERROR = upt_flag.UPT_FLAG_ERROR;
        /// <summary>Tissue lies more than 1 mm inside an instrument, or an instrument in the tissue.</summary>
        public const upt_flag UPT_FLAG_DEEP = upt_flag.UPT_FLAG_DEEP;
        /// <summary>The contact solve was cut short by its bounds or the budget and left more than 0.01 mm (`residual_mm` of the readings).</summary>
        public const upt_flag UPT_FLAG_UNSOLVED = upt_flag.UPT_FLAG_UNSOLVED;
        /// <summary>The bundle's tissue relaxes, and this scene makes no corrections, which alone know of it: what it shows and feels is elastic.</summary>
        public const upt_flag UPT_FLAG_ELASTIC = upt_flag.UPT_FLAG_ELASTIC;
        /// <summary>Nodes of the surface.</summary>
        public const upt_index_set UPT_SET_SURFACE_NODES = upt_index_set.UPT_SET_SURFACE_NODES;
        /// <summary>Nodes that instruments may touch.</summary>
        public const upt_index_set UPT_SET_DOMAIN_NODES = upt_index_set.UPT_SET_DOMAIN_NODES;
        /// <summary>Nodes held at zero under the bundle's boundary condition.</summary>
        public const upt_index_set UPT_SET_FIXED_NODES = upt_index_set.UPT_SET_FIXED_NODES;
        /// <summary>Surface triangles, 3 node indices each, outward.</summary>
        public const upt_index_set UPT_SET_SURFACE_FACES = upt_index_set.UPT_SET_SURFACE_FACES;
        /// <summary>Triangles that instruments may touch, 3 node indices each, outward.</summary>
        public const upt_index_set UPT_SET_DOMAIN_FACES = upt_index_set.UPT_SET_DOMAIN_FACES;
        /// <summary>Tetrahedra, 4 node indices each, positive volume.</summary>
        public const upt_index_set UPT_SET_TETS = upt_index_set.UPT_SET_TETS;
        /// <summary>The region's nodes in its order; all nodes where there is no region.</summary>
        public const upt_view_kind UPT_VIEW_REGION = upt_view_kind.UPT_VIEW_REGION;
        /// <summary>The attached points.</summary>
        public const upt_view_kind UPT_VIEW_POINTS = upt_view_kind.UPT_VIEW_POINTS;
        /// <summary>The vertices of the surface as the last `upt_scene_update_surface` left it, each from its place at rest: the lips of cuts too.</summary>
        public const upt_view_kind UPT_VIEW_SURFACE = upt_view_kind.UPT_VIEW_SURFACE;
        /// <summary>The view's own `nodes`, in the region or not. Only `upt_scene_decode` takes it.</summary>
        public const upt_view_kind UPT_VIEW_NODES = upt_view_kind.UPT_VIEW_NODES;
        /// <summary>An instrument's shape: a capsule along local y.</summary>
        public const upt_shape UPT_SHAPE_CAPSULE = upt_shape.UPT_SHAPE_CAPSULE;
        /// <summary>An instrument's shape: a box.</summary>
        public const upt_shape UPT_SHAPE_BOX = upt_shape.UPT_SHAPE_BOX;
        /// <summary>An instrument's shape: a box with rounded corners.</summary>
        public const upt_shape UPT_SHAPE_SPATULA = upt_shape.UPT_SHAPE_SPATULA;
        /// <summary>An instrument's shape: a hull from `upt_hull_create`.</summary>
        public const upt_shape UPT_SHAPE_HULL = upt_shape.UPT_SHAPE_HULL;
        /// <summary>An instrument's shape: a ball of `radius`.</summary>
        public const upt_shape UPT_SHAPE_SPHERE = upt_shape.UPT_SHAPE_SPHERE;
        /// <summary>An instrument pushes, with Coulomb friction.</summary>
        public const upt_mode UPT_MODE_SLIDE = upt_mode.UPT_MODE_SLIDE;
        /// <summary>
        /// An instrument grasps what lies within 0.5 mm of it when the mode changes to this, and holds it until the mode changes back
        /// or the grasp tears off.
        /// </summary>
        public const upt_mode UPT_MODE_GRASP = upt_mode.UPT_MODE_GRASP;
        /// <summary>A tie's far end is in the mesh's frame, which goes with the support.</summary>
        public const upt_end UPT_END_SUPPORT = upt_end.UPT_END_SUPPORT;
        /// <summary>A tie's far end is in the world, which is the mesh's frame where no support moves.</summary>
        public const upt_end UPT_END_WORLD = upt_end.UPT_END_WORLD;
        /// <summary>A tie's far end is on an instrument.</summary>
        public const upt_end UPT_END_INSTRUMENT = upt_end.UPT_END_INSTRUMENT;
        /// <summary>A tie's far end is another point of the tissue: a suture.</summary>
        public const upt_end UPT_END_TISSUE = upt_end.UPT_END_TISSUE;
        /// <summary>Version of the C ABI that `upt_abi_version` returns. Bindings compare it at load.</summary>
        public const uint UPT_ABI_VERSION = 1;

        /// <summary>
        /// Starts the library with options of your own. Optional: opening the first model starts it with the defaults.
        ///
        /// - `options`: NULL means the defaults.
        ///
        /// Threads: any.
        /// Errors: `UPT_ERR_STATE` when the library was started with other options, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_ARGUMENT`.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_init(upt_init_options* options);

        /// <summary>
        /// Shuts the library down. Call it before the process exits if you used a GPU provider.
        ///
        /// Threads: any.
        /// Errors: `UPT_ERR_STATE` while models or scenes exist.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_shutdown();

        /// <summary>
        /// The library's version, for instance "0.1.0".
        ///
        /// Threads: any.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern byte* upt_version();

        /// <summary>
        /// The `UPT_ABI_VERSION` of the library that is loaded. Stop if it differs from the header's.
        ///
        /// Threads: any.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern uint upt_abi_version();

        /// <summary>
        /// The message of the calling thread's last failed call (UTF-8), or "". It stays valid until that thread's next call.
        ///
        /// Threads: any.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern byte* upt_last_error();

        /// <summary>
        /// The name of a status, for instance "UPT_ERR_BUSY"; "UPT_UNKNOWN" for other numbers.
        ///
        /// Threads: any.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern byte* upt_status_name(upt_status status);

        /// <summary>
        /// Sets the function that receives log messages; NULL removes it. When the call returns, the former receiver is no longer
        /// running. It runs on the host's threads only, during a call or at its end; messages of the library's own threads wait
        /// for the next call.
        ///
        /// - `user`: passed to the receiver.
        /// - `level`: `UPT_LOG_*`; less severe messages are not created.
        ///
        /// Threads: any.
        /// Errors: `UPT_ERR_ARGUMENT` for an unknown level, `UPT_ERR_STATE` from the receiver itself, or in a Rust program with a
        /// `tracing` subscriber of its own.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_set_log(IntPtr callback, IntPtr user, upt_log_level level);

        /// <summary>
        /// Lists the providers as JSON: `[{"name":"cpu","available":true,"reason":""}]`. Loads ONNX Runtime.
        ///
        /// - `out`: receives text with its NUL; NULL with capacity 0 only queries the size.
        /// - `needed`: its size in bytes with the NUL, always written; may be NULL.
        ///
        /// Threads: any.
        /// Errors: `UPT_ERR_RUNTIME`, `UPT_ERR_ARGUMENT` if capacity is too small, `UPT_ERR_NULL`.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_providers(byte* @out, ulong capacity, ulong* needed);

        /// <summary>
        /// Opens a bundle, checks it (sizes, dtypes, the SHA-256 of the manifest and of every file that is read) and makes it
        /// ready to step.
        ///
        /// - `path`: the bundle's folder, UTF-8.
        /// - `options`: NULL means the defaults.
        /// - `out`: the new model.
        ///
        /// Threads: any.
        /// Errors: `UPT_ERR_IO`, `UPT_ERR_BUNDLE`, `UPT_ERR_VERSION`, `UPT_ERR_RUNTIME`, `UPT_ERR_PROVIDER`,
        /// `UPT_ERR_UNSUPPORTED`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_ARGUMENT`, `UPT_ERR_NULL`, `UPT_ERR_OUT_OF_MEMORY`.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_model_create(byte* path, upt_model_options* options, IntPtr* @out);

        /// <summary>
        /// Closes a model. Its scenes keep what they need and stay usable.
        ///
        /// Threads: any.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE` (also if it was closed before).
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_model_destroy(IntPtr model);

        /// <summary>
        /// Describes a model in numbers. Set `out-&gt;struct_size` first.
        ///
        /// Threads: any.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_model_read_info(IntPtr model, upt_model_info* @out);

        /// <summary>
        /// Describes a model as JSON: name, bundle hash, the provider of each stage and why the others were not chosen.
        ///
        /// - `out`: receives text with its NUL; NULL with capacity 0 only queries the size.
        /// - `needed`: its size in bytes with the NUL, always written; may be NULL.
        ///
        /// Threads: any.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_ARGUMENT` if capacity is too small.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_model_describe(IntPtr model, byte* @out, ulong capacity, ulong* needed);

        /// <summary>
        /// Copies the rest positions.
        ///
        /// - `out`: `[K,3]` floats, mm.
        /// - `count`: number of floats in `out`, 3 K.
        ///
        /// Threads: any.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_ARGUMENT` when count is not 3 K.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_model_read_positions(IntPtr model, float* @out, ulong count);

        /// <summary>
        /// Copies a static index set.
        ///
        /// - `set`: `UPT_SET_*`.
        /// - `out`: node indices; NULL with capacity 0 only queries the size.
        /// - `capacity`: number of indices that fit in `out`.
        /// - `needed`: number of indices in the set (3 per face, 4 per tetrahedron), always written; may be NULL.
        ///
        /// Threads: any.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_ARGUMENT` (unknown set, capacity too small).
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_model_read_indices(IntPtr model, upt_index_set set, uint* @out, ulong capacity, ulong* needed);

        /// <summary>
        /// Names a support group of a bundle, and copies its nodes: what `upt_input.supports` moves.
        ///
        /// - `group`: from 0; the groups end where this is `UPT_ERR_ARGUMENT` (`upt_model_describe` lists them).
        /// - `name`: receives text with its NUL; NULL with capacity 0 leaves it out.
        /// - `nodes`: node indices, ascending; NULL with capacity 0 only queries the size.
        /// - `node_capacity`: number of indices that fit in `nodes`.
        /// - `needed`: number of nodes of the group, always written; may be NULL.
        ///
        /// Threads: any.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_ARGUMENT` (no such group, a capacity too small).
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_model_read_support(IntPtr model, uint group, byte* name, ulong name_capacity, uint* nodes, ulong node_capacity, ulong* needed);

        /// <summary>
        /// Names a region of the surface that the bundle names, and copies its nodes: what `upt_pressure.nodes` takes.
        ///
        /// - `region`: from 0; the regions end where this is `UPT_ERR_ARGUMENT` (`upt_model_describe` lists them).
        /// - `name`: receives text with its NUL; NULL with capacity 0 leaves it out.
        /// - `nodes`: node indices, ascending; NULL with capacity 0 only queries the size.
        /// - `node_capacity`: number of indices that fit in `nodes`.
        /// - `needed`: number of nodes of the region, always written; may be NULL.
        ///
        /// Threads: any.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_ARGUMENT` (no such region, a capacity too small).
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_model_read_region(IntPtr model, uint region, byte* name, ulong name_capacity, uint* nodes, ulong node_capacity, ulong* needed);

        /// <summary>
        /// Finds points of the intact mesh: of each the tetrahedron that holds it, or of one outside of the mesh the closest combination. What `upt_point_force` takes; some milliseconds
        /// for a large mesh, so find a point once, not in every step.
        ///
        /// - `places`: `[count,3]`, rest positions, mm.
        /// - `count`: number of points.
        /// - `nodes`: `[count,4]`, receives the corners of each one's tetrahedron.
        /// - `weights`: `[count,4]`, receives their weights, 0 or more, with the sum 1.
        ///
        /// Threads: any.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_NON_FINITE`, `UPT_ERR_ARGUMENT` (a point 25 mm or more outside of the mesh), `UPT_ERR_OUT_OF_MEMORY`,
        /// `UPT_ERR_PANIC`.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_model_locate_points(IntPtr model, float* places, ulong count, uint* nodes, float* weights);

        /// <summary>
        /// Creates a scene at rest.
        ///
        /// - `options`: NULL means the defaults.
        /// - `out`: the new scene. The scene keeps what it needs of the model.
        ///
        /// Threads: any.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_ARGUMENT`, `UPT_ERR_NON_FINITE`,
        /// `UPT_ERR_UNSUPPORTED`, `UPT_ERR_IO`, `UPT_ERR_BUNDLE`, `UPT_ERR_OUT_OF_MEMORY`.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_create(IntPtr model, upt_scene_options* options, IntPtr* @out);

        /// <summary>
        /// Destroys a scene, after waiting for a step in flight. A poisoned scene accepts only this call and
        /// `upt_scene_read_stats`.
        ///
        /// Threads: any.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE` (also if it was destroyed before), `UPT_ERR_BUSY` while another thread is in
        /// a call on it.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_destroy(IntPtr scene);

        /// <summary>
        /// Returns the scene to rest, a cut body to the intact one. The region and the attached points stay.
        ///
        /// Threads: one at a time.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`, `UPT_ERR_PANIC`; of a cut body also `UPT_ERR_RUNTIME` and `UPT_ERR_OUT_OF_MEMORY`.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_reset(IntPtr scene);

        /// <summary>
        /// One step of the scene's `dt`, as `input` drives it.
        ///
        /// Instruments are where they will be at the end of the step: each moves there on a straight line from its last pose, and their contact is
        /// solved. An instrument that would move more than 40 mm in a step is placed there without a motion. Contact is unilateral, with
        /// Coulomb friction, at points of the domain's surface at most 1.7 mm apart. A scene with corrections solves it inside each
        /// correction, as a load; with `UPT_CORRECTIONS_NONE` it is solved once, on the linear response. The scene remembers
        /// each place of the array: pass every instrument every time, in the same order.
        ///
        /// - `input`: what drives the step; NULL: nothing does, the tissue moves on by itself.
        /// - `out`: `[n,3]`, mm (n: K, or the region's count; K of a cut body counts the copies of its nodes, `upt_scene_read_node_count`), may be NULL;
        /// it may be the memory of an input, at the cost of a copy.
        /// - `out_count`: number of floats in `out`, 3 n; 0 when out is NULL.
        ///
        /// Threads: one at a time.
        /// Errors: `UPT_ERR_STRUCT_SIZE` for an input of another size; `UPT_ERR_ARGUMENT` also for two drives at once, for a displacement with
        /// instruments and for a node beyond K or listed twice; `UPT_ERR_NON_FINITE`; for instruments `UPT_ERR_UNSUPPORTED` in a build without
        /// feature "instruments" and for a bundle without a linear response, and `UPT_ERR_HANDLE` for a hull that was destroyed; `UPT_ERR_NULL`,
        /// `UPT_ERR_BUSY`, `UPT_ERR_GUARD`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`; the state does not change.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_step(IntPtr scene, upt_input* input, float* @out, ulong out_count);

        /// <summary>
        /// One step of dense fields, `u(t), c(t) -&gt; u(t + dt)`, as the paper writes it: `upt_scene_step` with `displacement` and `collision`.
        ///
        /// - `displacement`: `[K,3]`, mm; NULL uses the scene's own state.
        /// - `collision`: `[K,3]`, mm, zero except at nodes in contact, where it is the displacement that is imposed by the end of the step; NULL
        /// means no contact.
        /// - `out`, `out_count`, threads: as in `upt_scene_step`.
        ///
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT`, `UPT_ERR_NON_FINITE`,
        /// `UPT_ERR_UNSUPPORTED`, `UPT_ERR_GUARD`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`; the state does
        /// not change.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_step_field(IntPtr scene, float* displacement, float* collision, float* @out, ulong out_count);

        /// <summary>
        /// Copies the last published state.
        ///
        /// - `view`: the region (all nodes where there is none), or the attached points; NULL: the region.
        /// - `out`: `[n,3]`, mm, in the view's order.
        /// - `out_count`: number of floats in `out`, 3 n.
        ///
        /// Threads: any, at any time, even while a step runs.
        /// Errors: `UPT_ERR_STATE` for the points when none are attached, `UPT_ERR_UNSUPPORTED` for another view,
        /// `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_ARGUMENT`, `UPT_ERR_PANIC`.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_read(IntPtr scene, upt_view* view, float* @out, ulong out_count);

        /// <summary>
        /// Starts a step on the scene's worker thread and returns at once. An error of an earlier step that was not reported yet
        /// is still reported.
        ///
        /// - `input`: as in `upt_scene_step`; checked and copied before the call returns.
        ///
        /// Threads: one at a time.
        /// Errors: `UPT_ERR_BUSY` while a step is in flight (unless the scene was made with `latest_wins`), `UPT_ERR_NULL`,
        /// `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_ARGUMENT` and `UPT_ERR_NON_FINITE` for the input, `UPT_ERR_UNSUPPORTED` for
        /// instruments in a build without feature "instruments", `UPT_ERR_STATE` if no thread can be started, `UPT_ERR_OUT_OF_MEMORY`,
        /// `UPT_ERR_PANIC`.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_submit(IntPtr scene, upt_input* input);

        /// <summary>
        /// Asks whether the submitted step has finished. Never waits.
        ///
        /// Returns `UPT_OK`, `UPT_PENDING`, or the step's error (once, also after a later submit). With `latest_wins`, `UPT_OK`
        /// means that a step has finished since the last `UPT_OK`, even if another is in flight: a host that submits in every
        /// frame sees every new state.
        ///
        /// Threads: one at a time.
        /// Errors: the step's; `UPT_ERR_STATE` when nothing was submitted, `UPT_ERR_NULL`, `UPT_ERR_HANDLE`.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_poll(IntPtr scene);

        /// <summary>
        /// Waits for the submitted step, at most `timeout_ms` milliseconds.
        ///
        /// Returns `UPT_OK` when no step is in flight, `UPT_PENDING` when the time is up, or the step's error (once).
        ///
        /// Threads: one at a time.
        /// Errors: as `upt_scene_poll`.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_wait(IntPtr scene, uint timeout_ms);

        /// <summary>
        /// Interpolates between the last two states, for frames between steps. Works while a step is in flight.
        ///
        /// - `alpha`: 0 is the state before, 1 the last state; values from 0 to 1.
        /// - `view`: as in `upt_scene_read`.
        /// - `out`: `[n,3]`, mm, in the view's order.
        /// - `out_count`: number of floats in `out`, 3 n.
        ///
        /// Threads: any, at any time, even while a step runs.
        /// Errors: as `upt_scene_read`, and `UPT_ERR_NON_FINITE`.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_sample(IntPtr scene, double alpha, upt_view* view, float* @out, ulong out_count);

        /// <summary>
        /// Limits a step to these nodes: `upt_scene_step`, `_read` and `_sample` write them alone, in this order. Fewer nodes
        /// make a cheaper step.
        ///
        /// - `nodes`: `[n]` indices, n at most K, in any order; NULL with count 0: all nodes.
        ///
        /// Threads: one at a time.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT` for an index of K or more or too many of
        /// them, `UPT_ERR_UNSUPPORTED` for a cut body, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_set_region(IntPtr scene, uint* nodes, ulong count);

        /// <summary>
        /// Computes any nodes of the last state, in the region or not.
        ///
        /// - `view`: of kind `UPT_VIEW_NODES` its nodes; others as in `upt_scene_read`.
        /// - `out`: `[n,3]`, mm, in the view's order.
        /// - `out_count`: number of floats in `out`, 3 n.
        ///
        /// Threads: one at a time.
        /// Errors: `UPT_ERR_BUSY`, `UPT_ERR_STATE` for nodes before the first step, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, and as
        /// `upt_scene_read`.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_decode(IntPtr scene, upt_view* view, float* @out, ulong out_count);

        /// <summary>
        /// Attaches points to the tissue, which views of kind `UPT_VIEW_POINTS` show. They replace those attached before. A bundle of kind `upt` decodes each point in every
        /// step (unless the scene has `interpolate_points`); one of kind `reduced` interpolates between nodes.
        ///
        /// - `points`: `[n,3]`, rest positions, mm; NULL with count 0 detaches.
        /// - `count`: number of points, n.
        ///
        /// Threads: one at a time.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`, `UPT_ERR_NON_FINITE`, `UPT_ERR_ARGUMENT`,
        /// `UPT_ERR_UNSUPPORTED`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_attach_points(IntPtr scene, float* points, ulong count);

        /// <summary>
        /// Copies the force, torque and penetration of each instrument at the end of the last step.
        ///
        /// - `out`: `[count]`, in the order of the step's instruments; set `struct_size` of every element.
        /// - `count`: instruments of that step.
        ///
        /// Threads: any, at any time, even while a step runs.
        /// Errors: `UPT_ERR_UNSUPPORTED` in a build without feature "instruments", `UPT_ERR_NULL`, `UPT_ERR_HANDLE`,
        /// `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_ARGUMENT` if the last step had another number of instruments.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_read_instruments(IntPtr scene, upt_instrument_reading* @out, ulong count);

        /// <summary>
        /// Copies the points of the surface that pushed or held instruments at the end of the last step, ascending by instrument.
        ///
        /// - `out`: `[capacity]`; NULL with capacity 0 only queries the size.
        /// - `needed`: number of points, always written; may be NULL.
        ///
        /// Threads: any, at any time, even while a step runs.
        /// Errors: `UPT_ERR_UNSUPPORTED` in a build without feature "instruments", `UPT_ERR_NULL`, `UPT_ERR_HANDLE`,
        /// `UPT_ERR_ARGUMENT` if capacity is too small.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_read_instrument_contacts(IntPtr scene, upt_instrument_contact* @out, ulong capacity, ulong* needed);

        /// <summary>
        /// Creates the shape of a tool of your own, for `UPT_SHAPE_HULL`: a closed surface of triangles with all its hollows, or the convex hull of points.
        ///
        /// - `points`: `[n,3]`, mm, in the tool's own frame.
        /// - `point_count`: n, 4 to 100,000.
        /// - `faces`: `[m,3]`, points of each triangle, all clockwise or all anticlockwise; each edge belongs to two. NULL with `face_count` 0: the convex
        /// hull of the points.
        /// - `face_count`: m, at most 200,000.
        /// - `out`: the new hull.
        ///
        /// Threads: any.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_ARGUMENT` for points that are not finite, too many, or without volume, and for a surface that is not closed,
        /// crosses itself, has a part inside out or a wall of less than 0.2 mm,
        /// `UPT_ERR_UNSUPPORTED` in a build without feature "instruments", `UPT_ERR_OUT_OF_MEMORY`.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_hull_create(float* points, ulong point_count, uint* faces, ulong face_count, IntPtr* @out);

        /// <summary>
        /// Destroys a hull. Steps that were submitted with it keep what they need.
        ///
        /// Threads: any.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE` (also if it was destroyed before).
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_hull_destroy(IntPtr hull);

        /// <summary>
        /// Copies what each tie of the last step does at its end.
        ///
        /// - `out`: `[count]`, in the order of the step's ties; set `struct_size` of every element.
        /// - `count`: ties of that step.
        ///
        /// Threads: any, at any time, even while a step runs.
        /// Errors: `UPT_ERR_UNSUPPORTED` in a build without feature "instruments", `UPT_ERR_NULL`, `UPT_ERR_HANDLE`,
        /// `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_ARGUMENT` if the last step had another number of ties.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_read_ties(IntPtr scene, upt_tie_reading* @out, ulong count);

        /// <summary>
        /// Finds the points of the tissue nearest to places, for ties: of the domain, the surface that instruments may touch, where it is in the last state.
        ///
        /// - `places`: `[count,3]`, mm, in the mesh's frame; at most 1,000,000.
        /// - `nodes`: `[count,3]`, `weights`: `[count,3]`: of each the nodes of a face and the weights of its corners, for `upt_tie`.
        ///
        /// Threads: any, at any time, even while a step runs.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_NON_FINITE`, `UPT_ERR_ARGUMENT` for too many and for a bundle without a domain,
        /// `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_UNSUPPORTED` for a cut body and in a build without feature "instruments"; nothing is written then.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_tie_points(IntPtr scene, float* places, ulong count, uint* nodes, float* weights);

        /// <summary>
        /// Makes a bed: a tie at each free node of the domain within a region, from where the node is in the last state. Pass them in every step; a bed tears node by node.
        ///
        /// - `bed`: its region, and what holds there altogether: stiffness, damping and break force are shared among the ties by the area of surface around each node.
        /// - `ties`: `[capacity]`, ascending by node; set `struct_size` of every element. NULL with capacity 0 only queries the size.
        /// - `needed`: number of ties, written whenever there is a bed.
        ///
        /// Threads: any, at any time, even while a step runs.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_NON_FINITE`, `UPT_ERR_ARGUMENT` for a region without such nodes or with more than
        /// 256, for a number that no tie can have, and if capacity is too small; `UPT_ERR_UNSUPPORTED` for a cut body and in a build without feature "instruments";
        /// `UPT_ERR_OUT_OF_MEMORY`.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_bed(IntPtr scene, upt_bed* bed, upt_tie* ties, ulong capacity, ulong* needed);

        /// <summary>
        /// Cuts along the way of a blade's edge through the tissue as it is now. Elements that the blade touches become two, with copies of
        /// nodes where they have come apart, so that the lips lie on the blade's path to a tenth of an element's edge; mass and volume stay, and nothing moves before the
        /// next step.
        ///
        /// The scene has more nodes then (`out-&gt;node_count`): those that there were keep their numbers, and outputs have `3 * node_count` floats. The elements make each step from then on,
        /// with instruments, nodes, loads or without. Frames between steps, regions, attached points (each goes with the side on which it lies) and haptics go on. A step that
        /// starts from a displacement is `UPT_ERR_UNSUPPORTED` until `upt_scene_reset`, or until a snapshot from before is restored, which is undo.
        ///
        /// - `stroke`: calls with the same number are one blade that goes on; another number cuts anew.
        /// - `points`: `[pose_count, edge_count, 3]`, mm: the edge as a line of points, at each pose.
        /// - `pose_count`: 2 or more.
        /// - `edge_count`: 2 for a straight edge, or more.
        /// - `out`: what was done; set `struct_size`.
        ///
        /// Threads: one at a time.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT` for a blade that sweeps no area or more copies than
        /// nodes, `UPT_ERR_NON_FINITE`, `UPT_ERR_UNSUPPORTED` for a scene without corrections or one whose support moves,
        /// `UPT_ERR_BUNDLE`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`. The scene is then what it was.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_cut(IntPtr scene, uint stroke, float* points, ulong pose_count, ulong edge_count, upt_cut* @out);

        /// <summary>
        /// Cuts as `upt_scene_cut`, by a blade that feels the tissue and that the tissue feels.
        ///
        /// It cuts where it goes where its edge is sharp and, until its stroke has begun to cut, is pushed with the threshold at least. Else nothing changes and
        /// `out-&gt;area_mm2` is 0: an instrument that is the blade's body presses meanwhile; leave it out while the blade cuts. What it lays open takes the fracture energy: `out-&gt;force` is
        /// `-G dA / ds`, and the next step ends with its reaction on the tissue there. What goes over again what its stroke has laid open feels nothing.
        ///
        /// - `blade`: NULL: `upt_scene_cut`.
        /// - `stroke`, `points`, `pose_count`, `edge_count`, `out`: as there.
        ///
        /// Threads: one at a time.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT` as there and for an energy or a threshold below 0,
        /// `UPT_ERR_NON_FINITE`, `UPT_ERR_UNSUPPORTED` as there, `UPT_ERR_BUNDLE`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`. The
        /// scene is then what it was.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_cut_with(IntPtr scene, upt_blade* blade, uint stroke, float* points, ulong pose_count, ulong edge_count, upt_cut* @out);

        /// <summary>
        /// Removes what lies inside of an instrument, the deepest first, up to a volume: an aspirator with a rate takes that times the step. Elements go in 64 parts
        /// each. What `upt_scene_cut` says of a cut scene holds.
        ///
        /// - `instrument`: its shape and pose; friction and mode do not matter.
        /// - `most_mm3`: largest volume.
        /// - `out`: what was done; set `struct_size`.
        ///
        /// Threads: one at a time.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT` for the instrument or where nothing would be
        /// left, `UPT_ERR_NON_FINITE`, `UPT_ERR_UNSUPPORTED` as `upt_scene_cut` and in a build without feature "instruments",
        /// `UPT_ERR_BUNDLE`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`. The scene is then what it was.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_remove(IntPtr scene, upt_instrument* instrument, float most_mm3, upt_cut* @out);

        /// <summary>
        /// Parts tissue that is longer than `stretch` times its length at rest in some direction, across that direction as a blade would: the most stretched elements
        /// first. Nothing tears unless this is called; called once before each step, a tear grows from step to step. What `upt_scene_cut` says of a cut scene holds.
        ///
        /// - `stroke`: calls with the same number are one tear that goes on, as in `upt_scene_cut`: what it has parted it does not part again.
        /// - `stretch`: the largest principal stretch that the tissue bears, above 1; it is a property of the tissue that no bundle states.
        /// - `most`: elements at most whose stretch starts a tear in this call; those that it touches part with them.
        /// - `out`: what was done; set `struct_size`. `area_mm2` is what has been laid open, 0 where nothing is stretched so far.
        ///
        /// Threads: one at a time.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT` for a stretch that is not above 1 or more copies than
        /// nodes, `UPT_ERR_UNSUPPORTED` as `upt_scene_cut`, `UPT_ERR_BUNDLE`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`. The scene is then
        /// what it was.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_tear(IntPtr scene, uint stroke, float stretch, uint most, upt_cut* @out);

        /// <summary>
        /// Multiplies the stiffness of elements of the model's mesh: coagulation, oedema, softening. What `upt_scene_cut` says of a cut scene holds.
        ///
        /// - `elements`: `[count]` rows of `UPT_INDICES_TETS`.
        /// - `factor`: what an element has then must lie between 0.001 and 1000 times its own stiffness.
        /// - `out`: what was done; set `struct_size`.
        ///
        /// Threads: one at a time.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT`, `UPT_ERR_UNSUPPORTED` as `upt_scene_cut`,
        /// `UPT_ERR_BUNDLE`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`. The scene is then what it was.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_scale_stiffness(IntPtr scene, uint* elements, ulong count, float factor, upt_cut* @out);

        /// <summary>
        /// Takes the pieces that nothing holds out of the body.
        ///
        /// - `out`: what was done; set `struct_size`.
        ///
        /// Threads: one at a time.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT`, `UPT_ERR_UNSUPPORTED` as `upt_scene_cut`,
        /// `UPT_ERR_BUNDLE`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`. The scene is then what it was.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_drop_fragments(IntPtr scene, upt_cut* @out);

        /// <summary>
        /// Writes how many nodes the scene has now: K, and the copies that cuts have made. Wherever this header says K of a scene, it is this number. It
        /// changes with `upt_scene_cut` and the calls beside it, `upt_scene_restore` and `upt_scene_reset`.
        ///
        /// Threads: any, at any time, even while a step runs.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_ARGUMENT` for a place that is not aligned, `UPT_ERR_PANIC`.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_read_node_count(IntPtr scene, ulong* @out);

        /// <summary>
        /// Brings the closed surface of the body up to date: the mesh's own where nothing has happened, the lips of cuts, and what removal has laid
        /// bare. Tells what has changed since the last call. Where the body has not changed since, it does nothing, so it may be called in every frame.
        ///
        /// Vertices and slots of triangles keep their numbers, so that a renderer uploads the vertices from `first_vertex` on and the slots that
        /// `upt_scene_read_surface` lists, unless `is_new` is 1. The first vertices are the nodes of the mesh, also those inside, which no triangle has;
        /// vertices that nothing uses any more stay. Works on an intact body, too.
        ///
        /// - `out`: counts; set `struct_size`.
        ///
        /// Threads: one at a time.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT`, `UPT_ERR_RUNTIME`,
        /// `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_update_surface(IntPtr scene, upt_surface* @out);

        /// <summary>
        /// Copies the surface as the last `upt_scene_update_surface` left it, with the counts that it gave. An array that is NULL is not wanted.
        ///
        /// - `rest`: `[vertex_count, 3]`, mm: where each vertex lies in the tissue at rest, for textures, also on faces that a cut has opened.
        /// - `triangles`: `[triangle_count, 3]` vertices, outward; 0, 0, 0 in slots that are empty.
        /// - `inside`: `[triangle_count]`: 1 where the triangle was inside of the intact body, else 0.
        /// - `changed`: `[changed_count]`: the slots that the last update has changed, ascending.
        ///
        /// Threads: one at a time in the calls of a scene's surface; another may step meanwhile.
        /// Errors: `UPT_ERR_STATE` before the first update, `UPT_ERR_ARGUMENT` for other counts and an array that is not aligned, `UPT_ERR_HANDLE`,
        /// `UPT_ERR_NULL` for the scene, `UPT_ERR_BUSY`, `UPT_ERR_PANIC`.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_read_surface(IntPtr scene, float* rest, ulong vertex_count, uint* triangles, byte* inside, ulong triangle_count, uint* changed, ulong changed_count);

        /// <summary>
        /// Copies where the vertices of the surface are in the last published state.
        ///
        /// - `out`: `[vertex_count, 3]`, mm.
        /// - `out_count`: number of floats in `out`, 3 `vertex_count`.
        ///
        /// Threads: one at a time in the calls of a scene's surface; another may step meanwhile.
        /// Errors: `UPT_ERR_STATE` where the body has changed since the last `upt_scene_update_surface`, `UPT_ERR_ARGUMENT`, `UPT_ERR_UNSUPPORTED` for a scene
        /// with a region, `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`, `UPT_ERR_PANIC`.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_read_surface_positions(IntPtr scene, float* @out, ulong out_count);

        /// <summary>
        /// The tissue at a moment between steps, with the instruments where they are at that moment: frames without lag.
        ///
        /// The velocities of the last published state continue as far as the instruments do, and contact is solved at the poses given here with
        /// the compliance of that time. Any frame rate works, even an uneven one, and a submitted step may be in flight. When a step arrives, the
        /// frames start from where they would have been without it. They blend into the new step within two fifths of a step, or at 25 mm/s where
        /// that takes longer, but always within two steps.
        ///
        /// - `input`: what drives the tissue, where it is at `when`: instruments, or for scenes that nodes drive these nodes and where they are.
        /// Nodes of the last step that are no longer listed are released: they lose the force that held them. `supports` says where support
        /// groups are at `when`; without any, they go on as they went. A group is seen from the first step on that moves it. Other loads are
        /// those of the step. Neither `displacement` nor `time_s` may be set. NULL: nothing touches the tissue.
        /// - `when`: the moment on the clock of the steps' `time_s`, s, not before that of the last published step; for hosts whose steps have
        /// no time, the time since the last published step. Velocities are followed for two steps at most.
        /// - `view`: the region, the attached points, or the vertices of the surface, `rest + out` of `upt_scene_read_surface`; NULL: the region.
        /// - `out`: `[n,3]`, mm, in the view's order.
        /// - `out_count`: number of floats in `out`, 3 n.
        ///
        /// Threads: one thread at a time presents; another may step or submit meanwhile.
        /// Errors: `UPT_ERR_BUSY` while another thread presents, and if a step is in flight at the first call;
        /// `UPT_ERR_UNSUPPORTED` in a build without feature "instruments", for a bundle without a linear response or corrections, and
        /// for a scene without corrections; `UPT_ERR_STATE` for the points when none are attached, and for the
        /// surface where the body has changed since the last `upt_scene_update_surface`; `UPT_ERR_UNSUPPORTED` for the surface of a scene with a region; `UPT_ERR_NULL`, `UPT_ERR_HANDLE`,
        /// `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_ARGUMENT`, `UPT_ERR_NON_FINITE`, `UPT_ERR_RUNTIME`, `UPT_ERR_IO`, `UPT_ERR_BUNDLE`,
        /// `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_present(IntPtr scene, upt_input* input, double when, upt_view* view, float* @out, ulong out_count);

        /// <summary>
        /// Lets a hand feel a tool: from now on, each step of the scene prepares what `upt_haptics_render` needs.
        ///
        /// Drive the steps of the scene as before, with this tool among their instruments. The object does not keep the scene
        /// alive.
        ///
        /// - `options`: required, for its tool.
        /// - `out`: the new object. At most 8 per scene and 64 per process.
        ///
        /// Threads: one at a time on the scene.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE` (also for a hull that was destroyed), `UPT_ERR_STRUCT_SIZE`,
        /// `UPT_ERR_ARGUMENT`, `UPT_ERR_NON_FINITE`, `UPT_ERR_BUSY` also while a step is in flight, `UPT_ERR_UNSUPPORTED` in a
        /// build without feature "instruments", for a bundle without a linear response or corrections, and for a scene without
        /// corrections; `UPT_ERR_RUNTIME`, `UPT_ERR_IO`, `UPT_ERR_BUNDLE`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_haptics_create(IntPtr scene, upt_haptics_options* options, IntPtr* @out);

        /// <summary>
        /// The force on the tool at a pose, with contact solved on what the last step prepared. Made for 1,000 calls a second.
        ///
        /// Waits for nothing, whatever the scene does: no lock, and no allocation unless it fails. A new step is blended in
        /// without a jump. Out of contact the force is zero. If the scene is no longer stepped, `age_s` grows and the tissue
        /// stays as elastic as the last step left it. In this call lengths are metres, forces newtons and torques newton metres.
        ///
        /// - `pose`: where the tool is now.
        /// - `out`: set its `struct_size` first. If the call fails and `out` can be written, its force is zero.
        ///
        /// Threads: one at a time on the object; any other on the scene.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_NON_FINITE` and `UPT_ERR_ARGUMENT` for the
        /// pose and a time before the last; `UPT_ERR_BUSY` while another thread is in a call on this object; `UPT_ERR_STATE` once
        /// the scene was destroyed; `UPT_ERR_UNSUPPORTED` in a build without feature "instruments"; `UPT_ERR_PANIC`.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_haptics_render(IntPtr haptics, upt_haptic_pose* pose, upt_haptic_force* @out);

        /// <summary>
        /// Destroys a haptics object. Its scene stays usable.
        ///
        /// Threads: any.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE` (also if it was destroyed before), `UPT_ERR_BUSY` while another thread is in
        /// a call on it, `UPT_ERR_UNSUPPORTED` in a build without feature "instruments".
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_haptics_destroy(IntPtr haptics);

        /// <summary>
        /// Finds the nodes that rigid instruments touch, and the displacement that they impose there: the input of a step.
        ///
        /// The scene remembers what each place of the array touches until the array's length changes or `upt_scene_reset`: pass
        /// every instrument every time, in the same order. NULL with count 0 releases all.
        ///
        /// - `instruments`: at most 64, all with the same `struct_size`, of every shape that `upt_scene_step` takes.
        /// - `contact_nodes`: `[capacity]`, `contact_vectors`: `[capacity,3]`, mm; both may be NULL with capacity 0, which only
        /// queries the count.
        /// - `contact_count`: number of contacts found, always written.
        ///
        /// Threads: one at a time.
        /// Errors: `UPT_ERR_UNSUPPORTED` in a build without feature "instruments", `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`,
        /// `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_NON_FINITE`, `UPT_ERR_ARGUMENT` (also when capacity is too small),
        /// `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_contacts_from_instruments(IntPtr scene, upt_instrument* instruments, ulong instrument_count, uint* contact_nodes, float* contact_vectors, ulong capacity, ulong* contact_count);

        /// <summary>
        /// Copies the reaction of the tissue at the last step's contact nodes, in their order.
        ///
        /// A bundle with a linear response (`prior_forces` of the statistics is 1) gives the contact forces of that response,
        /// `-A_CC^-1 c`: nodes that borrow a column of the compliance share its force, and held nodes and nodes far from the
        /// domain get zero. Other bundles give the elastic force of the elements around each node at the last state. Both leave
        /// out inertia and damping.
        ///
        /// - `out`: `[m,3]`, mN, the force on the instrument.
        /// - `out_count`: number of floats in `out`, 3 m.
        ///
        /// Threads: one at a time.
        /// Errors: `UPT_ERR_UNSUPPORTED` in a build without feature "instruments", `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`,
        /// `UPT_ERR_ARGUMENT`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`; `UPT_ERR_UNSUPPORTED` also for a cut body.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_read_contact_force(IntPtr scene, float* @out, ulong out_count);

        /// <summary>
        /// Reports what the last step did. Set `out-&gt;struct_size` first. Works while a step is in flight and
        /// on a poisoned scene.
        ///
        /// Threads: any.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_read_stats(IntPtr scene, upt_scene_stats* @out);

        /// <summary>
        /// Reports how long the last step and its stages took. Set `out-&gt;struct_size` first. Works as `upt_scene_read_stats` does.
        ///
        /// Threads: any.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_read_timing(IntPtr scene, upt_scene_timing* @out);

        /// <summary>
        /// Saves the state, so that it can be restored exactly.
        ///
        /// - `out`: bytes; NULL with capacity 0 only queries the size.
        /// - `capacity`: size of `out` in bytes.
        /// - `needed`: size of the snapshot in bytes, always written; may be NULL.
        ///
        /// Threads: one at a time.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT` if capacity is too small,
        /// `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_save(IntPtr scene, byte* @out, ulong capacity, ulong* needed);

        /// <summary>
        /// Restores a snapshot of the same model.
        ///
        /// Threads: one at a time.
        /// Errors: `UPT_ERR_SNAPSHOT`, `UPT_ERR_VERSION`, `UPT_ERR_ARGUMENT`, `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`,
        /// `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`, `UPT_ERR_UNSUPPORTED` for one of a cut body in a scene with a region, attached points or
        /// haptics; the state does not change.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_restore(IntPtr scene, byte* bytes, ulong count);

        /// <summary>
        /// Begins to record what the scene is given: steps, submitted ones when they are made, cuts and what is like them, resets, restored snapshots and
        /// regions, each as a line of JSON that `upt replay --verify` follows on any machine. Calls that fail have no line. A scene that is not at rest puts
        /// its state first. The lines stay in memory until `upt_scene_take_record` takes them.
        ///
        /// - `every`: after how many steps the SHA-256 of what `upt_scene_read` gives is written, 1 or more; 0 ends the recording.
        ///
        /// Threads: one at a time.
        /// Errors: `UPT_ERR_STATE` where a recording is on, where there is none to end, and where the last one has not been taken; `UPT_ERR_UNSUPPORTED` for a scene
        /// with a budget of time or with a mesh of its own; `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_record(IntPtr scene, uint every);

        /// <summary>
        /// Copies the lines of the recording that were not taken before, and forgets them. One after the other they make the file: take them now and then in a long
        /// session, and once after its end, whose line says that nothing is missing.
        ///
        /// - `out`: whole lines, UTF-8, without a NUL; NULL with capacity 0 only queries the size.
        /// - `capacity`: size of `out` in bytes; more than enough is fine, since a step in flight may add a line after the size was asked for.
        /// - `needed`: bytes that there are, 0 where there is no recording; always written.
        ///
        /// Threads: any, at any time, even while a step runs.
        /// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_ARGUMENT` if capacity is too small, `UPT_ERR_PANIC`; the lines stay.
        /// </summary>
        [DllImport(Library, CallingConvention = CallingConvention.Cdecl)]
        public static extern upt_status upt_scene_take_record(IntPtr scene, byte* @out, ulong capacity, ulong* needed);
    }
}
