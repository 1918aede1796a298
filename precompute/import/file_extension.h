#pragma once

#include <cctype>
#include <filesystem>
#include <string>

namespace rebounce {

/// The extension of a file with its dot, in lower case.
inline std::string lower_case_extension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

}  // namespace rebounce
