#include "view.hpp"

#include <algorithm>
#include <cctype>
#include <cstdio>

// Rest colour to dark red; the legend uses the same ramp.
#define RAMP                                                                                       \
  "vec3 ramp(float t) {\n"                                                                         \
  "  const vec3 stops[5] = vec3[](vec3(0.85, 0.68, 0.64), vec3(0.96, 0.84, 0.46),\n"               \
  "                               vec3(0.95, 0.56, 0.22), vec3(0.80, 0.18, 0.20),\n"               \
  "                               vec3(0.40, 0.05, 0.30));\n"                                      \
  "  float s = clamp(t, 0.0, 1.0) * 4.0;\n"                                                        \
  "  int i = min(int(s), 3);\n"                                                                    \
  "  return mix(stops[i], stops[i + 1], s - float(i));\n"                                          \
  "}\n"

static const Vec3 STOPS[5] = {{0.85F, 0.68F, 0.64F},
                              {0.96F, 0.84F, 0.46F},
                              {0.95F, 0.56F, 0.22F},
                              {0.80F, 0.18F, 0.20F},
                              {0.40F, 0.05F, 0.30F}};

static const Vec3 STEEL = {1, 1, 1};

static const char *TISSUE_VERTEX = R"(#version 330 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in float displacement;
layout(location = 3) in float cavity;
uniform mat4 camera;
out vec3 world, side;
out float moved, depth;
void main() {
  world = position;
  side = normal;
  moved = displacement;
  depth = cavity;
  gl_Position = camera * vec4(position, 1.0);
})";

static const char *TISSUE_FRAGMENT = "#version 330 core\n" RAMP R"(
in vec3 world, side;
in float moved, depth;
uniform vec3 eye;
uniform float scale, inside;
out vec4 result;
void main() {
  vec3 v = normalize(eye - world);
  // What a cut has laid open is lit face by face.
  vec3 n = inside > 0.5 ? normalize(cross(dFdx(world), dFdy(world))) : normalize(side);
  vec3 up = vec3(0.0, 0.0, 1.0);
  vec3 key = normalize(v + 0.9 * up + 0.5 * cross(up, v));
  vec3 fill = normalize(v - 1.2 * cross(up, v));
  vec3 tone = ramp(moved / scale) * mix(1.0, 0.52, smoothstep(-0.05, 0.30, depth));
  tone = mix(tone, vec3(0.50, 0.10, 0.10), inside);
  float diffuse = 0.70 * max(dot(n, key), 0.0) + 0.16 * max(dot(n, fill), 0.0) + 0.22;
  float shine = pow(max(dot(n, normalize(key + v)), 0.0), 48.0);
  float rim = pow(1.0 - max(dot(n, v), 0.0), 3.0);
  result = vec4(tone * diffuse + 0.30 * shine + 0.05 * rim, 1.0);
})";

// The surface at rest, where the tissue has left it: seen through, brighter where it is seen edge
// on.
static const char *GHOST_VERTEX = R"(#version 330 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in float displacement;
uniform mat4 camera;
out vec3 world, side;
out float moved;
void main() {
  world = position;
  side = normal;
  moved = displacement;
  gl_Position = camera * vec4(position, 1.0);
})";

static const char *GHOST_FRAGMENT = R"(#version 330 core
in vec3 world, side;
in float moved;
uniform vec3 eye;
out vec4 result;
void main() {
  float facing = abs(dot(normalize(side), normalize(eye - world)));
  float there = smoothstep(2.0, 5.0, moved);
  result = vec4(0.62, 0.80, 0.96, there * mix(0.55, 0.16, facing));
})";

static const char *METAL_VERTEX = R"(#version 330 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
uniform mat4 camera, place;
out vec3 world, side;
void main() {
  world = (place * vec4(position, 1.0)).xyz;
  side = mat3(place) * normal;
  gl_Position = camera * vec4(world, 1.0);
})";

static const char *METAL_FRAGMENT = R"(#version 330 core
in vec3 world, side;
uniform vec3 eye, tint;
out vec4 result;
void main() {
  vec3 n = normalize(side), v = normalize(eye - world), up = vec3(0.0, 0.0, 1.0);
  vec3 key = normalize(v + 0.9 * up + 0.5 * cross(up, v));
  float shine = pow(max(dot(n, normalize(key + v)), 0.0), 24.0);
  float sky = 0.5 + 0.5 * n.z;
  vec3 tone = mix(vec3(0.26, 0.29, 0.34), vec3(0.70, 0.74, 0.80), sky) * tint;
  result = vec4(tone * (0.35 + 0.65 * max(dot(n, key), 0.0)) + 0.6 * shine, 1.0);
})";

static const char *BACKGROUND_VERTEX = R"(#version 330 core
layout(location = 0) in vec2 corner;
out float height;
void main() {
  height = 0.5 + 0.5 * corner.y;
  gl_Position = vec4(corner, 0.0, 1.0);
})";

static const char *BACKGROUND_FRAGMENT = R"(#version 330 core
in float height;
out vec4 result;
void main() { result = vec4(mix(vec3(0.06, 0.08, 0.10), vec3(0.17, 0.21, 0.25), height), 1.0); })";

// A box with flat sides: triangles of position and normal.
static void add_box(std::vector<float> &out, Vec3 centre, Vec3 half, const Frame &frame) {
  const auto point = [&](float x, float y, float z) {
    return centre + frame.x * (x * half.x) + frame.y * (y * half.y) + frame.z * (z * half.z);
  };
  const Vec3 axes[3] = {frame.x, frame.y, frame.z};
  for (int axis = 0; axis < 3; axis++) {
    for (const float sign : {-1.0F, 1.0F}) {
      const Vec3 normal = axes[axis] * sign;
      const float square[6][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, -1}, {1, 1}, {-1, 1}};
      for (const auto &[a, b] : square) {
        float at[3];
        at[axis] = sign;
        at[(axis + 1) % 3] = a;
        at[(axis + 2) % 3] = b;
        const Vec3 p = point(at[0], at[1], at[2]);
        out.insert(out.end(), {p.x, p.y, p.z, normal.x, normal.y, normal.z});
      }
    }
  }
}

static GLsizei upload_metal(gl::Vertices &vertices, const std::vector<float> &metal) {
  vertices.create({3, 3});
  vertices.upload(metal.data(), metal.size() * sizeof metal[0]);
  return static_cast<GLsizei>(metal.size() / 6);
}

void View::create(const Tissue &tissue, float scale_mm) {
  scale_mm_ = scale_mm;
  tissue_program_ = gl::program(TISSUE_VERTEX, TISSUE_FRAGMENT);
  metal_program_ = gl::program(METAL_VERTEX, METAL_FRAGMENT);
  background_program_ = gl::program(BACKGROUND_VERTEX, BACKGROUND_FRAGMENT);

  tissue_.create({3, 3, 1, 1});
  const auto &triangles = tissue.triangles();
  tissue_.upload_elements(triangles.data(), triangles.size() * sizeof triangles[0]);

  ghost_program_ = gl::program(GHOST_VERTEX, GHOST_FRAGMENT);
  ghost_.create({3, 3, 1});
  ghost_.upload_elements(triangles.data(), triangles.size() * sizeof triangles[0]);

  // The spatula's blade, and a handle that rises from its end.
  std::vector<float> metal;
  const Frame straight = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  add_box(metal, {}, Spatula::HALF, straight);
  const Vec3 rise = normalized({0, 0.62F, 0.78F});
  const Frame tilted = {{1, 0, 0}, rise, cross({1, 0, 0}, rise)};
  const Vec3 root = {0, Spatula::HALF.y - 0.5F, 0};
  add_box(metal, root + rise * 12, {2.4F, 13, 0.7F}, tilted);
  add_box(metal, root + rise * 52, {3.0F, 28, 2.2F}, tilted);
  metal_count_ = upload_metal(metal_, metal);
  // Cutters, from the tip up their axis: a blade and its handle, a tube.
  std::vector<float> blade, tube;
  add_box(blade, {0, 12, 0}, {2.2F, 12, 0.25F}, straight);
  add_box(blade, {0, 54, 0}, {3.0F, 30, 1.6F}, straight);
  blade_count_ = upload_metal(blade_, blade);
  add_box(tube, {0, 40, 0}, {Cutter::RADIUS * 0.7F, 40, Cutter::RADIUS * 0.7F}, straight);
  tube_count_ = upload_metal(tube_, tube);

  bladder_.create({3, 3});

  const float corners[6] = {-1, -1, 3, -1, -1, 3};
  background_.create({2});
  background_.upload(corners, sizeof corners);
  overlay_.create();
}

void View::draw_background() {
  gl::Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  gl::Disable(GL_DEPTH_TEST);
  gl::UseProgram(background_program_);
  gl::BindVertexArray(background_.array);
  gl::DrawArrays(GL_TRIANGLES, 0, 3);
}

static GLint uniform(GLuint program, const char *name) {
  return gl::GetUniformLocation(program, name);
}

void View::draw(const Tissue &tissue, const Spatula &spatula, const Cutter &cutter,
                const Bladder &bladder, const Camera &camera, int width, int height,
                double frame_ms) {
  const Mat4 matrix = camera.matrix();
  const Vec3 eye = camera.eye();
  gl::Viewport(0, 0, width, height);
  draw_background();

  gl::Enable(GL_DEPTH_TEST);
  draw_tissue(tissue, matrix, eye);
  if (bladder.hangs()) {
    draw_bladder(tissue, bladder, matrix, eye);
  }
  if (cutter.kind() == Kind::press && spatula.visible()) {
    draw_metal(metal_, metal_count_, placed(spatula.frame(), spatula.centre()), matrix, eye, STEEL);
  } else if (cutter.visible()) {
    const bool is_blade = cutter.kind() == Kind::blade;
    draw_metal(is_blade ? blade_ : tube_, is_blade ? blade_count_ : tube_count_,
               placed(cutter.frame(), cutter.tip()), matrix, eye, STEEL);
  }
  if (!tissue.surgery().has_begun()) {
    draw_ghost(tissue, matrix, eye);
  }
  draw_numbers(tissue, spatula, cutter, bladder, width, height, frame_ms);
}

void View::draw_tissue(const Tissue &tissue, const Mat4 &matrix, Vec3 eye) {
  const auto &triangles = tissue.triangles();
  if (uploaded_ != tissue.surgery().changes()) {
    uploaded_ = tissue.surgery().changes();
    tissue_.upload_elements(triangles.data(), triangles.size() * sizeof triangles[0]);
  }
  gl::UseProgram(tissue_program_);
  gl::UniformMatrix4fv(uniform(tissue_program_, "camera"), 1, GL_FALSE, matrix.data());
  gl::Uniform3f(uniform(tissue_program_, "eye"), eye.x, eye.y, eye.z);
  gl::Uniform1f(uniform(tissue_program_, "scale"), scale_mm_);
  tissue_.upload(tissue.vertices().data(), tissue.vertices().size() * sizeof(float));
  const std::size_t ranges[3] = {0, tissue.outside(), triangles.size()};
  for (int inside = 0; inside < 2; inside++) {
    gl::Uniform1f(uniform(tissue_program_, "inside"), static_cast<float>(inside));
    const auto count = static_cast<GLsizei>(ranges[inside + 1] - ranges[inside]);
    gl::DrawElements(GL_TRIANGLES, count, GL_UNSIGNED_INT,
                     reinterpret_cast<const void *>(ranges[inside] * sizeof triangles[0]));
  }
}

void View::draw_metal(const gl::Vertices &metal, GLsizei count, const Mat4 &place,
                      const Mat4 &matrix, Vec3 eye, Vec3 tint) {
  gl::UseProgram(metal_program_);
  gl::UniformMatrix4fv(uniform(metal_program_, "camera"), 1, GL_FALSE, matrix.data());
  gl::UniformMatrix4fv(uniform(metal_program_, "place"), 1, GL_FALSE, place.data());
  gl::Uniform3f(uniform(metal_program_, "eye"), eye.x, eye.y, eye.z);
  gl::Uniform3f(uniform(metal_program_, "tint"), tint.x, tint.y, tint.z);
  gl::BindVertexArray(metal.array);
  gl::DrawArrays(GL_TRIANGLES, 0, count);
}

void View::draw_bladder(const Tissue &tissue, const Bladder &bladder, const Mat4 &matrix,
                        Vec3 eye) {
  const auto draw = [&](const std::vector<float> &triangles, Vec3 tint) {
    bladder_.upload(triangles.data(), triangles.size() * sizeof triangles[0]);
    const auto count = static_cast<GLsizei>(triangles.size() / 6);
    draw_metal(bladder_, count, identity(), matrix, eye, tint);
  };
  draw(bladder.ball(tissue), {0.62F, 1.0F, 0.45F});
  draw(bladder.threads(tissue), {1.3F, 1.15F, 0.7F});
}

void View::draw_ghost(const Tissue &tissue, const Mat4 &matrix, Vec3 eye) {
  gl::Enable(GL_BLEND);
  gl::BlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  gl::DepthMask(GL_FALSE);
  gl::UseProgram(ghost_program_);
  gl::UniformMatrix4fv(uniform(ghost_program_, "camera"), 1, GL_FALSE, matrix.data());
  gl::Uniform3f(uniform(ghost_program_, "eye"), eye.x, eye.y, eye.z);
  ghost_.upload(tissue.ghost().data(), tissue.ghost().size() * sizeof(float));
  gl::DrawElements(GL_TRIANGLES, static_cast<GLsizei>(tissue.triangles().size()), GL_UNSIGNED_INT,
                   nullptr);
  gl::DepthMask(GL_TRUE);
  gl::Disable(GL_BLEND);
}

std::string flag_names(std::uint32_t flags) {
  static const struct {
    std::uint32_t flag;
    const char *name;
  } names[] = {
      {UPT_FLAG_PUSH, "push"},
      {UPT_FLAG_CONTACT_AREA, "area"},
      {UPT_FLAG_SITE, "site"},
      {UPT_FLAG_RATE, "rate"},
      {UPT_FLAG_SITES, "sites"},
      {UPT_FLAG_BOUND, "bound"},
      {UPT_FLAG_NON_FINITE, "nonfinite"},
      {UPT_FLAG_INVERTED, "inverted"},
      {UPT_FLAG_GROWTH, "growth"},
      {UPT_FLAG_CLAMPED, "clamped"},
      {UPT_FLAG_REGULARISED, "regularised"},
      {UPT_FLAG_FELL_BACK, "fell back"},
      {UPT_FLAG_ERROR, "error"},
      {UPT_FLAG_DEEP, "deep"},
  };
  std::string out;
  for (const auto &entry : names) {
    if ((flags & entry.flag) != 0) {
      out += (out.empty() ? "" : ", ") + std::string(entry.name);
    }
  }
  return out.empty() ? "none" : out;
}

// What the chosen tool has done to the body.
void View::draw_work(const Tissue &tissue, const Cutter &cutter, const Bladder &bladder,
                     int height) {
  static const char *const names[] = {"SPATULA", "BLADE", "ASPIRATOR", "COAGULATOR"};
  const Surgery &surgery = tissue.surgery();
  const auto &force = surgery.force();
  std::string line = bladder.held() ? "FORCEPS" : names[static_cast<int>(cutter.kind())];
  if (surgery.has_begun()) {
    char work[120];
    std::snprintf(work, sizeof work, "   CUT %.0f MM2   TAKEN %.0f MM3   HARDENED %zu",
                  static_cast<double>(surgery.area()), static_cast<double>(surgery.removed()),
                  surgery.hardened());
    line += work;
    if (cutter.kind() == Kind::blade) {
      std::snprintf(work, sizeof work, "   BLADE %.0f MN",
                    static_cast<double>(length({force[0], force[1], force[2]})));
      line += work;
    }
  }
  overlay_.text(16, static_cast<float>(height) - 72, 2, line, {0.92F, 0.94F, 0.96F});
  overlay_.text(16, static_cast<float>(height) - 50, 2,
                "1: SPATULA   2: BLADE   3: ASPIRATOR   4: COAGULATOR   U: UNDO",
                {0.62F, 0.68F, 0.74F});
}

void View::draw_numbers(const Tissue &tissue, const Spatula &spatula, const Cutter &cutter,
                        const Bladder &bladder, int width, int height, double frame_ms) {
  const Vec3 bright = {0.92F, 0.94F, 0.96F}, dim = {0.62F, 0.68F, 0.74F};
  const upt_scene_stats stats = tissue.stats();
  char line[160];
  overlay_.begin(width, height);
  std::snprintf(line, sizeof line, "FRAME %5.1f MS   STEP %5.2f MS", frame_ms,
                tissue.timing().step_ms);
  overlay_.text(16, 16, 2, line, bright);
  std::snprintf(line, sizeof line, "K %llu   CONTACT NODES %llu   PUSH %4.1f MM   MAX %4.1f MM%s",
                static_cast<unsigned long long>(tissue.info().node_count),
                static_cast<unsigned long long>(stats.contact_count),
                static_cast<double>(std::max(spatula.depth(), 0.0F)),
                static_cast<double>(tissue.max_displacement()), stats.sleeping ? "   ASLEEP" : "");
  overlay_.text(16, 38, 2, line, dim);
  if (tissue.reading()) {
    const upt_instrument_reading &felt = *tissue.reading();
    std::snprintf(line, sizeof line, "FORCE %5.0f MN   PENETRATION %4.2f MM",
                  static_cast<double>(length(Vec3{felt.force[0], felt.force[1], felt.force[2]})),
                  static_cast<double>(felt.penetration_mm));
    overlay_.text(16, 60, 2, line, bright);
  }
  if (stats.flags != 0) {
    std::string names = "FLAGS: " + flag_names(stats.flags);
    std::transform(names.begin(), names.end(), names.begin(),
                   [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    overlay_.text(16, 82, 2, names, {0.95F, 0.72F, 0.29F});
  }
  overlay_.text(16, static_cast<float>(height) - 28, 2,
                "LEFT: WORK   RIGHT: TURN   WHEEL: ZOOM   R: RESET", dim);
  draw_work(tissue, cutter, bladder, height);
  if (bladder.hangs()) {
    std::snprintf(line, sizeof line, "BED %zu TIES   TORN %zu   PULL %.0f MN   5: FORCEPS",
                  bladder.ties(), bladder.torn(), static_cast<double>(bladder.pull()));
    overlay_.text(16, static_cast<float>(height) - 94, 2, line, bright);
  }

  const float left = static_cast<float>(width) - 250, top = 16;
  for (int i = 0; i < 100; i++) {
    const float s = 0.04F * static_cast<float>(i);
    const int stop = std::min(static_cast<int>(s), 3);
    const Vec3 colour =
        STOPS[stop] + (STOPS[stop + 1] - STOPS[stop]) * (s - static_cast<float>(stop));
    overlay_.box(left + 2 * static_cast<float>(i), top, 2, 12, colour);
  }
  overlay_.text(left, top + 18, 2, "0", dim);
  std::snprintf(line, sizeof line, "%.0f MM", static_cast<double>(scale_mm_));
  overlay_.text(left + 164, top + 18, 2, line, dim);
  overlay_.draw();
}
