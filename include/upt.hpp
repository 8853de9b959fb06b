// libupt for C++17: move-only handles over upt.h, header only.
//
// Errors: every call returns the `upt_status`. By default a negative status is thrown as
// `upt::error`, so what a call returns is UPT_OK or UPT_PENDING. With UPT_NO_EXCEPTIONS defined
// nothing is thrown and the status must be looked at; the message is `upt::last_error()`. The forms
// that return a value (`Model::open(path)`, `model.info()`, ...) exist only with exceptions.
//
// Shapes, units and thread rules: upt.h. SPDX-License-Identifier: Apache-2.0 OR MIT
#ifndef UPT_HPP
#define UPT_HPP

#include "upt.h"

#include <cstddef>
#include <cstdint>
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
  constexpr span(std::nullptr_t) noexcept {}
  constexpr span(T *data, std::size_t size) noexcept : data_(data), size_(size) {}
  template <std::size_t N> constexpr span(T (&array)[N]) noexcept : data_(array), size_(N) {}
  template <typename Container, typename = std::enable_if_t<std::is_convertible_v<
                                    decltype(std::declval<Container &>().data()), T *>>>
  constexpr span(Container &&container) noexcept
      : data_(container.data()), size_(container.size()) {}

  constexpr T *data() const noexcept { return data_; }
  constexpr std::size_t size() const noexcept { return size_; }
  constexpr bool empty() const noexcept { return size_ == 0; }
  constexpr T *begin() const noexcept { return data_; }
  constexpr T *end() const noexcept { return data_ + size_; }
  constexpr T &operator[](std::size_t index) const noexcept { return data_[index]; }

private:
  T *data_ = nullptr;
  std::size_t size_ = 0;
};

/// Message of the last failed call of this thread.
inline const char *last_error() noexcept { return upt_last_error(); }

/// Whether the library that runs speaks the ABI of this header.
inline bool abi_matches() noexcept { return upt_abi_version() == UPT_ABI_VERSION; }

#ifndef UPT_NO_EXCEPTIONS
/// A failed call; the library's state is what it was before.
class error : public std::runtime_error {
public:
  error(upt_status status, const char *message) : std::runtime_error(message), status_(status) {}
  upt_status status() const noexcept { return status_; }

private:
  upt_status status_;
};
#endif

/// Throws on an error, or hands the status on when UPT_NO_EXCEPTIONS is defined.
inline upt_status check(upt_status status) {
#ifndef UPT_NO_EXCEPTIONS
  if (status < 0) {
    throw error(status, upt_last_error());
  }
#endif
  return status;
}

namespace detail {
/// Spans that do not belong together are refused here; the C call could not see it.
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
using instrument = upt_instrument;
using instrument_reading = upt_instrument_reading;
using instrument_contact = upt_instrument_contact;

inline upt_status init(const upt_init_options &options) { return check(upt_init(&options)); }
inline upt_status shutdown() { return check(upt_shutdown()); }
inline upt_status set_log(upt_log_fn callback, void *user, std::int32_t level) {
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

  /// Opens the bundle in the folder `path` (UTF-8); a model held before is closed.
  upt_status reopen(const char *path, const upt_model_options *options = nullptr) {
    upt_model *handle = nullptr;
    const upt_status status = check(upt_model_open(path, options, &handle));
    if (status == UPT_OK) {
      close();
      handle_ = handle;
    }
    return status;
  }

  /// Scenes made of the model live on.
  void close() noexcept {
    if (handle_ != nullptr) {
      upt_model_close(std::exchange(handle_, nullptr));
    }
  }

  explicit operator bool() const noexcept { return handle_ != nullptr; }
  upt_model *get() const noexcept { return handle_; }

  upt_status info(upt_model_info &out) const {
    out = make<upt_model_info>();
    return check(upt_model_get_info(handle_, &out));
  }
  upt_status positions(span<float> out) const {
    return check(upt_model_positions(handle_, out.data(), out.size()));
  }
  upt_status indices(std::int32_t set, std::vector<std::uint32_t> &out) const {
    std::uint64_t needed = 0;
    const upt_status status = check(upt_model_indices(handle_, set, nullptr, 0, &needed));
    if (status != UPT_OK) {
      return status;
    }
    out.resize(static_cast<std::size_t>(needed));
    return check(upt_model_indices(handle_, set, out.data(), out.size(), &needed));
  }
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
  std::vector<std::uint32_t> indices(std::int32_t set) const {
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

/// The convex hull of a tool's points, for instruments of shape UPT_SHAPE_HULL. Immutable: any
/// thread may use it. It must live while instruments that name it are handed to a scene.
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

  /// points: [n,3], mm, in the tool's own frame; a hull held before is destroyed.
  upt_status create(span<const float> points) {
    if (points.size() % 3 != 0) {
      return detail::mismatch();
    }
    upt_hull *handle = nullptr;
    const upt_status status = check(upt_hull_create(points.data(), points.size() / 3, &handle));
    if (status == UPT_OK) {
      destroy();
      handle_ = handle;
    }
    return status;
  }

#ifndef UPT_NO_EXCEPTIONS
  explicit Hull(span<const float> points) { create(points); }
#endif

  /// Steps that were submitted with it go on.
  void destroy() noexcept {
    if (handle_ != nullptr) {
      upt_hull_destroy(std::exchange(handle_, nullptr));
    }
  }

  explicit operator bool() const noexcept { return handle_ != nullptr; }
  upt_hull *get() const noexcept { return handle_; }

  /// A sliding instrument of this shape, without friction, at the origin of the mesh's frame.
  upt_instrument instrument() const noexcept {
    upt_instrument made = make<upt_instrument>();
    made.shape = UPT_SHAPE_HULL;
    made.rotation[3] = 1.0F;
    made.hull = handle_;
    return made;
  }

private:
  upt_hull *handle_ = nullptr;
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

  /// Makes a scene at rest; one held before is destroyed.
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

  explicit operator bool() const noexcept { return handle_ != nullptr; }
  upt_scene *get() const noexcept { return handle_; }

  upt_status reset() { return check(upt_scene_reset(handle_)); }

  /// displacement: [K,3] or empty (own state); collision: [K,3] or empty (no contact); out: [n,3]
  /// or empty. K is the size of the scene's mesh: the spans' sizes must fit it.
  upt_status step(span<const float> displacement, span<const float> collision, span<float> out) {
    return check(
        upt_scene_step(handle_, displacement.data(), collision.data(), out.data(), out.size()));
  }
  /// nodes: [m]; vectors: [m,3].
  upt_status step_contacts(span<const std::uint32_t> nodes, span<const float> vectors,
                           span<float> out = {}) {
    if (vectors.size() != 3 * nodes.size()) {
      return detail::mismatch();
    }
    return check(upt_scene_step_contacts(handle_, nodes.data(), vectors.data(), nodes.size(),
                                         out.data(), out.size()));
  }
  upt_status read(span<float> out) {
    return check(upt_scene_read(handle_, out.data(), out.size()));
  }

  upt_status submit(span<const std::uint32_t> nodes, span<const float> vectors) {
    if (vectors.size() != 3 * nodes.size()) {
      return detail::mismatch();
    }
    return check(upt_scene_submit(handle_, nodes.data(), vectors.data(), nodes.size()));
  }
  upt_status poll() { return check(upt_scene_poll(handle_)); }
  upt_status wait(std::uint32_t timeout_ms) { return check(upt_scene_wait(handle_, timeout_ms)); }
  upt_status sample(double alpha, span<float> out) {
    return check(upt_scene_sample(handle_, alpha, out.data(), out.size()));
  }

  /// Empty: all nodes.
  upt_status set_region(span<const std::uint32_t> nodes) {
    return check(
        upt_scene_set_region(handle_, nodes.empty() ? nullptr : nodes.data(), nodes.size()));
  }
  upt_status decode(span<const std::uint32_t> nodes, span<float> out) {
    return check(upt_scene_decode(handle_, nodes.data(), nodes.size(), out.data(), out.size()));
  }
  /// points: [n,3]; empty detaches.
  upt_status attach_points(span<const float> points) {
    if (points.size() % 3 != 0) {
      return detail::mismatch();
    }
    return check(upt_scene_attach_points(handle_, points.empty() ? nullptr : points.data(),
                                         points.size() / 3));
  }
  upt_status read_points(span<float> out) {
    return check(upt_scene_read_points(handle_, out.data(), out.size()));
  }
  upt_status sample_points(double alpha, span<float> out) {
    return check(upt_scene_sample_points(handle_, alpha, out.data(), out.size()));
  }

  /// A step that rigid instruments drive, their contact solved; out: [n,3] or empty.
  upt_status step_instruments(span<const upt_instrument> instruments, span<float> out = {}) {
    return check(upt_scene_step_instruments(handle_, instruments.data(), instruments.size(),
                                            out.data(), out.size()));
  }
  /// The same on the scene's worker; the instruments are copied.
  upt_status submit_instruments(span<const upt_instrument> instruments) {
    return check(upt_scene_submit_instruments(handle_, instruments.data(), instruments.size()));
  }
  /// What the tissue did to each instrument of the last step; out has one element for each.
  upt_status readings(span<upt_instrument_reading> out) {
    for (upt_instrument_reading &reading : out) {
      reading = make<upt_instrument_reading>();
    }
    return check(upt_scene_instrument_readings(handle_, out.data(), out.size()));
  }
  /// The points of the surface that push or hold instruments at the end of the last step.
  upt_status instrument_contacts(std::vector<upt_instrument_contact> &out) {
    std::uint64_t needed = 0;
    upt_status status = check(upt_scene_instrument_contacts(handle_, nullptr, 0, &needed));
    if (status == UPT_OK) {
      out.resize(static_cast<std::size_t>(needed));
      status = check(upt_scene_instrument_contacts(handle_, out.data(), out.size(), &needed));
      out.resize(static_cast<std::size_t>(needed));
    }
    return status;
  }

  /// nodes: [capacity]; vectors: [capacity,3]; count: contacts found.
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
  upt_status contact_force(span<float> out) {
    return check(upt_scene_contact_force(handle_, out.data(), out.size()));
  }

  upt_status stats(upt_scene_stats &out) const {
    out = make<upt_scene_stats>();
    return check(upt_scene_get_stats(handle_, &out));
  }
  upt_status save(std::vector<std::uint8_t> &out) {
    std::uint64_t needed = 0;
    const upt_status status = check(upt_scene_save(handle_, nullptr, 0, &needed));
    if (status != UPT_OK) {
      return status;
    }
    out.resize(static_cast<std::size_t>(needed));
    return check(upt_scene_save(handle_, out.data(), out.size(), &needed));
  }
  upt_status restore(span<const std::uint8_t> bytes) {
    return check(upt_scene_restore(handle_, bytes.data(), bytes.size()));
  }

#ifndef UPT_NO_EXCEPTIONS
  upt_scene_stats stats() const {
    upt_scene_stats out;
    stats(out);
    return out;
  }
  /// count: instruments of the last step.
  std::vector<upt_instrument_reading> readings(std::size_t count) {
    std::vector<upt_instrument_reading> out(count);
    readings(out);
    return out;
  }
  std::vector<upt_instrument_contact> instrument_contacts() {
    std::vector<upt_instrument_contact> out;
    instrument_contacts(out);
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

/// A tool that a hand feels: the force on it at each millisecond, from a thread of its own. Its
/// scene is stepped by another one, with the same tool among the instruments.
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

  /// No step of the scene may be in flight; an object held before is destroyed.
  upt_status create(const Scene &scene, const upt_haptics_options &options) {
    upt_haptics *handle = nullptr;
    const upt_status status = check(upt_haptics_create(scene.get(), &options, &handle));
    if (status == UPT_OK) {
      destroy();
      handle_ = handle;
    }
    return status;
  }
  /// The tool at place `instrument` of the steps' instruments, everything else as it is by default.
  upt_status create(const Scene &scene, std::uint32_t instrument, const upt_instrument &tool) {
    upt_haptics_options options = make<upt_haptics_options>();
    options.instrument = instrument;
    options.tool = &tool;
    return create(scene, options);
  }

#ifndef UPT_NO_EXCEPTIONS
  Haptics(const Scene &scene, const upt_haptics_options &options) { create(scene, options); }
  Haptics(const Scene &scene, std::uint32_t instrument, const upt_instrument &tool) {
    create(scene, instrument, tool);
  }
#endif

  void destroy() noexcept {
    if (handle_ != nullptr) {
      upt_haptics_destroy(std::exchange(handle_, nullptr));
    }
  }

  explicit operator bool() const noexcept { return handle_ != nullptr; }
  upt_haptics *get() const noexcept { return handle_; }

  /// Waits for nothing. Where it fails there is no force in out.
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

} // namespace upt

#endif // UPT_HPP
