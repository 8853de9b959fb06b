/* SoftTissue3D: a MeshInstance3D whose surface libupt moves.
 *
 * Axes: a bundle is RAS in millimetres; Godot is right-handed with y up, in metres. The map
 * (x, y, z) -> (x, z, -y) / 1000 is a quarter turn about x, so windings stay outward (Godot draws
 * clockwise faces as front, which `faces` takes into account).
 *
 * What stands as `///` above a function that METHODS or PROPERTIES names is its text in
 * docs/reference/gdscript.md (`cargo xtask api`). */
#include "soft_tissue.hpp"
#include "godot_api.h"

#include <exception>
#include <memory>
#include <string>
#include <vector>

static const char CLASS_NAME[] = "SoftTissue3D";
static const float METRES = 0.001f;

/// Opens a bundle's folder, at rest, with the properties as they are now; closes what was open.
static void open_bundle(void *instance, const GDExtensionConstTypePtr *arguments,
                        GDExtensionTypePtr result) {
  auto *self = static_cast<SoftTissue *>(instance);
  self->tissue.reset();
  put(result, guarded(self, [&] {
        std::string path(static_cast<std::size_t>(godot.string_to_utf8(arguments[0], nullptr, 0)),
                         0);
        godot.string_to_utf8(arguments[0], path.data(), static_cast<GDExtensionInt>(path.size()));
        self->tissue = std::make_unique<Tissue>(path, self->effort);
      }));
}

/* Vertices in Godot's axes: rest + scale * displacement. */
static void put_vertices(void *instance, float scale, GDExtensionTypePtr array) {
  opened(instance, [&](const Tissue &tissue) {
    const std::vector<float> &rest = tissue.rest(), &moved = tissue.displacement();
    int64_t count = static_cast<int64_t>(rest.size() / 3), previous = 0;
    GDExtensionConstTypePtr arguments[1] = {&count};
    godot.resize_vector3(array, arguments, &previous, 1);
    auto *out = static_cast<float *>(count > 0 ? godot.vector3_at(array, 0) : nullptr);
    for (std::size_t i = 0; i < rest.size(); i += 3) {
      const float *p = &rest[i], *u = &moved[i];
      out[i] = (p[0] + scale * u[0]) * METRES;
      out[i + 1] = (p[2] + scale * (u[2] + tissue.height())) * METRES;
      out[i + 2] = -(p[1] + scale * u[1]) * METRES;
    }
  });
}

/// The vertices of the surface at rest, m.
static void rest(void *instance, const GDExtensionConstTypePtr *, GDExtensionTypePtr result) {
  put_vertices(instance, 0.0f, result);
}

/// The vertices of the surface at the moment of the last `frame`, m.
static void vertices(void *instance, const GDExtensionConstTypePtr *, GDExtensionTypePtr result) {
  put_vertices(instance, 1.0f, result);
}

/// The surface's triangles: three places in `vertices()` for each, clockwise as seen from outside.
static void faces(void *instance, const GDExtensionConstTypePtr *, GDExtensionTypePtr result) {
  opened(instance, [&](const Tissue &tissue) {
    const std::vector<std::uint32_t> &all = tissue.faces();
    int64_t count = static_cast<int64_t>(all.size()), previous = 0;
    GDExtensionConstTypePtr size[1] = {&count};
    godot.resize_int32(result, size, &previous, 1);
    int32_t *out = count > 0 ? godot.int32_at(result, 0) : nullptr;
    for (std::size_t i = 0; i < all.size(); i += 3) {
      out[i] = static_cast<int32_t>(all[i]);
      out[i + 1] = static_cast<int32_t>(all[i + 2]);
      out[i + 2] = static_cast<int32_t>(all[i + 1]);
    }
  });
}

/// What holds the organ goes up and down from now on: by the amplitude (m), once a period (s). An
/// amplitude of 0 ends it.
static void breathe(void *instance, const GDExtensionConstTypePtr *arguments,
                    GDExtensionTypePtr result) {
  put(result, opened(instance, [&](Tissue &tissue) {
        tissue.breathe(static_cast<float>(real(arguments[0])) / METRES, real(arguments[1]));
      }));
}

/// Makes the surface of this moment by a clock of your own, s, and the next step, which runs on a
/// worker, where it is due. Call it once a frame.
static void frame(void *instance, const GDExtensionConstTypePtr *arguments,
                  GDExtensionTypePtr result) {
  put(result, opened(instance, [&](Tissue &tissue) { tissue.frame(real(arguments[0])); }));
}

/// Waits until the step in flight has landed: for tests, and pictures that are the same everywhere.
static void wait(void *instance, const GDExtensionConstTypePtr *, GDExtensionTypePtr result) {
  put(result, opened(instance, [](Tissue &tissue) { tissue.wait(); }));
}

/// What the last step took, ms.
static void step_ms(void *instance, const GDExtensionConstTypePtr *, GDExtensionTypePtr result) {
  auto &out = *static_cast<double *>(result);
  out = 0;
  opened(instance, [&](const Tissue &tissue) { out = tissue.timing().step_ms; });
}

/// Points of the tissue that push or hold the tool in the last step.
static void contact_count(void *instance, const GDExtensionConstTypePtr *,
                          GDExtensionTypePtr result) {
  auto &out = *static_cast<int64_t *>(result);
  out = 0;
  opened(instance, [&](const Tissue &tissue) { out = tissue.reading().contact_count; });
}

/// The force on the tool in the last step, mN.
static void force(void *instance, const GDExtensionConstTypePtr *, GDExtensionTypePtr result) {
  auto *out = static_cast<float *>(result);
  out[0] = out[1] = out[2] = 0;
  opened(instance, [&](const Tissue &tissue) {
    const float *f = tissue.reading().force;
    out[0] = f[0];
    out[1] = f[2];
    out[2] = -f[1];
  });
}

/// How deep tissue lies inside of the tool at the end of the last step, mm.
static void penetration(void *instance, const GDExtensionConstTypePtr *,
                        GDExtensionTypePtr result) {
  auto &out = *static_cast<double *>(result);
  out = 0;
  opened(instance, [&](const Tissue &tissue) { out = tissue.reading().penetration_mm; });
}

/// Flags of the last step: a sum of `UPT_FLAG_*` of [the C ABI](abi.md), 0 when all is well.
static void flags(void *instance, const GDExtensionConstTypePtr *, GDExtensionTypePtr result) {
  auto &out = *static_cast<int64_t *>(result);
  out = 0;
  opened(instance, [&](const Tissue &tissue) { out = tissue.stats().flags; });
}

/// Corrections that the last step made.
static void corrections_made(void *instance, const GDExtensionConstTypePtr *,
                             GDExtensionTypePtr result) {
  auto &out = *static_cast<int64_t *>(result);
  out = 0;
  opened(instance, [&](const Tissue &tissue) { out = tissue.stats().corrections; });
}

/// The estimated error of the last step, mm; 0 without corrections.
static void error_mm(void *instance, const GDExtensionConstTypePtr *, GDExtensionTypePtr result) {
  auto &out = *static_cast<double *>(result);
  out = 0;
  opened(instance, [&](const Tissue &tissue) { out = tissue.stats().error_mm; });
}

static Effort &effort(void *instance) { return static_cast<SoftTissue *>(instance)->effort; }

/// The most corrections that a step in contact gets, 1 to 64; 0: what the bundle recommends; -1:
/// none. `open` reads it.
static void set_corrections(void *instance, const GDExtensionConstTypePtr *arguments,
                            GDExtensionTypePtr) {
  effort(instance).corrections = *static_cast<const int64_t *>(arguments[0]);
}

static void get_corrections(void *instance, const GDExtensionConstTypePtr *,
                            GDExtensionTypePtr result) {
  *static_cast<int64_t *>(result) = effort(instance).corrections;
}

/// Corrections end where the estimated error is below this, mm; 0: always all of them. `open` reads
/// it.
static void set_target(void *instance, const GDExtensionConstTypePtr *arguments,
                       GDExtensionTypePtr) {
  effort(instance).target_mm = real(arguments[0]);
}

static void get_target(void *instance, const GDExtensionConstTypePtr *, GDExtensionTypePtr result) {
  *static_cast<double *>(result) = effort(instance).target_mm;
}

/// The most shorter steps in place of one that would err by more than the target, 1 to 8; 0: what
/// the bundle recommends. `open` reads it.
static void set_substeps(void *instance, const GDExtensionConstTypePtr *arguments,
                         GDExtensionTypePtr) {
  effort(instance).substeps = *static_cast<const int64_t *>(arguments[0]);
}

static void get_substeps(void *instance, const GDExtensionConstTypePtr *,
                         GDExtensionTypePtr result) {
  *static_cast<int64_t *>(result) = effort(instance).substeps;
}

/// The length of a step, 0.01 to 0.05 s; 0: what the bundle recommends for frames. `open` reads it.
static void set_step(void *instance, const GDExtensionConstTypePtr *arguments, GDExtensionTypePtr) {
  effort(instance).step_s = real(arguments[0]);
}

static void get_step(void *instance, const GDExtensionConstTypePtr *, GDExtensionTypePtr result) {
  *static_cast<double *>(result) = effort(instance).step_s;
}

/// What the last call that failed says.
static void message(void *instance, const GDExtensionConstTypePtr *, GDExtensionTypePtr result) {
  godot.ptr_destructor(GDEXTENSION_VARIANT_TYPE_STRING)(result);
  godot.string_new(result, static_cast<SoftTissue *>(instance)->message.c_str());
}

/// A tissue whose surface follows tools: `open` a bundle, say where the tool is with `press_sphere`
/// or another shape, and call `frame` and `vertices` in each `_process`.
static GDExtensionObjectPtr create_instance(void *) {
  GodotStringName parent, name;
  GDExtensionObjectPtr object;
  godot_string_name(&parent, "MeshInstance3D");
  godot_string_name(&name, CLASS_NAME);
  object = godot.construct_object(&parent);
  godot.object_set_instance(object, &name, new SoftTissue);
  godot_string_name_free(&name);
  godot_string_name_free(&parent);
  return object;
}

static void free_instance(void *, GDExtensionClassInstancePtr instance) {
  delete static_cast<SoftTissue *>(instance);
}

#define T(name) GDEXTENSION_VARIANT_TYPE_##name
static const GodotMethod METHODS[] = {
    {"open", open_bundle, T(BOOL), 1, {{"bundle", T(STRING)}}},
    {"rest", rest, T(PACKED_VECTOR3_ARRAY), 0, {}},
    {"faces", faces, T(PACKED_INT32_ARRAY), 0, {}},
    {"press_sphere", press_sphere, T(BOOL), 2, {{"position", T(VECTOR3)}, {"radius", T(FLOAT)}}},
    {"press_capsule",
     press_capsule,
     T(BOOL),
     4,
     {{"position", T(VECTOR3)},
      {"rotation", T(QUATERNION)},
      {"half_length", T(FLOAT)},
      {"radius", T(FLOAT)}}},
    {"press_box",
     press_box,
     T(BOOL),
     3,
     {{"position", T(VECTOR3)}, {"rotation", T(QUATERNION)}, {"half_extents", T(VECTOR3)}}},
    {"press_spatula",
     press_spatula,
     T(BOOL),
     4,
     {{"position", T(VECTOR3)},
      {"rotation", T(QUATERNION)},
      {"half_extents", T(VECTOR3)},
      {"rounding", T(FLOAT)}}},
    {"hold",
     hold,
     T(BOOL),
     3,
     {{"friction", T(FLOAT)}, {"grasp", T(BOOL)}, {"tear_off_mn", T(FLOAT)}}},
    {"release", release, T(BOOL), 0, {}},
    {"breathe", breathe, T(BOOL), 2, {{"amplitude", T(FLOAT)}, {"period", T(FLOAT)}}},
    {"hang",
     hang,
     T(INT),
     4,
     {{"place", T(VECTOR3)},
      {"radius", T(FLOAT)},
      {"stiffness", T(FLOAT)},
      {"tears_at", T(FLOAT)}}},
    {"torn", torn, T(INT), 0, {}},
    {"lead",
     lead,
     T(BOOL),
     4,
     {{"group", T(INT)},
      {"position", T(VECTOR3)},
      {"rotation", T(QUATERNION)},
      {"let_go", T(BOOL)}}},
    {"work_as", work_as, T(BOOL), 1, {{"kind", T(INT)}}},
    {"tear_at", tear_at, T(BOOL), 1, {{"stretch", T(FLOAT)}}},
    {"undo", undo, T(BOOL), 0, {}},
    {"changes", changes, T(INT), 0, {}},
    {"outside", outside, T(INT), 0, {}},
    {"cut_area", cut_area, T(FLOAT), 0, {}},
    {"removed", removed, T(FLOAT), 0, {}},
    {"frame", frame, T(BOOL), 1, {{"now", T(FLOAT)}}},
    {"wait", wait, T(BOOL), 0, {}},
    {"vertices", vertices, T(PACKED_VECTOR3_ARRAY), 0, {}},
    {"step_ms", step_ms, T(FLOAT), 0, {}},
    {"contact_count", contact_count, T(INT), 0, {}},
    {"force", force, T(VECTOR3), 0, {}},
    {"penetration", penetration, T(FLOAT), 0, {}},
    {"flags", flags, T(INT), 0, {}},
    {"corrections_made", corrections_made, T(INT), 0, {}},
    {"error_mm", error_mm, T(FLOAT), 0, {}},
    {"message", message, T(STRING), 0, {}},
    {"set_corrections", set_corrections, T(NIL), 1, {{"most", T(INT)}}},
    {"get_corrections", get_corrections, T(INT), 0, {}},
    {"set_corrections_target_mm", set_target, T(NIL), 1, {{"target", T(FLOAT)}}},
    {"get_corrections_target_mm", get_target, T(FLOAT), 0, {}},
    {"set_substeps", set_substeps, T(NIL), 1, {{"most", T(INT)}}},
    {"get_substeps", get_substeps, T(INT), 0, {}},
    {"set_step_s", set_step, T(NIL), 1, {{"seconds", T(FLOAT)}}},
    {"get_step_s", get_step, T(FLOAT), 0, {}},
};
static const GodotProperty PROPERTIES[] = {
    {"corrections", T(INT), "-1,64,1", "set_corrections", "get_corrections"},
    {"corrections_target_mm", T(FLOAT), "0,1,0.001,or_greater", "set_corrections_target_mm",
     "get_corrections_target_mm"},
    {"substeps", T(INT), "0,8,1", "set_substeps", "get_substeps"},
    {"step_s", T(FLOAT), "0,0.05,0.001", "set_step_s", "get_step_s"},
};
#undef T

static void initialize(void *, GDExtensionInitializationLevel level) {
  GDExtensionClassCreationInfo3 info{};
  GodotStringName name, parent;
  if (level != GDEXTENSION_INITIALIZATION_SCENE) {
    return;
  }
  info.is_exposed = true;
  info.create_instance_func = create_instance;
  info.free_instance_func = free_instance;
  godot_string_name(&name, CLASS_NAME);
  godot_string_name(&parent, "MeshInstance3D");
  godot.register_class(godot.library, &name, &parent, &info);
  godot_string_name_free(&parent);
  godot_string_name_free(&name);
  for (const GodotMethod &method : METHODS) {
    godot_register_method(CLASS_NAME, &method);
  }
  for (const GodotProperty &property : PROPERTIES) {
    godot_register_property(CLASS_NAME, &property);
  }
}

static void deinitialize(void *, GDExtensionInitializationLevel level) {
  GodotStringName name;
  if (level != GDEXTENSION_INITIALIZATION_SCENE) {
    return;
  }
  godot_string_name(&name, CLASS_NAME);
  godot.unregister_class(godot.library, &name);
  godot_string_name_free(&name);
  upt_shutdown();
}

extern "C" __attribute__((visibility("default"))) GDExtensionBool
upt_godot_init(GDExtensionInterfaceGetProcAddress lookup, GDExtensionClassLibraryPtr library,
               GDExtensionInitialization *initialization) {
  if (!godot_api_load(lookup, library)) {
    return false;
  }
  if (!upt::abi_matches()) {
    godot_error(
        "libupt.so and the header that this extension was built with differ in ABI version");
    return false;
  }
  initialization->minimum_initialization_level = GDEXTENSION_INITIALIZATION_SCENE;
  initialization->initialize = initialize;
  initialization->deinitialize = deinitialize;
  return true;
}
