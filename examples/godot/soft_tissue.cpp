/* SoftTissue3D: a MeshInstance3D whose surface is stepped by libupt. Written against upt.h alone.
 *
 * Axes: a bundle is RAS in millimetres; Godot is right-handed with y up, in metres. The map
 * (x, y, z) -> (x, z, -y) / 1000 is a quarter turn about x, so windings stay outward (Godot draws
 * clockwise faces as front, which `faces` takes into account).
 *
 * Where the bundle has a linear response the instrument drives the step and its contact is solved;
 * else the step takes the nodes that it touches.
 *
 * Script side: open(bundle), rest(), faces(), hold(friction, grasp, tear_off_mn), press(shape,
 * position, rotation, half_extents, radius), release(), vertices(), step_ms(), contact_count(),
 * force(), penetration(), flags(), message(). */
#include "godot_api.h"
#include "upt.h"

#include <stdlib.h>
#include <string.h>

static const char CLASS_NAME[] = "SoftTissue3D";
static const float METRES = 0.001f;

typedef struct {
  upt_model *model;
  upt_scene *scene;
  uint32_t *surface;   /* node of each vertex */
  uint32_t *faces;     /* vertices, 3 a face */
  float *rest;         /* [vertex_count,3], mm, RAS */
  float *displacement; /* [vertex_count,3], mm, RAS */
  uint32_t *contacts;  /* nodes in contact */
  float *vectors;      /* [.,3], mm */
  uint64_t vertex_count;
  uint64_t index_count;
  uint64_t contact_count;
  bool solves_contact;
  float friction, tear_off_mn;
  uint8_t mode;
  upt_instrument_reading reading; /* of the last step; zero without an instrument */
  char message[512];
} SoftTissue;

static void close_tissue(SoftTissue *tissue) {
  if (tissue->scene)
    upt_scene_destroy(tissue->scene);
  if (tissue->model)
    upt_model_close(tissue->model);
  free(tissue->surface);
  free(tissue->faces);
  free(tissue->rest);
  free(tissue->displacement);
  free(tissue->contacts);
  free(tissue->vectors);
  memset(tissue, 0, sizeof *tissue);
}

/* Keeps the message of a failed call and prints it in the engine's console. */
static bool ok(SoftTissue *tissue, upt_status status) {
  if (status >= 0)
    return true;
  strncpy(tissue->message, upt_last_error(), sizeof tissue->message - 1);
  godot_error(tissue->message);
  return false;
}

static uint32_t *index_set(SoftTissue *tissue, int32_t set, uint64_t *count) {
  uint32_t *indices;
  if (!ok(tissue, upt_model_indices(tissue->model, set, NULL, 0, count)))
    return NULL;
  indices = malloc((*count + 1) * sizeof *indices);
  if (indices && !ok(tissue, upt_model_indices(tissue->model, set, indices, *count, count))) {
    free(indices);
    return NULL;
  }
  return indices;
}

static bool load(SoftTissue *tissue, const char *path) {
  upt_model_info info;
  float *positions = NULL;
  uint32_t *vertex_of = NULL;
  uint64_t i;
  bool loaded = false;
  memset(&info, 0, sizeof info);
  info.struct_size = sizeof info;
  if (!ok(tissue, upt_model_open(path, NULL, &tissue->model)) ||
      !ok(tissue, upt_model_get_info(tissue->model, &info)) ||
      !ok(tissue, upt_scene_create(tissue->model, NULL, &tissue->scene)))
    return false;
  switch (upt_scene_step_instruments(tissue->scene, NULL, 0, NULL, 0)) {
  case UPT_OK:
    tissue->solves_contact = true;
    if (!ok(tissue, upt_scene_reset(tissue->scene)))
      return false;
    break;
  case UPT_ERR_UNSUPPORTED: /* no linear response, or a library without feature "contact" */
    break;
  default:
    godot_error(upt_last_error());
    return false;
  }
  tissue->surface = index_set(tissue, UPT_SET_SURFACE_NODES, &tissue->vertex_count);
  tissue->faces = index_set(tissue, UPT_SET_SURFACE_FACES, &tissue->index_count);
  if (!tissue->surface || !tissue->faces)
    return false;
  positions = malloc(3 * info.node_count * sizeof *positions);
  vertex_of = calloc(info.node_count, sizeof *vertex_of);
  tissue->rest = malloc(3 * tissue->vertex_count * sizeof *tissue->rest);
  tissue->displacement = calloc(3 * tissue->vertex_count, sizeof *tissue->displacement);
  tissue->contacts = malloc(tissue->vertex_count * sizeof *tissue->contacts);
  tissue->vectors = malloc(3 * tissue->vertex_count * sizeof *tissue->vectors);
  if (positions && vertex_of && tissue->rest && tissue->displacement && tissue->contacts &&
      tissue->vectors &&
      ok(tissue, upt_model_positions(tissue->model, positions, 3 * info.node_count)) &&
      ok(tissue, upt_scene_set_region(tissue->scene, tissue->surface, tissue->vertex_count))) {
    for (i = 0; i < tissue->vertex_count; i++) {
      vertex_of[tissue->surface[i]] = (uint32_t)i;
      memcpy(tissue->rest + 3 * i, positions + 3 * (size_t)tissue->surface[i],
             3 * sizeof *positions);
    }
    for (i = 0; i < tissue->index_count; i++)
      tissue->faces[i] = vertex_of[tissue->faces[i]];
    loaded = true;
  }
  free(positions);
  free(vertex_of);
  return loaded;
}

static void open_bundle(void *instance, const GDExtensionConstTypePtr *arguments,
                        GDExtensionTypePtr result) {
  SoftTissue *tissue = instance;
  GDExtensionInt length = godot.string_to_utf8(arguments[0], NULL, 0);
  char *path = malloc((size_t)length + 1);
  char message[sizeof tissue->message];
  bool loaded = false;
  close_tissue(tissue);
  if (path) {
    godot.string_to_utf8(arguments[0], path, length);
    path[length] = 0;
    loaded = load(tissue, path);
  }
  free(path);
  if (!loaded) {
    memcpy(message, tissue->message, sizeof message);
    close_tissue(tissue);
    memcpy(tissue->message, message, sizeof message);
  }
  *(GDExtensionBool *)result = loaded;
}

/* Vertices in Godot's axes: rest + scale * displacement. */
static void put_vertices(SoftTissue *tissue, float scale, GDExtensionTypePtr array) {
  int64_t count = (int64_t)tissue->vertex_count, previous = 0, i;
  GDExtensionConstTypePtr arguments[1] = {&count};
  float *out;
  godot.resize_vector3(array, arguments, &previous, 1);
  if (count == 0)
    return;
  out = (float *)godot.vector3_at(array, 0);
  for (i = 0; i < count; i++) {
    const float *p = tissue->rest + 3 * i, *u = tissue->displacement + 3 * i;
    out[3 * i] = (p[0] + scale * u[0]) * METRES;
    out[3 * i + 1] = (p[2] + scale * u[2]) * METRES;
    out[3 * i + 2] = -(p[1] + scale * u[1]) * METRES;
  }
}

static void rest(void *instance, const GDExtensionConstTypePtr *arguments,
                 GDExtensionTypePtr result) {
  (void)arguments;
  put_vertices(instance, 0.0f, result);
}

static void vertices(void *instance, const GDExtensionConstTypePtr *arguments,
                     GDExtensionTypePtr result) {
  (void)arguments;
  put_vertices(instance, 1.0f, result);
}

static void faces(void *instance, const GDExtensionConstTypePtr *arguments,
                  GDExtensionTypePtr result) {
  SoftTissue *tissue = instance;
  int64_t count = (int64_t)tissue->index_count, previous = 0, i;
  GDExtensionConstTypePtr size[1] = {&count};
  int32_t *out;
  (void)arguments;
  godot.resize_int32(result, size, &previous, 1);
  if (count == 0)
    return;
  out = godot.int32_at(result, 0);
  for (i = 0; i < count; i += 3) {
    out[i] = (int32_t)tissue->faces[i];
    out[i + 1] = (int32_t)tissue->faces[i + 2];
    out[i + 2] = (int32_t)tissue->faces[i + 1];
  }
}

/* A step under instruments, at most one; their contact is solved. */
static bool drive(SoftTissue *tissue, const upt_instrument *instrument, uint64_t count) {
  if (!ok(tissue, upt_scene_step_instruments(tissue->scene, instrument, count, tissue->displacement,
                                             3 * tissue->vertex_count)))
    return false;
  memset(&tissue->reading, 0, sizeof tissue->reading);
  tissue->reading.struct_size = sizeof tissue->reading;
  if (!ok(tissue, upt_scene_instrument_readings(tissue->scene, &tissue->reading, count)))
    return false;
  tissue->contact_count = tissue->reading.contact_count;
  return true;
}

static bool step(SoftTissue *tissue) {
  return tissue->scene &&
         ok(tissue, upt_scene_step_contacts(tissue->scene, tissue->contacts, tissue->vectors,
                                            tissue->contact_count, tissue->displacement,
                                            3 * tissue->vertex_count));
}

/* press(shape, position [m], rotation, half_extents [mm], radius [mm]) -> bool: a step under the
 * instrument. */
static void press(void *instance, const GDExtensionConstTypePtr *arguments,
                  GDExtensionTypePtr result) {
  SoftTissue *tissue = instance;
  const float *position = arguments[1], *rotation = arguments[2], *extents = arguments[3];
  const float half = 0.70710678f;
  upt_instrument instrument;
  memset(&instrument, 0, sizeof instrument);
  instrument.struct_size = sizeof instrument;
  instrument.shape = (int32_t) * (const int64_t *)arguments[0];
  instrument.position[0] = position[0] / METRES;
  instrument.position[1] = -position[2] / METRES;
  instrument.position[2] = position[1] / METRES;
  /* Godot's axes are RAS turned by -90 degrees about x: q_ras = turn * q, turn = (sin 45, 0, 0, cos
   * 45). */
  instrument.rotation[0] = half * rotation[3] + half * rotation[0];
  instrument.rotation[1] = half * rotation[1] - half * rotation[2];
  instrument.rotation[2] = half * rotation[2] + half * rotation[1];
  instrument.rotation[3] = half * rotation[3] - half * rotation[0];
  memcpy(instrument.half_extents, extents, sizeof instrument.half_extents);
  instrument.radius = (float)*(const double *)arguments[4];
  instrument.friction = tissue->friction;
  instrument.tear_off_mn = tissue->tear_off_mn;
  instrument.mode = tissue->mode;
  if (!tissue->scene)
    *(GDExtensionBool *)result = false;
  else if (tissue->solves_contact)
    *(GDExtensionBool *)result = drive(tissue, &instrument, 1);
  else
    *(GDExtensionBool *)result =
        ok(tissue, upt_scene_contacts_from_instruments(
                       tissue->scene, &instrument, 1, tissue->contacts, tissue->vectors,
                       tissue->vertex_count, &tissue->contact_count)) &&
        step(tissue);
}

/* hold(friction, grasp, tear_off [mN]): how the instrument of the next presses holds the tissue.
 * tear_off 0: a grasp never lets go. */
static void hold(void *instance, const GDExtensionConstTypePtr *arguments,
                 GDExtensionTypePtr result) {
  SoftTissue *tissue = instance;
  tissue->friction = (float)*(const double *)arguments[0];
  tissue->mode = *(const GDExtensionBool *)arguments[1] ? UPT_MODE_GRASP : UPT_MODE_SLIDE;
  tissue->tear_off_mn = (float)*(const double *)arguments[2];
  *(GDExtensionBool *)result = true;
}

static void release(void *instance, const GDExtensionConstTypePtr *arguments,
                    GDExtensionTypePtr result) {
  SoftTissue *tissue = instance;
  (void)arguments;
  tissue->contact_count = 0;
  *(GDExtensionBool *)result =
      tissue->scene && (tissue->solves_contact ? drive(tissue, NULL, 0) : step(tissue));
}

static void step_ms(void *instance, const GDExtensionConstTypePtr *arguments,
                    GDExtensionTypePtr result) {
  SoftTissue *tissue = instance;
  upt_scene_stats stats;
  (void)arguments;
  memset(&stats, 0, sizeof stats);
  stats.struct_size = sizeof stats;
  if (tissue->scene)
    ok(tissue, upt_scene_get_stats(tissue->scene, &stats));
  *(double *)result = stats.step_ms;
}

static void contact_count(void *instance, const GDExtensionConstTypePtr *arguments,
                          GDExtensionTypePtr result) {
  (void)arguments;
  *(int64_t *)result = (int64_t)((SoftTissue *)instance)->contact_count;
}

/* force() -> Vector3: on the instrument in the last step, mN, Godot's axes. */
static void force(void *instance, const GDExtensionConstTypePtr *arguments,
                  GDExtensionTypePtr result) {
  const float *f = ((SoftTissue *)instance)->reading.force;
  float *out = result;
  (void)arguments;
  out[0] = f[0];
  out[1] = f[2];
  out[2] = -f[1];
}

/* penetration() -> float: how deep tissue lies inside of the instrument, mm. */
static void penetration(void *instance, const GDExtensionConstTypePtr *arguments,
                        GDExtensionTypePtr result) {
  (void)arguments;
  *(double *)result = (double)((SoftTissue *)instance)->reading.penetration_mm;
}

/* flags() -> int: UPT_FLAG_* of the last step. */
static void flags(void *instance, const GDExtensionConstTypePtr *arguments,
                  GDExtensionTypePtr result) {
  SoftTissue *tissue = instance;
  upt_scene_stats stats;
  (void)arguments;
  memset(&stats, 0, sizeof stats);
  stats.struct_size = sizeof stats;
  if (tissue->scene)
    ok(tissue, upt_scene_get_stats(tissue->scene, &stats));
  *(int64_t *)result = (int64_t)stats.flags;
}

static void message(void *instance, const GDExtensionConstTypePtr *arguments,
                    GDExtensionTypePtr result) {
  (void)arguments;
  godot.ptr_destructor(GDEXTENSION_VARIANT_TYPE_STRING)(result);
  godot.string_new(result, ((SoftTissue *)instance)->message);
}

static GDExtensionObjectPtr create_instance(void *userdata) {
  GodotStringName parent, name;
  GDExtensionObjectPtr object;
  SoftTissue *tissue = calloc(1, sizeof *tissue);
  (void)userdata;
  if (!tissue)
    return NULL;
  godot_string_name(&parent, "MeshInstance3D");
  godot_string_name(&name, CLASS_NAME);
  object = godot.construct_object(&parent);
  godot.object_set_instance(object, &name, tissue);
  godot_string_name_free(&name);
  godot_string_name_free(&parent);
  return object;
}

static void free_instance(void *userdata, GDExtensionClassInstancePtr instance) {
  (void)userdata;
  if (instance)
    close_tissue(instance);
  free(instance);
}

#define T(name) GDEXTENSION_VARIANT_TYPE_##name
static const GodotMethod METHODS[] = {
    {"open", open_bundle, T(BOOL), 1, {{"bundle", T(STRING)}}},
    {"rest", rest, T(PACKED_VECTOR3_ARRAY), 0, {{0}}},
    {"faces", faces, T(PACKED_INT32_ARRAY), 0, {{0}}},
    {"press",
     press,
     T(BOOL),
     5,
     {{"shape", T(INT)},
      {"position", T(VECTOR3)},
      {"rotation", T(QUATERNION)},
      {"half_extents", T(VECTOR3)},
      {"radius", T(FLOAT)}}},
    {"hold",
     hold,
     T(BOOL),
     3,
     {{"friction", T(FLOAT)}, {"grasp", T(BOOL)}, {"tear_off_mn", T(FLOAT)}}},
    {"release", release, T(BOOL), 0, {{0}}},
    {"vertices", vertices, T(PACKED_VECTOR3_ARRAY), 0, {{0}}},
    {"step_ms", step_ms, T(FLOAT), 0, {{0}}},
    {"contact_count", contact_count, T(INT), 0, {{0}}},
    {"force", force, T(VECTOR3), 0, {{0}}},
    {"penetration", penetration, T(FLOAT), 0, {{0}}},
    {"flags", flags, T(INT), 0, {{0}}},
    {"message", message, T(STRING), 0, {{0}}},
};
#undef T

static void initialize(void *userdata, GDExtensionInitializationLevel level) {
  GDExtensionClassCreationInfo3 info;
  GodotStringName name, parent;
  size_t i;
  (void)userdata;
  if (level != GDEXTENSION_INITIALIZATION_SCENE)
    return;
  memset(&info, 0, sizeof info);
  info.is_exposed = true;
  info.create_instance_func = create_instance;
  info.free_instance_func = free_instance;
  godot_string_name(&name, CLASS_NAME);
  godot_string_name(&parent, "MeshInstance3D");
  godot.register_class(godot.library, &name, &parent, &info);
  godot_string_name_free(&parent);
  godot_string_name_free(&name);
  for (i = 0; i < sizeof METHODS / sizeof *METHODS; i++)
    godot_register_method(CLASS_NAME, &METHODS[i]);
}

static void deinitialize(void *userdata, GDExtensionInitializationLevel level) {
  GodotStringName name;
  (void)userdata;
  if (level != GDEXTENSION_INITIALIZATION_SCENE)
    return;
  godot_string_name(&name, CLASS_NAME);
  godot.unregister_class(godot.library, &name);
  godot_string_name_free(&name);
  upt_shutdown();
}

__attribute__((visibility("default"))) GDExtensionBool
upt_godot_init(GDExtensionInterfaceGetProcAddress lookup, GDExtensionClassLibraryPtr library,
               GDExtensionInitialization *initialization) {
  if (!godot_api_load(lookup, library))
    return false;
  if (upt_abi_version() != UPT_ABI_VERSION) {
    godot_error(
        "libupt.so and the header that this extension was built with differ in ABI version");
    return false;
  }
  initialization->minimum_initialization_level = GDEXTENSION_INITIALIZATION_SCENE;
  initialization->initialize = initialize;
  initialization->deinitialize = deinitialize;
  return true;
}
