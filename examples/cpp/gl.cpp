#include "gl.hpp"

#include <cstdint>
#include <stdexcept>
#include <string>

namespace gl {

#define UPT_GL_DEFINE(type, name) type name = nullptr;
UPT_GL_FUNCTIONS(UPT_GL_DEFINE)
#undef UPT_GL_DEFINE

template <typename Function> static void find(Function &function, const char *name) {
  function = reinterpret_cast<Function>(glfwGetProcAddress(name));
  if (function == nullptr) {
    throw std::runtime_error(std::string("OpenGL 3.3 is needed; missing: ") + name);
  }
}

void load() {
#define UPT_GL_LOAD(type, name) find(name, "gl" #name);
  UPT_GL_FUNCTIONS(UPT_GL_LOAD)
#undef UPT_GL_LOAD
}

GLuint program(const char *vertex, const char *fragment) {
  const GLuint result = CreateProgram();
  for (const auto &[kind, source] :
       {std::pair{GL_VERTEX_SHADER, vertex}, {GL_FRAGMENT_SHADER, fragment}}) {
    const GLuint shader = CreateShader(static_cast<GLenum>(kind));
    ShaderSource(shader, 1, &source, nullptr);
    CompileShader(shader);
    AttachShader(result, shader);
  }
  LinkProgram(result);
  GLint linked = 0;
  GetProgramiv(result, GL_LINK_STATUS, &linked);
  if (linked == 0) {
    char message[2048] = "";
    GetProgramInfoLog(result, sizeof message, nullptr, message);
    throw std::runtime_error(std::string("shader: ") + message);
  }
  return result;
}

void Vertices::create(std::initializer_list<int> sizes) {
  GenVertexArrays(1, &array);
  GenBuffers(1, &buffer);
  GenBuffers(1, &elements);
  BindVertexArray(array);
  BindBuffer(GL_ARRAY_BUFFER, buffer);
  int stride = 0;
  for (const int size : sizes) {
    stride += size;
  }
  std::uintptr_t offset = 0;
  GLuint index = 0;
  for (const int size : sizes) {
    EnableVertexAttribArray(index);
    VertexAttribPointer(index, size, GL_FLOAT, GL_FALSE, stride * 4,
                        reinterpret_cast<const void *>(offset * 4));
    offset += static_cast<std::uintptr_t>(size);
    index++;
  }
}

void Vertices::upload(const void *data, std::size_t bytes) {
  BindVertexArray(array);
  BindBuffer(GL_ARRAY_BUFFER, buffer);
  BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(bytes), data, GL_DYNAMIC_DRAW);
}

void Vertices::upload_elements(const void *data, std::size_t bytes) {
  BindVertexArray(array);
  BindBuffer(GL_ELEMENT_ARRAY_BUFFER, elements);
  BufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(bytes), data, GL_STATIC_DRAW);
}

} // namespace gl
