#pragma once

#include <cstdlib>
#include <filesystem>

namespace rebounce::test {

/// The folder with third-party scenes and references that some tests use and the project does not
/// ship: $REBOUNCE_SHARED, or ../shared beside the checkout. May not exist.
inline std::filesystem::path shared_folder() {
  if (const char* folder = std::getenv("REBOUNCE_SHARED")) return folder;
  return std::filesystem::path(REBOUNCE_SOURCE_DIR) / ".." / "shared";
}

}  // namespace rebounce::test

/// Skips the current test, visibly, where the shared folder is not there.
#define REBOUNCE_NEED_SHARED(path)                                                         \
  if (!std::filesystem::exists(path)) {                                                    \
    GTEST_SKIP() << "needs " << (path).string() << " (set REBOUNCE_SHARED to its folder)"; \
  }
