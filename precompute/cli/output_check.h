#pragma once

#include <filesystem>

#include "transfer/file/atomic_file.h"

namespace rebounce::cli {

/// Throws Error if a result cannot be written to `path`. Call it before long work.
inline void check_can_write(const std::filesystem::path& path) {
  const AtomicFile never_committed(path);
}

}  // namespace rebounce::cli
