// A screenshot as PNG.
#pragma once

#include <string>

// Writes the back buffer. Throws when the file cannot be written.
void save_picture(const std::string &path, int width, int height);
