#pragma once

// What the fuzz targets share.

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <span>
#include <string_view>

/// Gives one input to a target. Returns 0; a fault ends the process. libFuzzer chose the name.
// NOLINTNEXTLINE(readability-identifier-naming)
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace rebounce::fuzz {

using Bytes = std::span<const std::uint8_t>;

/// Ends the process unless `holds`; `what` says what must hold.
inline void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "fuzz target: does not hold: %s\n", what);
  std::abort();
}

/// Refusals are one line.
inline void require_one_line(std::string_view message) {
  require(!message.empty() && message.find('\n') == std::string_view::npos,
          "a refusal is one line");
}

/// A folder in memory of this process alone. It has nothing but what a target writes to it, so that
/// inputs that name other files find none.
class InputFolder {
 public:
  InputFolder();
  ~InputFolder();
  InputFolder(const InputFolder&) = delete;
  InputFolder& operator=(const InputFolder&) = delete;

  /// Writes a file, or writes it anew, and returns its path.
  std::filesystem::path write(const char* name, Bytes bytes) const;

 private:
  std::filesystem::path path_;
};

}  // namespace rebounce::fuzz
