// libupt for C++17: move-only handles over upt.h, header only.
//
// Errors: every call returns a `upt_status`. By default a negative status is thrown as
// `upt::error`, so a call returns only UPT_OK or UPT_PENDING. With UPT_NO_EXCEPTIONS defined
// nothing is thrown: check the status, and read the message from `upt::last_error()`. The forms
// that return a value (`Model::open(path)`, `model.info()`, ...) exist only with exceptions.
//
// Shapes, units and thread rules: upt.h. SPDX-License-Identifier: Apache-2.0 OR MIT
#ifndef UPT_HPP
#define UPT_HPP

#include "upt.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#ifndef UPT_NO_EXCEPTIONS
#include <stdexcept>
#endif

namespace upt {

/// Pointer and count. Made from a pointer and a count, an array, or anything with data() and
/// size().
template <typename T> class span {
public:
  constexpr span() noexcept = default;
  /// Of nothing; of a pointer and a count; of an array; of a container.
  constexpr span(std::nullptr_t) noexcept {}
  constexpr span(T *data, std::size_t size) noexcept : data_(data), size_(size) {}
  template <std::size_t N> constexpr span(T (&array)[N]) noexcept : data_(array), size_(N) {}
  template <typename Container, typename = std::enable_if_t<std::is_convertible_v<
                                    decltype(std::declval<Container &>().data()), T *>>>
  constexpr span(Container &&container) noexcept
      : data_(container.data()), size_(container.size()) {}

  /// Of the first element.
  constexpr T *data() const noexcept { return data_; }
  /// Number of elements.
  constexpr std::size_t size() const noexcept { return size_; }
  /// Whether there are none.
  constexpr bool empty() const noexcept { return size_ == 0; }
  /// Of the first element, as a range has it.
  constexpr T *begin() const noexcept { return data_; }
  /// Behind the last element.
  constexpr T *end() const noexcept { return data_ + size_; }
  /// An element; the index is not checked.
  constexpr T &operator[](std::size_t index) const noexcept { return data_[index]; }

private:
  T *data_ = nullptr;
  std::size_t size_ = 0;
};

/// Message of the last failed call of this thread.
inline const char *last_error() noexcept { return upt_last_error(); }

/// Whether the loaded library has the ABI of this header.
inline bool abi_matches() noexcept { return upt_abi_version() == UPT_ABI_VERSION; }

#ifndef UPT_NO_EXCEPTIONS
/// A failed call; the library's state is what it was before.
class error : public std::runtime_error {
public:
  /// What `check` throws.
  error(upt_status status, const char *message) : std::runtime_error(message), status_(status) {}
  /// The status that the call returned; `what()` is the library's message.
  upt_status status() const noexcept { return status_; }

private:
  upt_status status_;
};
#endif

/// Throws on an error, or returns the status when UPT_NO_EXCEPTIONS is defined.
inline upt_status check(upt_status status) {
#ifndef UPT_NO_EXCEPTIONS
  if (status < 0) {
    throw error(status, upt_last_error());
  }
#endif
  return status;
}

namespace detail {
/// Refuses spans whose sizes do not match; the C call could not see it.
inline upt_status mismatch() {
#ifndef UPT_NO_EXCEPTIONS
  throw error(UPT_ERR_ARGUMENT, "a [n,3] span's size is not three times its count");
#else
  return UPT_ERR_ARGUMENT;
#endif
}
} // namespace detail

/// A zeroed struct with its struct_size set: the defaults.
template <typename T> T make() noexcept {
  T value{};
  value.struct_size = sizeof(T);
  return value;
}

using init_options = upt_init_options;
using model_options = upt_model_options;
using model_info = upt_model_info;
using scene_options = upt_scene_options;
using scene_stats = upt_scene_stats;
using scene_timing = upt_scene_timing;
using instrument = upt_instrument;
using instrument_reading = upt_instrument_reading;
using instrument_contact = upt_instrument_contact;

/// A ball, at the origin of the mesh's frame until you set `position`. radius: mm.
inline upt_instrument sphere(float radius) noexcept {
  upt_instrument made = make<upt_instrument>();
  made.shape = UPT_SHAPE_SPHERE;
  made.rotation[3] = 1.0F;
  made.radius = radius;
  return made;
}
/// A capsule along its local y; half_length without the caps, mm.
inline upt_instrument capsule(float radius, float half_length) noexcept {
  upt_instrument made = sphere(radius);
  made.shape = UPT_SHAPE_CAPSULE;
  made.half_extents[1] = half_length;
  return made;
}
/// A box of these half sizes, rounded by `radius`; mm.
inline upt_instrument spatula(float x, float y, float z, float radius) noexcept {
  upt_instrument made = sphere(radius);
  made.shape = UPT_SHAPE_SPATULA;
  made.half_extents[0] = x;
  made.half_extents[1] = y;
  made.half_extents[2] = z;
  return made;
}
/// A box of these half sizes, mm.
inline upt_instrument box(float x, float y, float z) noexcept {
  upt_instrument made = spatula(x, y, z, 0);
  made.shape = UPT_SHAPE_BOX;
  return made;
}

/// Corrections of a step: `count` of them; with a target (mm) or a budget (µs) at most so many.
inline upt_corrections corrections(std::uint32_t count, float target_mm = 0.0F,
                                   std::uint32_t budget_us = 0) noexcept {
  return {UPT_CORRECTIONS_COUNT, count, budget_us, target_mm};
}
/// The same by a mode that needs no count: UPT_CORRECTIONS_NONE, _RECOMMENDED, _AUTO.
inline upt_corrections corrections(upt_corrections_mode mode, float target_mm = 0.0F,
                                   std::uint32_t budget_us = 0) noexcept {
  return {mode, 0, budget_us, target_mm};
}

/// What is shown: UPT_VIEW_*.
inline upt_view view(upt_view_kind kind) noexcept {
  upt_view made = make<upt_view>();
  made.kind = kind;
  return made;
}
/// These nodes, for `Scene::decode`; they must live until the call returns. Without any: all nodes.
inline upt_view view(span<const std::uint32_t> nodes) noexcept {
  upt_view made = view(UPT_VIEW_NODES);
  made.nodes = nodes.empty() ? nullptr : nodes.data();
  made.node_count = nodes.size();
  return made;
}

/// The input of a step or a frame: what drives it; nothing, where it is made without arguments.
/// What it is made of is not copied: it must live until the call that takes the input returns.
class Input {
public:
  Input() noexcept : raw_(make<upt_input>()) {}
  /// Rigid instruments where they are at the end of the step, or at the moment of a frame.
  Input(const upt_instrument *instruments, std::size_t count) noexcept : Input() {
    raw_.instruments = instruments;
    raw_.instrument_count = count;
  }
  /// The same; instruments: an array, or anything with data() and size().
  template <typename Instruments,
            typename = std::enable_if_t<
                !std::is_same_v<std::decay_t<Instruments>, Input> &&
                std::is_constructible_v<span<const upt_instrument>, const Instruments &>>>
  Input(const Instruments &instruments) noexcept
      : Input(span<const upt_instrument>(instruments).data(),
              span<const upt_instrument>(instruments).size()) {}
  /// nodes: [m]; vectors: [m,3], mm.
  static Input contacts(span<const std::uint32_t> nodes, span<const float> vectors) noexcept {
    Input made;
    made.raw_.contact_nodes = nodes.data();
    made.raw_.contact_vectors = vectors.data();
    made.raw_.contact_count = nodes.size();
    made.fits_ = vectors.size() == 3 * nodes.size();
    return made;
  }
  /// field: [K,3], mm, zero but at nodes in contact.
  static Input collision(span<const float> field) noexcept {
    Input made;
    made.raw_.collision = field.data();
    return made;
  }
  /// The step starts from this displacement, [K,3], mm.
  Input &from(span<const float> displacement) noexcept {
    return raw_.displacement = displacement.data(), *this;
  }
  /// The moment of the end of the step on a clock of your own, s.
  Input &at(double time_s) noexcept { return raw_.time_s = time_s, *this; }
  /// Gravity and that of the scan, m/s², in the mesh's frame: the difference acts on the body.
  /// Zeros for the scan: the bundle's.
  Input &gravity(const std::array<float, 3> &now,
                 const std::array<float, 3> &at_rest = {}) noexcept {
    std::copy(now.begin(), now.end(), raw_.gravity);
    std::copy(at_rest.begin(), at_rest.end(), raw_.gravity_at_rest);
    return *this;
  }
  /// Forces on the nodes, [K,3], mN.
  Input &forces(span<const float> forces) noexcept {
    raw_.forces = forces.data();
    return *this;
  }
  /// Forces at points of the tissue (`model.locate`), at most 256; struct_size is set in each.
  Input &point_forces(span<const upt_point_force> forces) noexcept {
    raw_.point_forces = forces.data();
    raw_.point_force_count = forces.size();
    return *this;
  }
  /// Pressures on parts of the surface; struct_size is set in each.
  Input &pressures(span<const upt_pressure> pressures) noexcept {
    raw_.pressures = pressures.data();
    raw_.pressure_count = pressures.size();
    return *this;
  }
  /// Where what holds the body is: position (mm), unit quaternion x, y, z, w.
  Input &support(const float *position, const float *rotation) noexcept {
    std::copy_n(position, 3, raw_.support_position);
    std::copy_n(rotation, 4, raw_.support_rotation);
    return *this;
  }
  /// Ties, every time and in the same order; struct_size is set in each.
  Input &ties(span<const upt_tie> ties) noexcept {
    raw_.ties = ties.data();
    raw_.tie_count = ties.size();
    return *this;
  }
  /// What support groups of the bundle do, in every step; struct_size is set in each.
  Input &supports(span<const upt_support> supports) noexcept {
    raw_.supports = supports.data();
    raw_.support_count = supports.size();
    return *this;
  }
  /// For calls of the C ABI.
  const upt_input *get() const noexcept { return &raw_; }
  /// Whether the spans' sizes agree; a call that takes an input that does not fit refuses it.
  bool fits() const noexcept { return fits_; }

private:
  upt_input raw_;
  bool fits_ = true;
};

/// Starts the library with options of your own; the first model starts it with the defaults.
inline upt_status init(const upt_init_options &options) { return check(upt_init(&options)); }
/// Ends the library. Destroy scenes and models before.
inline upt_status shutdown() { return check(upt_shutdown()); }
/// The library's messages up to a level, on the host's threads, during its calls; NULL: none.
inline upt_status set_log(upt_log_fn callback, void *user, upt_log_level level) {
  return check(upt_set_log(callback, user, level));
}

/// A bundle made ready to step. Immutable: const calls may come from any thread.
class Model {
public:
  Model() noexcept = default;
  Model(Model &&other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}
  Model &operator=(Model &&other) noexcept {
    if (this != &other) {
      close();
      handle_ = std::exchange(other.handle_, nullptr);
    }
    return *this;
  }
  Model(const Model &) = delete;
  Model &operator=(const Model &) = delete;
  ~Model() { close(); }

  /// Opens the bundle in the folder `path` (UTF-8). Closes a model that this object already held.
  upt_status reopen(const char *path, const upt_model_options *options = nullptr) {
    upt_model *handle = nullptr;
    const upt_status status = check(upt_model_create(path, options, &handle));
    if (status == UPT_OK) {
      close();
      handle_ = handle;
    }
    return status;
  }

  /// Scenes made from the model stay usable.
  void close() noexcept {
    if (handle_ != nullptr) {
      upt_model_destroy(std::exchange(handle_, nullptr));
    }
  }

  /// Whether it holds one.
  explicit operator bool() const noexcept { return handle_ != nullptr; }
  /// For calls of the C ABI; stays this object's.
  upt_model *get() const noexcept { return handle_; }

  /// What the model is: counts of nodes and triangles, the length of a step, memory.
  upt_status info(upt_model_info &out) const {
    out = make<upt_model_info>();
    return check(upt_model_read_info(handle_, &out));
  }
  /// Where the nodes are at rest; out: [K,3], mm.
  upt_status positions(span<float> out) const {
    return check(upt_model_read_positions(handle_, out.data(), out.size()));
  }
  /// Forces of zero at places of the mesh at rest, [n,3], mm: find them once, set them in each
  /// step.
  upt_status locate(span<const float> places, std::vector<upt_point_force> &out) const {
    const std::size_t count = places.size() / 3;
    if (places.size() % 3 != 0) {
      return detail::mismatch();
    }
    std::vector<std::uint32_t> nodes(4 * count);
    std::vector<float> weights(4 * count);
    const upt_status status =
        check(upt_model_locate_points(handle_, places.data(), count, nodes.data(), weights.data()));
    out.assign(status == UPT_OK ? count : 0, make<upt_point_force>());
    for (std::size_t point = 0; point < out.size(); point++) {
      std::copy_n(&nodes[4 * point], 4, out[point].nodes);
      std::copy_n(&weights[4 * point], 4, out[point].weights);
    }
    return status;
  }
  /// A set of nodes or triangles: UPT_SET_*.
  upt_status indices(upt_index_set set, std::vector<std::uint32_t> &out) const {
    std::uint64_t needed = 0;
    const upt_status status = check(upt_model_read_indices(handle_, set, nullptr, 0, &needed));
    if (status != UPT_OK) {
      return status;
    }
    out.resize(static_cast<std::size_t>(needed));
    return check(upt_model_read_indices(handle_, set, out.data(), out.size(), &needed));
  }
  /// What the bundle and this machine make of the model, as JSON: names, hashes, instruction set.
  upt_status describe(std::string &out) const {
    std::uint64_t needed = 0;
    upt_status status = check(upt_model_describe(handle_, nullptr, 0, &needed));
    if (status == UPT_OK) {
      out.resize(static_cast<std::size_t>(needed));
      status = check(upt_model_describe(handle_, &out[0], out.size(), &needed));
      out.resize(out.empty() ? 0 : out.size() - 1);
    }
    return status;
  }

#ifndef UPT_NO_EXCEPTIONS
  /// The bundle in the folder `path` (UTF-8).
  static Model open(const char *path, const upt_model_options *options = nullptr) {
    Model model;
    model.reopen(path, options);
    return model;
  }
  static Model open(const std::string &path, const upt_model_options *options = nullptr) {
    return open(path.c_str(), options);
  }
  upt_model_info info() const {
    upt_model_info out;
    info(out);
    return out;
  }
  std::vector<float> positions() const {
    std::vector<float> out(static_cast<std::size_t>(3 * info().node_count));
    positions(out);
    return out;
  }
  std::vector<upt_point_force> locate(span<const float> places) const {
    std::vector<upt_point_force> out;
    locate(places, out);
    return out;
  }
  std::vector<std::uint32_t> indices(upt_index_set set) const {
    std::vector<std::uint32_t> out;
    indices(set, out);
    return out;
  }
  std::string describe() const {
    std::string out;
    describe(out);
    return out;
  }
#endif

private:
  upt_model *handle_ = nullptr;
};

/// A tool of its own shape, for instruments of shape UPT_SHAPE_HULL. Immutable: any
/// thread may use it. It must live while you pass instruments that name it to a scene.
class Hull {
public:
  Hull() noexcept = default;
  Hull(Hull &&other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}
  Hull &operator=(Hull &&other) noexcept {
    if (this != &other) {
      destroy();
      handle_ = std::exchange(other.handle_, nullptr);
    }
    return *this;
  }
  Hull(const Hull &) = delete;
  Hull &operator=(const Hull &) = delete;
  ~Hull() { destroy(); }

  /// points: [n,3], mm, in the tool's own frame; faces: [m,3] of a closed surface, whose hollows
  /// stay, or none for the convex hull. Destroys a hull that this object already held.
  upt_status create(span<const float> points, span<const std::uint32_t> faces = {}) {
    if (points.size() % 3 != 0 || faces.size() % 3 != 0) {
      return detail::mismatch();
    }
    upt_hull *handle = nullptr;
    const upt_status status = check(
        upt_hull_create(points.data(), points.size() / 3, faces.data(), faces.size() / 3, &handle));
    if (status == UPT_OK) {
      destroy();
      handle_ = handle;
    }
    return status;
  }

#ifndef UPT_NO_EXCEPTIONS
  /// As `create`.
  explicit Hull(span<const float> points, span<const std::uint32_t> faces = {}) {
    create(points, faces);
  }
#endif

  /// Steps that were submitted with it still finish.
  void destroy() noexcept {
    if (handle_ != nullptr) {
      upt_hull_destroy(std::exchange(handle_, nullptr));
    }
  }

  /// Whether it holds one.
  explicit operator bool() const noexcept { return handle_ != nullptr; }
  /// For calls of the C ABI; stays this object's.
  upt_hull *get() const noexcept { return handle_; }

  /// A sliding instrument of this shape, without friction, at the origin of the mesh's frame.
  upt_instrument instrument() const noexcept {
    upt_instrument made = sphere(0);
    made.shape = UPT_SHAPE_HULL;
    made.hull = handle_;
    return made;
  }

private:
  upt_hull *handle_ = nullptr;
};

/// The closed surface of a scene's body, and what of it is new since it was asked for before.
struct Surface {
  /// [v,3], mm: where each vertex lies in the tissue at rest. The first are the mesh's nodes.
  std::vector<float> rest;
  /// [t,3], outward; 0, 0, 0 in slots that are empty.
  std::vector<std::uint32_t> triangles;
  /// [t]: 1 where the triangle was inside of the intact body.
  std::vector<std::uint8_t> inside;
  /// Slots of triangles whose corners have changed, ascending.
  std::vector<std::uint32_t> changed;
  /// Vertices from this one on are new; the others keep their numbers and places.
  std::size_t first_vertex = 0;
  /// Every vertex and triangle is new: the first surface, and after another body was put back.
  bool is_new = false;
};

/// One deforming body. Used by one thread at a time.
class Scene {
public:
  Scene() noexcept = default;
  Scene(Scene &&other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}
  Scene &operator=(Scene &&other) noexcept {
    if (this != &other) {
      destroy();
      handle_ = std::exchange(other.handle_, nullptr);
    }
    return *this;
  }
  Scene(const Scene &) = delete;
  Scene &operator=(const Scene &) = delete;
  ~Scene() { destroy(); }

  /// Creates a scene at rest. Destroys a scene that this object already held.
  upt_status create(const Model &model, const upt_scene_options *options = nullptr) {
    upt_scene *handle = nullptr;
    const upt_status status = check(upt_scene_create(model.get(), options, &handle));
    if (status == UPT_OK) {
      destroy();
      handle_ = handle;
    }
    return status;
  }

#ifndef UPT_NO_EXCEPTIONS
  /// As `create`.
  explicit Scene(const Model &model, const upt_scene_options *options = nullptr) {
    create(model, options);
  }
#endif

  /// Waits for a step in flight. No other thread may be in a call on the scene.
  void destroy() noexcept {
    if (handle_ != nullptr) {
      upt_scene_destroy(std::exchange(handle_, nullptr));
    }
  }

  /// Whether it holds one.
  explicit operator bool() const noexcept { return handle_ != nullptr; }
  /// For calls of the C ABI; stays this object's.
  upt_scene *get() const noexcept { return handle_; }

  /// Back to rest, with the intact body.
  upt_status reset() { return check(upt_scene_reset(handle_)); }

  /// One step, with contact of instruments solved; out: [n,3] or empty.
  upt_status step(const Input &input = {}, span<float> out = {}) {
    if (!input.fits()) {
      return detail::mismatch();
    }
    return check(upt_scene_step(handle_, input.get(), out.data(), out.size()));
  }
  /// The paper's step. displacement: [K,3] or empty (own state); collision: [K,3] or empty (no
  /// contact). K is the size of the scene's mesh; the spans must have these sizes.
  upt_status step_field(span<const float> displacement, span<const float> collision,
                        span<float> out) {
    return check(upt_scene_step_field(handle_, displacement.data(), collision.data(), out.data(),
                                      out.size()));
  }
  /// The last published state; out: [n,3], mm, in the view's order. Any thread may call it.
  upt_status read(span<float> out, const upt_view &shown = view(UPT_VIEW_REGION)) {
    return check(upt_scene_read(handle_, &shown, out.data(), out.size()));
  }

  /// As `step`, on the scene's worker; the input is copied.
  upt_status submit(const Input &input = {}) {
    if (!input.fits()) {
      return detail::mismatch();
    }
    return check(upt_scene_submit(handle_, input.get()));
  }
  /// UPT_OK when the submitted step has finished, UPT_PENDING while it runs; its error, once.
  upt_status poll() { return check(upt_scene_poll(handle_)); }
  /// As `poll`, but waits for the step; UPT_PENDING when the time is up.
  upt_status wait(std::uint32_t timeout_ms) { return check(upt_scene_wait(handle_, timeout_ms)); }
  /// Between the last two states, alpha from 0 to 1; otherwise as `read`.
  upt_status sample(double alpha, span<float> out, const upt_view &shown = view(UPT_VIEW_REGION)) {
    return check(upt_scene_sample(handle_, alpha, &shown, out.data(), out.size()));
  }

  /// A step computes these nodes alone, in this order, which makes it cheaper; empty: all nodes.
  upt_status set_region(span<const std::uint32_t> nodes) {
    return check(
        upt_scene_set_region(handle_, nodes.empty() ? nullptr : nodes.data(), nodes.size()));
  }
  /// Any nodes in the last state, computed now: `decode(upt::view(nodes), out)`; out: [n,3], mm.
  upt_status decode(const upt_view &shown, span<float> out) {
    return check(upt_scene_decode(handle_, &shown, out.data(), out.size()));
  }
  /// Points in the tissue at rest that steps carry along, for views of kind UPT_VIEW_POINTS: [n,3],
  /// mm; empty detaches.
  upt_status attach_points(span<const float> points) {
    if (points.size() % 3 != 0) {
      return detail::mismatch();
    }
    return check(upt_scene_attach_points(handle_, points.empty() ? nullptr : points.data(),
                                         points.size() / 3));
  }

  /// The tissue at a moment between steps, with what drives it where it is then; `when` is on the
  /// clock of the steps' times, or without one the time since the last published step, s.
  /// out: [n,3], in the view's order.
  upt_status present(const Input &input, double when, span<float> out,
                     const upt_view &shown = view(UPT_VIEW_REGION)) {
    if (!input.fits()) {
      return detail::mismatch();
    }
    return check(upt_scene_present(handle_, input.get(), when, &shown, out.data(), out.size()));
  }
  /// What the tissue did to each instrument of the last step; out has one element for each.
  upt_status readings(span<upt_instrument_reading> out) {
    for (upt_instrument_reading &reading : out) {
      reading = make<upt_instrument_reading>();
    }
    return check(upt_scene_read_instruments(handle_, out.data(), out.size()));
  }
  /// What each tie of the last step does; out has one element for each.
  upt_status tie_readings(span<upt_tie_reading> out) {
    for (upt_tie_reading &reading : out) {
      reading = make<upt_tie_reading>();
    }
    return check(upt_scene_read_ties(handle_, out.data(), out.size()));
  }
  /// The point of the tissue nearest to a place (mm) becomes that of a tie.
  upt_status tie_point(const float *place, upt_tie &tie) {
    return check(upt_scene_tie_points(handle_, place, 1, tie.nodes, tie.weights));
  }
  /// The ties of a bed: pass them in every step.
  upt_status bed(const upt_bed &bed, std::vector<upt_tie> &out) {
    std::uint64_t needed = 0;
    upt_status status = check(upt_scene_bed(handle_, &bed, nullptr, 0, &needed));
    if (status == UPT_OK) {
      out.assign(static_cast<std::size_t>(needed), make<upt_tie>());
      status = check(upt_scene_bed(handle_, &bed, out.data(), out.size(), &needed));
    }
    return status;
  }
  /// The points of the surface that push or hold instruments at the end of the last step.
  upt_status instrument_contacts(std::vector<upt_instrument_contact> &out) {
    std::uint64_t needed = 0;
    upt_status status = check(upt_scene_read_instrument_contacts(handle_, nullptr, 0, &needed));
    if (status == UPT_OK) {
      out.resize(static_cast<std::size_t>(needed));
      status = check(upt_scene_read_instrument_contacts(handle_, out.data(), out.size(), &needed));
      out.resize(static_cast<std::size_t>(needed));
    }
    return status;
  }

  /// The nodes that instruments touch and where they push them, for bundles without a linear
  /// response. nodes: [capacity]; vectors: [capacity,3], mm; count: contacts found.
  upt_status contacts_from_instruments(span<const upt_instrument> instruments,
                                       span<std::uint32_t> nodes, span<float> vectors,
                                       std::uint64_t &count) {
    if (vectors.size() != 3 * nodes.size()) {
      return detail::mismatch();
    }
    return check(upt_scene_contacts_from_instruments(handle_, instruments.data(),
                                                     instruments.size(), nodes.data(),
                                                     vectors.data(), nodes.size(), &count));
  }
  /// Forces on the instrument at the last step's contact nodes, in their order; out: [m,3], mN.
  upt_status contact_force(span<float> out) {
    return check(upt_scene_read_contact_force(handle_, out.data(), out.size()));
  }

  /// K, and the copies of nodes that cuts have made: outputs have three floats for each.
  upt_status node_count(std::uint64_t &out) const {
    return check(upt_scene_read_node_count(handle_, &out));
  }
  /// Cuts along a blade edge's way; poses: [poses,edge_points,3], mm. One stroke is one blade; one
  /// with a fracture energy feels the tissue: out.force.
  upt_status cut(std::uint32_t stroke, span<const float> poses, std::size_t edge_points,
                 upt_cut &out, const upt_blade &blade = make<upt_blade>()) {
    if (edge_points == 0 || poses.size() % (3 * edge_points) != 0) {
      return detail::mismatch();
    }
    out = make<upt_cut>();
    return check(upt_scene_cut_with(handle_, &blade, stroke, poses.data(),
                                    poses.size() / (3 * edge_points), edge_points, &out));
  }
  /// Removes what lies inside of an instrument, the deepest first, up to most_mm3.
  upt_status remove(const upt_instrument &instrument, float most_mm3, upt_cut &out) {
    out = make<upt_cut>();
    return check(upt_scene_remove(handle_, &instrument, most_mm3, &out));
  }
  /// Parts tissue that is longer than stretch times its length at rest, across that direction.
  upt_status tear(std::uint32_t stroke, float stretch, std::uint32_t most, upt_cut &out) {
    out = make<upt_cut>();
    return check(upt_scene_tear(handle_, stroke, stretch, most, &out));
  }
  /// Multiplies the stiffness of elements of the model's mesh.
  upt_status scale_stiffness(span<const std::uint32_t> elements, float factor, upt_cut &out) {
    out = make<upt_cut>();
    return check(
        upt_scene_scale_stiffness(handle_, elements.data(), elements.size(), factor, &out));
  }
  /// Takes the pieces that nothing holds out of the body.
  upt_status drop_fragments(upt_cut &out) {
    out = make<upt_cut>();
    return check(upt_scene_drop_fragments(handle_, &out));
  }
  /// The closed surface of the body as it is now, and what has changed since the last call.
  upt_status surface(Surface &out) {
    upt_surface now = make<upt_surface>();
    const upt_status status = check(upt_scene_update_surface(handle_, &now));
    if (status != UPT_OK) {
      return status;
    }
    out.rest.resize(static_cast<std::size_t>(3 * now.vertex_count));
    out.triangles.resize(static_cast<std::size_t>(3 * now.triangle_count));
    out.inside.resize(static_cast<std::size_t>(now.triangle_count));
    out.changed.resize(static_cast<std::size_t>(now.changed_count));
    out.first_vertex = static_cast<std::size_t>(now.first_vertex);
    out.is_new = now.is_new != 0;
    return check(upt_scene_read_surface(handle_, out.rest.data(), now.vertex_count,
                                        out.triangles.data(), out.inside.data(), now.triangle_count,
                                        out.changed.data(), now.changed_count));
  }
  /// Where the vertices of the last surface are in the last state; out: [v,3], mm.
  upt_status surface_positions(span<float> out) {
    return check(upt_scene_read_surface_positions(handle_, out.data(), out.size()));
  }

  /// What the last step was: flags, corrections, the estimated error.
  upt_status stats(upt_scene_stats &out) const {
    out = make<upt_scene_stats>();
    return check(upt_scene_read_stats(handle_, &out));
  }
  /// What the last step and its stages took, ms.
  upt_status timing(upt_scene_timing &out) const {
    out = make<upt_scene_timing>();
    return check(upt_scene_read_timing(handle_, &out));
  }
  /// A snapshot of state and body, from which `restore` goes on to the bit.
  upt_status save(std::vector<std::uint8_t> &out) {
    std::uint64_t needed = 0;
    const upt_status status = check(upt_scene_save(handle_, nullptr, 0, &needed));
    if (status != UPT_OK) {
      return status;
    }
    out.resize(static_cast<std::size_t>(needed));
    return check(upt_scene_save(handle_, out.data(), out.size(), &needed));
  }
  /// Goes on from a snapshot of the same model.
  upt_status restore(span<const std::uint8_t> bytes) {
    return check(upt_scene_restore(handle_, bytes.data(), bytes.size()));
  }
  /// Begins to record what the scene is given, for `upt replay --verify`, with a hash after every
  /// so many steps; 0 ends the recording.
  upt_status record(std::uint32_t every = 1) { return check(upt_scene_record(handle_, every)); }
  /// Adds to out the lines of the recording that were not taken before; together they make the
  /// file.
  upt_status take_record(std::string &out) {
    const std::size_t before = out.size();
    std::uint64_t needed = 0;
    upt_status status = upt_scene_take_record(handle_, nullptr, 0, &needed);
    // A step in flight may add a line in between.
    while (status == UPT_OK && needed > 0) {
      const std::uint64_t room = needed;
      out.resize(before + static_cast<std::size_t>(room));
      status = upt_scene_take_record(handle_, reinterpret_cast<std::uint8_t *>(&out[before]), room,
                                     &needed);
      if (status == UPT_OK || needed <= room) {
        break;
      }
      status = UPT_OK;
    }
    out.resize(before + (status == UPT_OK ? static_cast<std::size_t>(needed) : 0));
    return check(status);
  }

#ifndef UPT_NO_EXCEPTIONS
  upt_scene_stats stats() const {
    upt_scene_stats out;
    stats(out);
    return out;
  }
  upt_scene_timing timing() const {
    upt_scene_timing out;
    timing(out);
    return out;
  }
  /// count: instruments of the last step.
  std::vector<upt_instrument_reading> readings(std::size_t count) {
    std::vector<upt_instrument_reading> out(count);
    readings(out);
    return out;
  }
  std::vector<upt_tie_reading> tie_readings(std::size_t count) {
    std::vector<upt_tie_reading> out(count);
    tie_readings(out);
    return out;
  }
  std::vector<upt_tie> bed(const upt_bed &bed) {
    std::vector<upt_tie> out;
    this->bed(bed, out);
    return out;
  }
  std::vector<upt_instrument_contact> instrument_contacts() {
    std::vector<upt_instrument_contact> out;
    instrument_contacts(out);
    return out;
  }
  std::size_t node_count() const {
    std::uint64_t out = 0;
    node_count(out);
    return static_cast<std::size_t>(out);
  }
  upt_cut cut(std::uint32_t stroke, span<const float> poses, std::size_t edge_points) {
    upt_cut out;
    cut(stroke, poses, edge_points, out);
    return out;
  }
  Surface surface() {
    Surface out;
    surface(out);
    return out;
  }
  std::vector<std::uint8_t> save() {
    std::vector<std::uint8_t> out;
    save(out);
    return out;
  }
#endif

private:
  upt_scene *handle_ = nullptr;
};

/// A tool that a hand feels: the force on it at each millisecond, from a thread of its own. Another
/// thread steps its scene, with the same tool among the instruments.
class Haptics {
public:
  Haptics() noexcept = default;
  Haptics(Haptics &&other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}
  Haptics &operator=(Haptics &&other) noexcept {
    if (this != &other) {
      destroy();
      handle_ = std::exchange(other.handle_, nullptr);
    }
    return *this;
  }
  Haptics(const Haptics &) = delete;
  Haptics &operator=(const Haptics &) = delete;
  ~Haptics() { destroy(); }

  /// No step of the scene may be in flight. Destroys what this object already held.
  upt_status create(const Scene &scene, const upt_haptics_options &options) {
    upt_haptics *handle = nullptr;
    const upt_status status = check(upt_haptics_create(scene.get(), &options, &handle));
    if (status == UPT_OK) {
      destroy();
      handle_ = handle;
    }
    return status;
  }
  /// The tool at place `instrument` of the steps' instruments, with defaults for everything else.
  upt_status create(const Scene &scene, std::uint32_t instrument, const upt_instrument &tool) {
    upt_haptics_options options = make<upt_haptics_options>();
    options.instrument = instrument;
    options.tool = &tool;
    return create(scene, options);
  }

#ifndef UPT_NO_EXCEPTIONS
  /// As `create`.
  Haptics(const Scene &scene, const upt_haptics_options &options) { create(scene, options); }
  Haptics(const Scene &scene, std::uint32_t instrument, const upt_instrument &tool) {
    create(scene, instrument, tool);
  }
#endif

  /// The scene steps on without it.
  void destroy() noexcept {
    if (handle_ != nullptr) {
      upt_haptics_destroy(std::exchange(handle_, nullptr));
    }
  }

  /// Whether it holds one.
  explicit operator bool() const noexcept { return handle_ != nullptr; }
  /// For calls of the C ABI; stays this object's.
  upt_haptics *get() const noexcept { return handle_; }

  /// Never waits. If it fails, the force in out is zero.
  upt_status render(const upt_haptic_pose &pose, upt_haptic_force &out) {
    out = make<upt_haptic_force>();
    return check(upt_haptics_render(handle_, &pose, &out));
  }

#ifndef UPT_NO_EXCEPTIONS
  upt_haptic_force render(const upt_haptic_pose &pose) {
    upt_haptic_force out;
    render(pose, out);
    return out;
  }
#endif

private:
  upt_haptics *handle_ = nullptr;
};

/// When a host steps and what it shows: a scene's frames without lag, at any rate, uneven ones too.
///
/// Time is the host's own in seconds, from any origin, and does not go back. A step is made for
/// every `dt` of it, with the poses that the instruments had at that moment (between those of the
/// two frames around it), on the scene's worker. Where frames come slower than steps, the earlier
/// of the steps that are due are made in the frame's call: two at most, and only if the last one
/// took less than half of `dt`. A host that hangs for more than 0.1 s or two steps goes on from
/// where it is: the time that is lost makes no steps. Used by one thread.
class FrameClock {
public:
  /// dt: the scene's step, s: `step_s` of its options, for instance `model.info().frame_step_s`;
  /// `model.info().dt` where that is 0.
  explicit FrameClock(double dt) : dt_(dt) {}

  /// What acts beside the instruments (gravity, pressures, ties, what holds the organ): `fill` is
  /// called with the input of each step that this clock makes, and its moment, s. What the input
  /// points to must stay until the call that made the step returns. No step is in flight then, so
  /// `fill` may change the body (`cut`, `remove`, `restore`) before the step.
  void load(std::function<void(Input &, double)> fill) { load_ = std::move(fill); }

  /// One frame: takes a finished step, writes the tissue at `now` with the instruments where they
  /// are now, and submits the next step when it is due. Never waits for a step in flight.
  ///
  /// now: s. instruments: each in the same place in every frame. out: [n,3], mm, the region.
  /// A scene that cannot present shows its last two steps between each other, up to two steps late.
  /// A failed step is returned (or thrown) once; the next frame goes on.
  upt_status frame(Scene &scene, double now, span<const upt_instrument> instruments,
                   span<float> out) {
    return frame_of(scene, now, instruments, [&] { return show(scene, now, instruments, out); });
  }

  /// The same for a body that `load` changes: writes its surface. `surface` is the last one that
  /// `scene.surface` filled, also from within `load`; out gets three floats for each of its
  /// vertices, mm, from where it lies at rest.
  upt_status frame(Scene &scene, double now, span<const upt_instrument> instruments,
                   const Surface &surface, std::vector<float> &out) {
    return frame_of(scene, now, instruments, [&] {
      const upt_view shown = view(UPT_VIEW_SURFACE);
      out.resize(surface.rest.size());
      return upt_scene_present(scene.get(), Input(instruments).get(), since(now), &shown,
                               out.data(), out.size());
    });
  }

  /// Whether the last frame took a finished step: readings and statistics are new.
  bool landed() const noexcept { return landed_now_; }
  /// Instruments of the step that was taken last: as many readings there are.
  std::size_t landed_instruments() const noexcept { return landed_count_; }
  /// Whether a step was submitted that no frame has taken yet.
  bool in_flight() const noexcept { return in_flight_; }
  /// Back to rest, with the scene: waits for the step in flight, resets, and forgets the poses.
  upt_status reset(Scene &scene) {
    if (in_flight_) {
      upt_scene_wait(scene.get(), 0xFFFFFFFFU);
    }
    std::function<void(Input &, double)> load = std::move(load_);
    *this = FrameClock(dt_);
    load_ = std::move(load);
    return scene.reset();
  }

  /// The instruments are here at `now`. This call and those below are the parts of `frame`, for
  /// hosts that call the scene themselves.
  void moved(double now, span<const upt_instrument> instruments) {
    if (!started_) {
      started_ = true;
      next_ = published_ = now;
    }
    if (queue_.size() == MOST_POSES) {
      queue_.erase(queue_.begin());
    }
    queue_.push_back({now, {instruments.begin(), instruments.end()}});
  }
  /// Whether a step is due now.
  bool due(double now) const noexcept { return started_ && !in_flight_ && now + 1e-9 >= next_; }
  /// Whether another step is due after that: frames come slower than steps.
  bool behind(double now) const noexcept { return due(now) && now + 1e-9 >= next_ + dt_; }
  /// The instruments of the step that is submitted now, at its moment.
  const std::vector<upt_instrument> &start(double now) {
    if (now - next_ > std::fmax(2 * dt_, LOST_S)) {
      next_ = now;
    }
    place(next_);
    step_ = next_;
    next_ += dt_;
    in_flight_ = true;
    return poses_;
  }
  /// The step has landed, or has been refused: the state is that of its moment.
  void finished() noexcept {
    in_flight_ = false;
    landed_now_ = true;
    landed_count_ = poses_.size();
    published_ = step_;
  }
  /// The moment of the step that was submitted last, s.
  double step_time() const noexcept { return step_; }
  /// Its instruments.
  const std::vector<upt_instrument> &step_instruments() const noexcept { return poses_; }
  /// What `upt_scene_present` takes: the time since the last published step's moment, s.
  double since(double now) const noexcept { return now > published_ ? now - published_ : 0.0; }

private:
  static constexpr std::size_t MOST_POSES = 256;
  // Of a frame's own steps.
  static constexpr int MOST_MADE = 2;
  // A host that was away for longer does not make up for it, s.
  static constexpr double LOST_S = 0.1;
  // An instrument that moves farther from a frame to the next has been put there.
  static constexpr float PUT_MM = 40;
  struct Moment {
    double time;
    std::vector<upt_instrument> poses;
  };

  template <typename Show>
  upt_status frame_of(Scene &scene, double now, span<const upt_instrument> instruments, Show show) {
    moved(now, instruments);
    landed_now_ = false;
    upt_status result = collect(scene);
    look(scene);
    if (result == UPT_OK) {
      result = catch_up(scene, now);
    }
    upt_status status;
    if (due(now)) {
      Started step(*this);
      const Input input = loaded(start(now));
      status = show();
      if (status == UPT_OK) {
        status = upt_scene_submit(scene.get(), input.get());
        step.made = status >= 0;
      }
    } else {
      status = show();
      if (status == UPT_OK && in_flight_ && look(scene)) {
        // A step that finished after it was asked for has changed the state under the frame.
        status = show();
      }
    }
    return check(status < 0 ? status : result);
  }

  // A step that is not made after all, because `load` threw or a call failed, is not in flight.
  struct Started {
    explicit Started(FrameClock &clock) : clock(clock) {}
    Started(const Started &) = delete;
    Started &operator=(const Started &) = delete;
    ~Started() { clock.in_flight_ = clock.in_flight_ && made; }
    FrameClock &clock;
    bool made = false;
  };

  upt_status collect(Scene &scene) {
    if (!in_flight_) {
      return UPT_OK;
    }
    const upt_status status = upt_scene_poll(scene.get());
    if (status == UPT_PENDING) {
      return UPT_OK;
    }
    finished();
    return status;
  }

  // The steps that are due before the last one, in a host whose frames come slower than steps.
  upt_status catch_up(Scene &scene, double now) {
    for (int made = 0; made < MOST_MADE && behind(now); made++) {
      upt_scene_timing last = make<upt_scene_timing>();
      if (upt_scene_read_timing(scene.get(), &last) != UPT_OK || last.step_ms > 500 * dt_) {
        break;
      }
      Started step(*this);
      const Input input = loaded(start(now));
      const upt_status status = upt_scene_step(scene.get(), input.get(), nullptr, 0);
      step.made = true;
      finished();
      look(scene);
      if (status < 0) {
        return status;
      }
    }
    return UPT_OK;
  }

  // The input of the step that was started, with what acts at its moment.
  Input loaded(const std::vector<upt_instrument> &poses) const {
    Input input(poses);
    if (load_) {
      load_(input, step_);
    }
    return input;
  }

  // Whether a step has been published since the last look; poll() may not have told yet.
  bool look(Scene &scene) {
    upt_scene_stats stats = make<upt_scene_stats>();
    if (upt_scene_read_stats(scene.get(), &stats) != UPT_OK || stats.step_count == counted_) {
      return false;
    }
    counted_ = stats.step_count;
    if (in_flight_) {
      published_ = step_;
    }
    return true;
  }

  upt_status show(Scene &scene, double now, span<const upt_instrument> instruments,
                  span<float> out) {
    if (presents_) {
      const upt_status status = upt_scene_present(scene.get(), Input(instruments).get(), since(now),
                                                  nullptr, out.data(), out.size());
      if (status != UPT_ERR_UNSUPPORTED) {
        return status;
      }
      presents_ = false;
    }
    const double alpha = since(now) / dt_;
    return upt_scene_sample(scene.get(), alpha < 1 ? alpha : 1, nullptr, out.data(), out.size());
  }

  // The instruments at a moment: on the line between two frames, as they were before the first.
  void place(double time) {
    while (queue_.size() > 2 && queue_[1].time <= time) {
      queue_.erase(queue_.begin());
    }
    const Moment &from = queue_.front();
    const Moment &to = queue_.size() > 1 && time > from.time ? queue_[1] : from;
    poses_ = to.poses;
    const double way = to.time - from.time;
    const double part = way > 0 ? (time - from.time) / way : 1;
    if (from.poses.size() != to.poses.size() || part >= 1) {
      return;
    }
    for (std::size_t i = 0; i < poses_.size(); i++) {
      blend(from.poses[i], static_cast<float>(part), poses_[i]);
    }
  }

  static void blend(const upt_instrument &from, float part, upt_instrument &to) {
    float dot = 0, length = 0, far = 0;
    for (int k = 0; k < 3; k++) {
      far = std::fmax(far, std::fabs(to.position[k] - from.position[k]));
    }
    if (far > PUT_MM) {
      return;
    }
    for (int k = 0; k < 4; k++) {
      dot += from.rotation[k] * to.rotation[k];
    }
    for (int k = 0; k < 4; k++) {
      const float start = dot < 0 ? -from.rotation[k] : from.rotation[k];
      to.rotation[k] = start + part * (to.rotation[k] - start);
      length += to.rotation[k] * to.rotation[k];
    }
    for (int k = 0; k < 4; k++) {
      to.rotation[k] /= std::sqrt(length);
    }
    for (int k = 0; k < 3; k++) {
      to.position[k] = from.position[k] + part * (to.position[k] - from.position[k]);
    }
  }

  double dt_;
  double next_ = 0, step_ = 0, published_ = 0;
  std::uint64_t counted_ = 0;
  std::size_t landed_count_ = 0;
  bool started_ = false, in_flight_ = false, landed_now_ = false, presents_ = true;
  std::vector<Moment> queue_;
  std::vector<upt_instrument> poses_;
  std::function<void(Input &, double)> load_;
};

} // namespace upt

#endif // UPT_HPP
