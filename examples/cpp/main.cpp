// A simulator with a window: an organ that a spatula presses, a blade cuts, an aspirator takes from
// and a coagulator hardens, stepped by libupt beside the frame.
//
//   simulator BUNDLE [--size WxH] [--scale MM] [--breathe] [--hang]
//   simulator BUNDLE --headless --frames N [--operate] [--screenshot OUT.png]
//
// With --breathe what holds the organ goes up and down, and the organ lags behind. With --hang a
// gall bladder hangs on its bed, and forceps draw it off.
// Headless, a script plays the mouse: the spatula comes to a flat place of the domain and presses,
// with --operate after the other tools have worked; time passes at 60 frames a second whatever the
// machine does, so that the picture depends on N alone.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <stdexcept>

#include "bladder.hpp"
#include "picture.hpp"
#include "script.hpp"
#include "view.hpp"

struct Options {
  std::string bundle, screenshot;
  bool headless = false, breathe = false, operate = false, hang = false;
  long frames = -1;
  int width = 1280, height = 800;
  float scale_mm = 10;
};

static Options parse(int argc, char **argv) {
  Options options;
  for (int i = 1; i < argc; i++) {
    const std::string word = argv[i];
    const auto value = [&]() -> const char * {
      if (i + 1 >= argc) {
        throw std::runtime_error(word + " needs a value");
      }
      return argv[++i];
    };
    if (word == "--headless") {
      options.headless = true;
    } else if (word == "--breathe") {
      options.breathe = true;
    } else if (word == "--hang") {
      options.hang = true;
    } else if (word == "--operate") {
      options.operate = true;
    } else if (word == "--frames") {
      options.frames = std::strtol(value(), nullptr, 10);
    } else if (word == "--screenshot") {
      options.screenshot = value();
    } else if (word == "--scale") {
      options.scale_mm = std::max(std::strtof(value(), nullptr), 0.1F);
    } else if (word == "--size") {
      if (std::sscanf(value(), "%dx%d", &options.width, &options.height) != 2) {
        throw std::runtime_error("--size wants WxH, for instance 1280x800");
      }
    } else if (word[0] != '-' && options.bundle.empty()) {
      options.bundle = word;
    } else {
      throw std::runtime_error("unknown argument " + word);
    }
  }
  if (options.bundle.empty()) {
    throw std::runtime_error(
        "usage: simulator BUNDLE [--size WxH] [--scale MM] [--breathe] [--hang] "
        "[--headless --frames N] [--operate] [--screenshot OUT.png]");
  }
  if (options.headless && options.frames < 1) {
    throw std::runtime_error("--headless needs --frames N");
  }
  if (options.operate && !options.headless) {
    throw std::runtime_error("--operate plays the mouse of a --headless run");
  }
  if (options.operate && (options.hang || options.breathe)) {
    throw std::runtime_error("--operate goes with neither --hang nor --breathe");
  }
  return options;
}

struct Window {
  GLFWwindow *handle = nullptr;
  double wheel = 0;

  explicit Window(const Options &options) {
    if (glfwInit() == GLFW_FALSE) {
      throw std::runtime_error("GLFW: no display; use xvfb-run for a machine without one");
    }
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
    glfwWindowHint(GLFW_SAMPLES, 4);
    glfwWindowHint(GLFW_VISIBLE, options.headless ? GLFW_FALSE : GLFW_TRUE);
    handle = glfwCreateWindow(options.width, options.height, "libupt simulator", nullptr, nullptr);
    if (handle == nullptr) {
      glfwTerminate();
      throw std::runtime_error("GLFW: no OpenGL 3.3 context");
    }
    glfwMakeContextCurrent(handle);
    glfwSwapInterval(options.headless ? 0 : 1);
    glfwSetWindowUserPointer(handle, this);
    glfwSetScrollCallback(handle, [](GLFWwindow *window, double, double amount) {
      static_cast<Window *>(glfwGetWindowUserPointer(window))->wheel += amount;
    });
    gl::load();
  }
  ~Window() {
    glfwDestroyWindow(handle);
    glfwTerminate();
  }
  bool button(int which) const { return glfwGetMouseButton(handle, which) == GLFW_PRESS; }
  bool key(int which) const { return glfwGetKey(handle, which) == GLFW_PRESS; }
};

// Keys choose the tool, take back a stroke (once a press of the key) and return to rest.
static void read_keys(const Window &window, Tissue &tissue, Bladder &bladder, Mouse &mouse) {
  static bool took_back = false;
  const Kind kinds[] = {Kind::press, Kind::blade, Kind::aspirate, Kind::coagulate};
  for (int i = 0; i < 4; i++) {
    if (window.key(GLFW_KEY_1 + i) && (i == 0 || tissue.can_be_cut())) {
      mouse.kind = kinds[i];
      bladder.take(false);
    }
  }
  bladder.take(bladder.held() || window.key(GLFW_KEY_5));
  mouse.forceps = bladder.held();
  if (window.key(GLFW_KEY_U) && !took_back) {
    tissue.undo();
  }
  took_back = window.key(GLFW_KEY_U);
  if (window.key(GLFW_KEY_R)) {
    tissue.reset();
    bladder.reset();
  }
}

// The mouse's ray; right drag and wheel move the camera.
static Ray read_mouse(Window &window, Camera &camera) {
  static double last_x = 0, last_y = 0;
  double x = 0, y = 0;
  int width = 1, height = 1;
  glfwGetCursorPos(window.handle, &x, &y);
  glfwGetWindowSize(window.handle, &width, &height);
  if (window.button(GLFW_MOUSE_BUTTON_RIGHT)) {
    camera.orbit(static_cast<float>(last_x - x) * 0.008F, static_cast<float>(y - last_y) * 0.008F);
  }
  camera.zoom(std::pow(0.9F, static_cast<float>(window.wheel)));
  window.wheel = 0;
  last_x = x;
  last_y = y;
  return camera.ray(static_cast<float>(2 * x / width - 1), static_cast<float>(1 - 2 * y / height));
}

static void run(const Options &options) {
  Tissue tissue(options.bundle);
  if (options.breathe) {
    tissue.breathe();
  }
  Window window(options);
  View view;
  view.create(tissue, options.scale_mm);
  Spatula spatula(std::min(10.0F, tissue.info().max_push_mm));
  Cutter cutter;
  Bladder bladder;

  const Hit site = tissue.flat_site();
  if (options.hang) {
    if (!tissue.solves_contact()) {
      throw std::runtime_error("nothing can hang on this bundle: it has no corrections");
    }
    bladder.hang(tissue, site);
  }
  Camera camera;
  // From the side of the site, along the surface a little, so that the dent is seen in profile; a
  // wound is looked into.
  const Frame around = frame_around(site.normal, {0, 0, 1});
  if (options.operate) {
    camera.frame(site.point, 0.28F * tissue.radius(),
                 around.z + around.x * 0.45F + around.y * 0.25F);
  } else {
    camera.frame(tissue.centre() * 0.4F + site.point * 0.6F, 0.45F * tissue.radius(),
                 around.z + around.x * 0.75F + around.y * 0.35F);
  }

  using Clock = std::chrono::steady_clock;
  const Clock::time_point start = Clock::now();
  double last = 0, frame_ms = 0, total_ms = 0;
  long frame = 0;
  while (glfwWindowShouldClose(window.handle) == GLFW_FALSE &&
         (options.frames < 0 || frame < options.frames)) {
    const Clock::time_point frame_start = Clock::now();
    int width = options.width, height = options.height;
    glfwGetFramebufferSize(window.handle, &width, &height);
    camera.set_size(width, height);

    double now;
    Mouse mouse{};
    if (options.headless) {
      now = static_cast<double>(frame) / 60;
      mouse = options.hang ? drawn_off(site, frame) : scripted(site, options.operate, frame);
    } else {
      now = std::chrono::duration<double>(frame_start - start).count();
      mouse = {read_mouse(window, camera), window.button(GLFW_MOUSE_BUTTON_LEFT), cutter.kind()};
      read_keys(window, tissue, bladder, mouse);
    }
    const std::optional<Hit> under = tissue.pick(mouse.ray);
    const bool presses = mouse.kind == Kind::press && !mouse.forceps;
    cutter.take(mouse.kind);
    cutter.hover(under);
    cutter.press(mouse.pressed);
    spatula.hover(presses ? under : std::nullopt, mouse.ray);
    const auto seconds = static_cast<float>(std::min(now - last, 0.1));
    spatula.move(seconds, presses && mouse.pressed);
    bladder.take(mouse.forceps);
    bladder.move(seconds, mouse.pressed);
    last = now;

    if (tissue.solves_contact()) {
      const std::optional<upt_instrument> tool = cutter.at_work();
      tissue.work(mouse.kind, tool ? &*tool : nullptr);
      tissue.frame(now, bladder.with(tissue, now, spatula.instruments()));
      bladder.read(tissue);
    } else {
      tissue.advance(now, spatula.contacts(tissue));
      tissue.sample(now);
    }
    if (options.headless) {
      tissue.finish();
    }
    view.draw(tissue, spatula, cutter, bladder, camera, width, height, frame_ms);
    frame++;
    if (frame == options.frames && !options.screenshot.empty()) {
      save_picture(options.screenshot, width, height);
    }
    glfwSwapBuffers(window.handle);
    glfwPollEvents();
    frame_ms = std::chrono::duration<double, std::milli>(Clock::now() - frame_start).count();
    total_ms += frame_ms;
  }
  tissue.finish();
  const upt_scene_stats stats = tissue.stats();
  std::printf("%ld frames, mean %.1f ms; %llu steps, median %.2f ms; push %.1f mm, largest "
              "displacement %.2f mm; contacts by %s\n",
              frame, total_ms / static_cast<double>(std::max(frame, 1L)),
              static_cast<unsigned long long>(stats.step_count), tissue.median_step_ms(),
              static_cast<double>(std::max(spatula.depth(), 0.0F)),
              static_cast<double>(tissue.max_displacement()),
              tissue.solves_contact()      ? "the library's solve"
              : spatula.library_contacts() ? "the library's nodes"
                                           : "the simulator");
  const Surgery &surgery = tissue.surgery();
  if (surgery.has_begun()) {
    std::printf("cut %.0f mm2, taken %.0f mm3, hardened %zu elements; the surface has changed %lld "
                "times\n",
                static_cast<double>(surgery.area()), static_cast<double>(surgery.removed()),
                surgery.hardened(), static_cast<long long>(surgery.changes()));
  }
  if (bladder.hangs()) {
    std::printf("a gall bladder on a bed of %zu ties: %zu torn, the others pull with %.0f mN\n",
                bladder.ties(), bladder.torn(), static_cast<double>(bladder.pull()));
  }
  if (tissue.reading()) {
    const upt_instrument_reading &felt = *tissue.reading();
    std::printf("the spatula feels %.0f mN at %u points, penetration %.2f mm; flags: %s\n",
                static_cast<double>(length(Vec3{felt.force[0], felt.force[1], felt.force[2]})),
                felt.contact_count, static_cast<double>(felt.penetration_mm),
                flag_names(stats.flags).c_str());
  }
}

int main(int argc, char **argv) {
  try {
    run(parse(argc, argv));
    upt::shutdown();
  } catch (const std::exception &error) {
    std::fprintf(stderr, "simulator: %s\n", error.what());
    return 1;
  }
  return 0;
}
