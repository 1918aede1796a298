#pragma once

#include <cstddef>
#include <filesystem>

#include "transfer/base/shared_array.h"

namespace rebounce {

/// Maps a file into memory, read-only. The array keeps the mapping alive. Throws Error if `path` is
/// missing, unreadable or not a regular file.
///
/// On a platform without mmap, only this function changes: it reads the file into a vector. A
/// mapped file must not be truncated; AtomicFile replaces files and never truncates one.
SharedArray<std::byte> map_file(const std::filesystem::path& path);

}  // namespace rebounce
