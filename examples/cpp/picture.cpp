#include "picture.hpp"

#include <png.h>

#include <cstdint>
#include <stdexcept>
#include <vector>

#include "gl.hpp"

void save_picture(const std::string &path, int width, int height) {
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(width) * height * 3);
  gl::PixelStorei(GL_PACK_ALIGNMENT, 1);
  gl::ReadPixels(0, 0, width, height, GL_RGB, GL_UNSIGNED_BYTE, pixels.data());

  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = PNG_FORMAT_RGB;
  // OpenGL's first row is the lowest: a negative stride turns the picture over.
  if (png_image_write_to_file(&image, path.c_str(), 0, pixels.data(), -3 * width, nullptr) == 0) {
    throw std::runtime_error(path + ": " + image.message);
  }
}
