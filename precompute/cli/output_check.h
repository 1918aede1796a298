#pragma once

#include <filesystem>

#include "transfer/file/atomic_file.h"

namespace rebounce::cli {

/// Throws Error before long work, not after it, if its result could not be written to `path`.
inline void check_can_write(const std::filesystem::path& path) {
  const AtomicFile never_committed(path);
}

}  // namespace rebounce::cli
