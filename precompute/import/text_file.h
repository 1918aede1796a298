#pragma once

#include <filesystem>
#include <string>

namespace rebounce {

/// All that is in a file, or comes out of a pipe. Throws Error that names it if it cannot be read.
std::string read_text_file(const std::filesystem::path& path);

}  // namespace rebounce
