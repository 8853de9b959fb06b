// The OpenGL 3.3 functions that the simulator uses, loaded by GLFW; shaders.
#pragma once

#include <cstddef>
#include <initializer_list>

#define GLFW_INCLUDE_GLCOREARB
#include <GLFW/glfw3.h>

#define UPT_GL_FUNCTIONS(X)                                                                        \
  X(PFNGLATTACHSHADERPROC, AttachShader)                                                           \
  X(PFNGLBINDBUFFERPROC, BindBuffer)                                                               \
  X(PFNGLBINDVERTEXARRAYPROC, BindVertexArray)                                                     \
  X(PFNGLBLENDFUNCPROC, BlendFunc)                                                                 \
  X(PFNGLBUFFERDATAPROC, BufferData)                                                               \
  X(PFNGLCLEARPROC, Clear)                                                                         \
  X(PFNGLCLEARCOLORPROC, ClearColor)                                                               \
  X(PFNGLCOMPILESHADERPROC, CompileShader)                                                         \
  X(PFNGLCREATEPROGRAMPROC, CreateProgram)                                                         \
  X(PFNGLCREATESHADERPROC, CreateShader)                                                           \
  X(PFNGLDEPTHMASKPROC, DepthMask)                                                                 \
  X(PFNGLDISABLEPROC, Disable)                                                                     \
  X(PFNGLDRAWARRAYSPROC, DrawArrays)                                                               \
  X(PFNGLDRAWELEMENTSPROC, DrawElements)                                                           \
  X(PFNGLENABLEPROC, Enable)                                                                       \
  X(PFNGLENABLEVERTEXATTRIBARRAYPROC, EnableVertexAttribArray)                                     \
  X(PFNGLGENBUFFERSPROC, GenBuffers)                                                               \
  X(PFNGLGENVERTEXARRAYSPROC, GenVertexArrays)                                                     \
  X(PFNGLGETPROGRAMINFOLOGPROC, GetProgramInfoLog)                                                 \
  X(PFNGLGETPROGRAMIVPROC, GetProgramiv)                                                           \
  X(PFNGLGETUNIFORMLOCATIONPROC, GetUniformLocation)                                               \
  X(PFNGLLINKPROGRAMPROC, LinkProgram)                                                             \
  X(PFNGLPIXELSTOREIPROC, PixelStorei)                                                             \
  X(PFNGLREADPIXELSPROC, ReadPixels)                                                               \
  X(PFNGLSHADERSOURCEPROC, ShaderSource)                                                           \
  X(PFNGLUNIFORM1FPROC, Uniform1f)                                                                 \
  X(PFNGLUNIFORM2FPROC, Uniform2f)                                                                 \
  X(PFNGLUNIFORM3FPROC, Uniform3f)                                                                 \
  X(PFNGLUNIFORMMATRIX4FVPROC, UniformMatrix4fv)                                                   \
  X(PFNGLUSEPROGRAMPROC, UseProgram)                                                               \
  X(PFNGLVERTEXATTRIBPOINTERPROC, VertexAttribPointer)                                             \
  X(PFNGLVIEWPORTPROC, Viewport)

namespace gl {

#define UPT_GL_DECLARE(type, name) extern type name;
UPT_GL_FUNCTIONS(UPT_GL_DECLARE)
#undef UPT_GL_DECLARE

// Call once a context is current. Throws when a function is missing.
void load();

// Vertex and fragment shader -> program. Throws with the driver's message.
GLuint program(const char *vertex, const char *fragment);

// A vertex array of float attributes of the given sizes, interleaved in one buffer.
struct Vertices {
  GLuint array = 0, buffer = 0, elements = 0;
  void create(std::initializer_list<int> sizes);
  void upload(const void *data, std::size_t bytes);
  void upload_elements(const void *data, std::size_t bytes);
};

} // namespace gl
